#pragma once

#include <algorithm>
#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

namespace openpose_ros_nodelets
{

/// What tf knows. A recording that is played again without a simulated clock has stamps that tf2 takes for outdated: what
/// was known is forgotten then, but for static transforms. For one thread at a time; the counterpart of
/// skeleton_extract_3d/ros/transforms.py.
class Transforms
{
public:
  explicit Transforms(const ros::NodeHandle& handle) : listener_(buffer_, handle)
  {
  }

  /// Return a transform, waited for in wall time: with a simulated clock that stops, tf2 itself would wait without end.
  ///
  /// Throws tf2::TransformException when it did not come in time.
  geometry_msgs::TransformStamped lookup(const std::string& target, const std::string& source, const ros::Time& stamp,
                                         const ros::WallDuration& timeout)
  {
    follow(stamp);
    const ros::WallTime deadline = ros::WallTime::now() + timeout;
    while (!buffer_.canTransform(target, source, stamp) && ros::WallTime::now() < deadline)
      ros::WallDuration(0.005).sleep();
    return buffer_.lookupTransform(target, source, stamp);
  }

  /// Return the newest transform, for a message with a stamp. Throws tf2::TransformException where there is none.
  geometry_msgs::TransformStamped newest(const std::string& target, const std::string& source, const ros::Time& stamp)
  {
    follow(stamp);
    return buffer_.lookupTransform(target, source, ros::Time(0));
  }

  /// Return whether a frame was ever published.
  bool exists(const std::string& frame) const
  {
    return buffer_._frameExists(frame);
  }

private:
  void follow(const ros::Time& stamp)
  {
    // less is a late message
    if ((newest_ - stamp).toSec() > 0.5)
    {
      buffer_.clear();
      newest_ = stamp;
    }
    newest_ = std::max(newest_, stamp);
  }

  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::Time newest_;
};

}  // namespace openpose_ros_nodelets
