#include <cmath>
#include <openpose_ros_msgs/PersonSignalsArray.h>
#include <ros/ros.h>
#include <std_msgs/Int32.h>

using openpose_ros_msgs::PersonSignalsArray;

constexpr double ZONE[][2] = {{1.0, -1.0}, {3.0, -1.0}, {3.0, 1.0}, {1.0, 1.0}};  // x, y [m], frame of the signals
constexpr double LATE = 0.7;  // [s]

bool isInside(const geometry_msgs::Point& place)
{
  constexpr size_t corners = sizeof(ZONE) / sizeof(*ZONE);
  bool inside = false;  // an odd number of edges is to the right of the point; none of NaN
  for (size_t i = 0, j = corners - 1; i < corners; j = i++)
  {
    const double x1 = ZONE[i][0], y1 = ZONE[i][1], x2 = ZONE[j][0], y2 = ZONE[j][1];
    if ((y1 > place.y) != (y2 > place.y) && place.x < x1 + (place.y - y1) / (y2 - y1) * (x2 - x1))
      inside = !inside;
  }
  return inside;
}

class CountInZone
{
public:
  CountInZone()
    : output_(node_.advertise<std_msgs::Int32>("people_in_zone", 1))
    , signals_(node_.subscribe("openpose_ros/skeleton_3d/people_signals", 1, &CountInZone::onSignals, this))
    , timer_(node_.createTimer(ros::Duration(0.2), &CountInZone::onTimer, this))
  {
  }

private:
  void onSignals(const PersonSignalsArray::ConstPtr& signals)
  {
    stamp_ = signals->header.stamp;
    number_ = 0;
    for (const auto& person : signals->persons)
      number_ += isInside(person.floor_pose.position);
  }

  void onTimer(const ros::TimerEvent&)
  {
    std_msgs::Int32 count;
    const bool known = !stamp_.isZero() && std::abs((ros::Time::now() - stamp_).toSec()) < LATE;
    count.data = known ? number_ : -1;
    output_.publish(count);
  }

  ros::NodeHandle node_;
  ros::Time stamp_;
  int number_ = 0;
  ros::Publisher output_;
  ros::Subscriber signals_;
  ros::Timer timer_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "count_in_zone");
  CountInZone node;
  ros::spin();
}
