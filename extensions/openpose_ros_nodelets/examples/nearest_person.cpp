// An example to copy: prints who is nearest to the camera, and where the right wrist of that person is for the robot.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <geometry_msgs/PointStamped.h>
#include <message_filters/subscriber.h>
#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <openpose_ros_msgs/joints.h>
#include <ros/ros.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/message_filter.h>
#include <tf2_ros/transform_listener.h>

namespace
{

using openpose_ros_msgs::BodypartDetection_3d;
using openpose_ros_msgs::PersonDetection_3d;
using openpose_ros_msgs::PersonDetection_3dArray;

/// Return the distance from the camera to the nearest joint of a person [m]; infinite if no joint is known.
double distanceOf(const PersonDetection_3d& person)
{
  double nearest = std::numeric_limits<double>::infinity();
  for (const openpose_ros_msgs::Joint joint : openpose_ros_msgs::ALL_JOINTS)
  {
    const BodypartDetection_3d& part = openpose_ros_msgs::partOf(person, joint);
    if (openpose_ros_msgs::isKnown(part))
      nearest = std::min(nearest, std::hypot(part.x, std::hypot(double(part.y), part.z)));
  }
  return nearest;
}

class NearestPerson
{
public:
  NearestPerson()
    : target_frame_(ros::NodeHandle("~").param<std::string>("target_frame", "base_link"))
    , listener_(buffer_)
    , subscriber_(handle_, "openpose_ros/skeleton_3d/detected_poses_3d", 1)
    // holds each message until its transform has come, at most ten of them
    , filter_(subscriber_, buffer_, target_frame_, 10, handle_)
  {
    filter_.registerCallback(&NearestPerson::print, this);
    filter_.registerFailureCallback(
        [this](const PersonDetection_3dArray::ConstPtr& people, tf2_ros::filter_failure_reasons::FilterFailureReason) {
          warn(people->header);
        });
  }

private:
  void print(const PersonDetection_3dArray::ConstPtr& people)
  {
    const PersonDetection_3d* nearest = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const PersonDetection_3d& person : people->persons)
    {
      if (distanceOf(person) < distance)
      {
        nearest = &person;
        distance = distanceOf(person);
      }
    }
    if (nearest == nullptr)
    {
      ROS_INFO("nobody");
      return;
    }
    ROS_INFO("person %u is nearest, %.2f m from the camera; %s", nearest->person_ID, distance,
             wristOf(*nearest).c_str());
  }

  std::string wristOf(const PersonDetection_3d& person) const
  {
    const BodypartDetection_3d& wrist = person.right_wrist;
    if (!openpose_ros_msgs::isKnown(wrist))
      return "the right wrist is not known";
    geometry_msgs::PointStamped seen, wanted;
    seen.header = person.header;
    seen.point.x = wrist.x;
    seen.point.y = wrist.y;
    seen.point.z = wrist.z;
    try
    {
      buffer_.transform(seen, wanted, target_frame_);  // at the stamp of the camera
    }
    catch (const tf2::TransformException& error)
    {
      return std::string("the right wrist can not be told: ") + error.what();
    }
    char text[200];
    std::snprintf(text, sizeof(text), "the right wrist is at %.2f, %.2f, %.2f m in %s, %s, sigma %.2f m",
                  wanted.point.x, wanted.point.y, wanted.point.z, target_frame_.c_str(),
                  openpose_ros_msgs::statusOf(wrist), wrist.sigma);
    return text;
  }

  void warn(const std_msgs::Header& header) const
  {
    std::string reason;
    buffer_.canTransform(target_frame_, header.frame_id, header.stamp, ros::Duration(0.0), &reason);
    ROS_WARN_THROTTLE(5.0, "people in frame '%s' of time %.3f are left out: there is no transform to '%s' (parameter "
                      "~target_frame): %s", header.frame_id.c_str(), header.stamp.toSec(), target_frame_.c_str(),
                      reason.c_str());
  }

  ros::NodeHandle handle_;
  std::string target_frame_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  message_filters::Subscriber<PersonDetection_3dArray> subscriber_;
  tf2_ros::MessageFilter<PersonDetection_3dArray> filter_;
};

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, "nearest_person");
  if (argc > 1)
  {
    std::puts("usage: rosrun openpose_ros_nodelets nearest_person [_target_frame:=FRAME] [TOPIC:=TOPIC]");
    return std::string(argv[1]) == "--help" ? 0 : 2;
  }
  NearestPerson node;
  ros::spin();
  return 0;
}
