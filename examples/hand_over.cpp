#include <cmath>
#include <geometry_msgs/PointStamped.h>
#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <ros/ros.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>
#include <tf2_ros/transform_listener.h>

using geometry_msgs::Point;
using openpose_ros_msgs::BodypartDetection_3d;
using openpose_ros_msgs::PersonDetection_3dArray;

constexpr double REACH = 0.25, SIGMA = 0.05, REST = 0.15, FARTHEST = 1.5;  // [m], [m], [m/s], [m]

class HandOver
{
public:
  HandOver()
    : listener_(buffer_)
    , output_(node_.advertise<geometry_msgs::PointStamped>("hand_over", 1))
    , people_(node_.subscribe("openpose_ros/skeleton_3d/detected_poses_3d", 1, &HandOver::onPeople, this))
  {
  }

private:
  void onPeople(const PersonDetection_3dArray::ConstPtr& people)
  {
    if ((newest_ - people->header.stamp).toSec() > 0.5)
      buffer_.clear();  // a recording begins again
    newest_ = people->header.stamp;
    try
    {
      camera_ = buffer_.lookupTransform("base_link", people->header.frame_id, people->header.stamp, ros::Duration(0.2));
    }
    catch (const tf2::TransformException& error)
    {
      ROS_WARN_THROTTLE(5.0, "people are not used: %s", error.what());
      return;
    }
    nearest_ = FARTHEST;
    geometry_msgs::PointStamped wrist;
    wrist.header.stamp = people->header.stamp;
    wrist.header.frame_id = "base_link";
    for (size_t i = 0; i < people->persons.size() && i < people->velocities.size(); ++i)
    {
      const auto& person = people->persons[i];
      const auto& velocity = people->velocities[i];
      look(person.left_wrist, person.left_shoulder, person.left_hip, velocity.left_wrist, &wrist.point);
      look(person.right_wrist, person.right_shoulder, person.right_hip, velocity.right_wrist, &wrist.point);
    }
    if (nearest_ < FARTHEST)
      output_.publish(wrist);
  }

  /// Takes a wrist that is held out to the robot, if it is the nearest so far.
  void look(const BodypartDetection_3d& wrist, const BodypartDetection_3d& shoulder, const BodypartDetection_3d& hip,
            const geometry_msgs::Vector3& velocity, Point* found)
  {
    const double speed = std::hypot(velocity.x, std::hypot(velocity.y, velocity.z));
    if (wrist.status != BodypartDetection_3d::MEASURED || !(wrist.sigma < SIGMA) || !(speed < REST))  // NaN: not known
      return;
    const Point hand = inBase(wrist), from = inBase(shoulder);
    const double distance = std::hypot(hand.x, hand.y), reach = std::hypot(from.x, from.y) - distance;
    if (distance < nearest_ && reach > REACH && inBase(hip).z < hand.z && hand.z < from.z)  // false where one is NaN
    {
      nearest_ = distance;
      *found = hand;
    }
  }

  Point inBase(const BodypartDetection_3d& part) const
  {
    Point point;
    point.x = part.x;
    point.y = part.y;
    point.z = part.z;
    tf2::doTransform(point, point, camera_);
    return point;
  }

  ros::NodeHandle node_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  geometry_msgs::TransformStamped camera_;
  ros::Time newest_;
  double nearest_ = FARTHEST;
  ros::Publisher output_;
  ros::Subscriber people_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "hand_over");
  HandOver node;
  ros::spin();
}
