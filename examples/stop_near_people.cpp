#include <cmath>
#include <geometry_msgs/Twist.h>
#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <openpose_ros_msgs/joints.h>
#include <ros/ros.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>
#include <tf2_ros/transform_listener.h>

using openpose_ros_msgs::PersonDetection_3dArray;

constexpr double NEAR = 1.0, LATE = 0.7;  // [m] from base_link; [s]

class StopNearPeople
{
public:
  StopNearPeople()
    : listener_(buffer_)
    , output_(node_.advertise<geometry_msgs::Twist>("cmd_vel", 1))
    , people_(node_.subscribe("openpose_ros/skeleton_3d/detected_poses_3d", 1, &StopNearPeople::onPeople, this))
    , command_(node_.subscribe("cmd_vel_in", 1, &StopNearPeople::onCommand, this))
    , timer_(node_.createTimer(ros::Duration(0.1), &StopNearPeople::onTimer, this))
  {
  }

private:
  void onPeople(const PersonDetection_3dArray::ConstPtr& people)
  {
    geometry_msgs::TransformStamped camera;
    try
    {
      camera = buffer_.lookupTransform("base_link", people->header.frame_id, people->header.stamp, ros::Duration(0.2));
    }
    catch (const tf2::TransformException& error)
    {
      ROS_WARN_THROTTLE(5.0, "people are not used: %s", error.what());
      return;  // the robot stops when that lasts
    }
    clear_ = people->header.stamp;
    for (const auto& person : people->persons)
      for (const openpose_ros_msgs::Joint joint : openpose_ros_msgs::ALL_JOINTS)
      {
        const auto& part = openpose_ros_msgs::partOf(person, joint);
        geometry_msgs::Point point;
        point.x = part.x;
        point.y = part.y;
        point.z = part.z;
        tf2::doTransform(point, point, camera);
        if (openpose_ros_msgs::isKnown(part) && std::hypot(point.x, point.y) < NEAR)
          clear_ = ros::Time();
      }
  }

  bool isClear() const
  {
    return !clear_.isZero() && std::abs((ros::Time::now() - clear_).toSec()) < LATE;
  }

  void onCommand(const geometry_msgs::Twist::ConstPtr& command)
  {
    if (isClear())
      output_.publish(command);
  }

  void onTimer(const ros::TimerEvent&)
  {
    if (!isClear())
      output_.publish(geometry_msgs::Twist());
  }

  ros::NodeHandle node_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::Time clear_;  // stamp of the newest frame, if no person in it is near
  ros::Publisher output_;
  ros::Subscriber people_, command_;
  ros::Timer timer_;
};

int main(int argc, char** argv)
{
  ros::init(argc, argv, "stop_near_people");
  StopNearPeople node;
  ros::spin();
}
