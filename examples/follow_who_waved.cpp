#include <algorithm>
#include <cmath>
#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/Twist.h>
#include <openpose_ros_msgs/PersonSignalsArray.h>
#include <ros/ros.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>
#include <tf2_ros/transform_listener.h>

using openpose_ros_msgs::PersonGesture;
using openpose_ros_msgs::PersonSignals;
using openpose_ros_msgs::PersonSignalsArray;

constexpr double DISTANCE = 1.2, SPEED = 0.5, TURN = 0.8;  // [m], [m/s], [rad/s]
constexpr double LATE = 0.7, LOST = 3.0, SAME_PLACE = 0.5;  // [s], [s], [m]

bool tells(const PersonSignals& person, const std::string& gesture)
{
  return std::any_of(person.gestures.begin(), person.gestures.end(),
                     [&](const PersonGesture& each) { return each.name == gesture; });
}

class FollowWhoWaved
{
public:
  FollowWhoWaved()
    : listener_(buffer_)
    , output_(node_.advertise<geometry_msgs::Twist>("cmd_vel", 1))
    , signals_(node_.subscribe("openpose_ros/skeleton_3d/people_signals", 1, &FollowWhoWaved::onSignals, this))
    , timer_(node_.createTimer(ros::Duration(0.1), &FollowWhoWaved::onTimer, this))
  {
  }

private:
  const PersonSignals* leaderIn(const PersonSignalsArray& signals) const
  {
    const PersonSignals* near = nullptr;
    for (const PersonSignals& person : signals.persons)
    {
      const geometry_msgs::Point& place = person.floor_pose.position;
      if (following_ && person.person_ID == leader_)
        return std::isnan(place.x) ? nullptr : &person;
      // a person with another id now is still in the same place
      const bool is_leader = following_ ? std::hypot(place.x - place_.x, place.y - place_.y) < SAME_PLACE :
                                          tells(person, PersonGesture::WAVE);
      if (!std::isnan(place.x) && is_leader && near == nullptr)
        near = &person;
    }
    return near;
  }

  void onSignals(const PersonSignalsArray::ConstPtr& signals)
  {
    const PersonSignals* leader = leaderIn(*signals);
    if (leader == nullptr)
      return;
    if (tells(*leader, PersonGesture::STOP))
    {
      following_ = false;
      return;
    }
    geometry_msgs::PointStamped place;
    place.header = signals->header;
    place.point = leader->floor_pose.position;
    try
    {
      buffer_.transform(place, place, "base_link", ros::Duration(0.2));
    }
    catch (const tf2::TransformException& error)
    {
      ROS_WARN_THROTTLE(5.0, "signals are not used: %s", error.what());
      return;
    }
    following_ = true;
    leader_ = leader->person_ID;
    place_ = leader->floor_pose.position;
    seen_ = signals->header.stamp;
    const double bearing = std::atan2(place.point.y, place.point.x);
    const double distance = std::hypot(place.point.x, place.point.y);
    velocity_.angular.z = std::max(-TURN, std::min(TURN, 1.5 * bearing));
    velocity_.linear.x = std::abs(bearing) < 0.5 ? std::max(0.0, std::min(SPEED, distance - DISTANCE)) : 0.0;
  }

  void onTimer(const ros::TimerEvent&)
  {
    const double late = std::abs((ros::Time::now() - seen_).toSec());
    following_ = following_ && late <= LOST;
    output_.publish(following_ && late <= LATE ? velocity_ : geometry_msgs::Twist());
  }

  ros::NodeHandle node_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  bool following_ = false;
  uint32_t leader_ = 0;
  geometry_msgs::Point place_;  // of the leader, in the frame of the signals
  ros::Time seen_;
  geometry_msgs::Twist velocity_;
  ros::Publisher output_;
  ros::Subscriber signals_;
  ros::Timer timer_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "follow_who_waved");
  FollowWhoWaved node;
  ros::spin();
}
