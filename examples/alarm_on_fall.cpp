#include <cmath>
#include <cstdint>
#include <geometry_msgs/PointStamped.h>
#include <openpose_ros_msgs/PersonSignalsArray.h>
#include <ros/ros.h>
#include <set>
#include <std_msgs/Bool.h>
#include <utility>

using openpose_ros_msgs::PersonSignalsArray;

constexpr double LATE = 2.0;  // [s]

class AlarmOnFall
{
public:
  AlarmOnFall()
    : alarm_(node_.advertise<geometry_msgs::PointStamped>("fall_alarm", 10, true))
    , watch_(node_.advertise<std_msgs::Bool>("fall_watch", 1))
    , signals_(node_.subscribe("openpose_ros/skeleton_3d/people_signals", 1, &AlarmOnFall::onSignals, this))
    , timer_(node_.createTimer(ros::Duration(0.5), &AlarmOnFall::onTimer, this))
  {
  }

private:
  void onSignals(const PersonSignalsArray::ConstPtr& signals)
  {
    stamp_ = signals->header.stamp;
    for (const auto& person : signals->persons)
    {
      if (!person.fallen || !told_.insert({ person.person_ID, person.fall_stamp }).second)
        continue;
      geometry_msgs::PointStamped place;
      place.header.stamp = person.fall_stamp;
      place.header.frame_id = signals->header.frame_id;
      place.point = person.floor_pose.position;
      alarm_.publish(place);
      ROS_ERROR("person %u fell within %.1f s", person.person_ID, person.fall_duration);
    }
  }

  void onTimer(const ros::TimerEvent&)
  {
    std_msgs::Bool watches;
    watches.data = !stamp_.isZero() && std::abs((ros::Time::now() - stamp_).toSec()) < LATE;
    if (!watches.data)
      ROS_WARN_THROTTLE(10.0, "no people come: falls are not seen");
    watch_.publish(watches);
  }

  ros::NodeHandle node_;
  ros::Time stamp_;
  std::set<std::pair<std::uint32_t, ros::Time>> told_;
  ros::Publisher alarm_, watch_;
  ros::Subscriber signals_;
  ros::Timer timer_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "alarm_on_fall");
  AlarmOnFall node;
  ros::spin();
}
