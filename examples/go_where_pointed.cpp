#include <cmath>
#include <geometry_msgs/PoseStamped.h>
#include <map>
#include <openpose_ros_msgs/PersonSignalsArray.h>
#include <ros/ros.h>

using openpose_ros_msgs::PersonGesture;
using openpose_ros_msgs::PersonPointing;
using openpose_ros_msgs::PersonSignalsArray;

constexpr double HELD = 1.0, LATE = 0.7, OFF = 0.8, FARTHEST = 5.0;  // [s], [s], [m], [m]

/// Return how far away from its origin a ray means something [m], and the place; infinite: nothing is known.
double meant(const PersonPointing& ray, geometry_msgs::Point* place)
{
  if (!std::isnan(ray.hit.x))
  {
    *place = ray.hit;
    const double dx = ray.hit.x - ray.origin.x, dy = ray.hit.y - ray.origin.y, dz = ray.hit.z - ray.origin.z;
    return ray.target.empty() ? std::hypot(dx, std::hypot(dy, dz)) : 0.0;
  }
  if (ray.direction.z > -0.1)  // hardly goes down to the floor, z = 0 of the map
    return INFINITY;
  const double way = -ray.origin.z / ray.direction.z;
  place->x = ray.origin.x + way * ray.direction.x;
  place->y = ray.origin.y + way * ray.direction.y;
  return way;
}

class GoWherePointed
{
public:
  GoWherePointed()
    : goal_(node_.advertise<geometry_msgs::PoseStamped>("move_base_simple/goal", 1))
    , signals_(node_.subscribe("openpose_ros/skeleton_3d/people_signals", 1, &GoWherePointed::onSignals, this))
  {
  }

private:
  void onSignals(const PersonSignalsArray::ConstPtr& signals)
  {
    if (std::abs((ros::Time::now() - signals->header.stamp).toSec()) > LATE)
      return;
    for (const auto& person : signals->persons)
      for (const auto& gesture : person.gestures)
        if (gesture.name == PersonGesture::POINT && !gesture.pointing.empty() &&
            (signals->header.stamp - gesture.since).toSec() >= HELD && done_[person.person_ID] != gesture.since)
          go(signals->header, person.person_ID, gesture);
  }

  void go(const std_msgs::Header& header, uint32_t person, const PersonGesture& gesture)
  {
    const PersonPointing& ray = gesture.pointing[0];
    geometry_msgs::PoseStamped goal;
    goal.header = header;
    const double way = meant(ray, &goal.pose.position);
    if (way > FARTHEST || ray.sigma * way > OFF)
      return;
    done_[person] = gesture.since;
    goal.pose.position.z = 0.0;
    const double half = std::atan2(ray.direction.y, ray.direction.x) / 2;
    goal.pose.orientation.z = std::sin(half);
    goal.pose.orientation.w = std::cos(half);
    goal_.publish(goal);
  }

  ros::NodeHandle node_;
  std::map<uint32_t, ros::Time> done_;  // by person, when a pointing began that was answered
  ros::Publisher goal_;
  ros::Subscriber signals_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "go_where_pointed");
  GoWherePointed node;
  ros::spin();
}
