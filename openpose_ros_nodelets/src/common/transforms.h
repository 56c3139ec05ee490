#pragma once

#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <tf2_ros/buffer.h>

namespace openpose_ros_nodelets
{

/// Return a transform, waited for in wall time: with a simulated clock that stops, tf2 itself would wait without end.
///
/// Throws tf2::TransformException when it did not come in time.
inline geometry_msgs::TransformStamped lookup(const tf2_ros::Buffer& buffer, const std::string& target,
                                              const std::string& source, const ros::Time& stamp,
                                              const ros::WallDuration& timeout)
{
  const ros::WallTime deadline = ros::WallTime::now() + timeout;
  while (!buffer.canTransform(target, source, stamp) && ros::WallTime::now() < deadline)
    ros::WallDuration(0.005).sleep();
  return buffer.lookupTransform(target, source, stamp);
}

}  // namespace openpose_ros_nodelets
