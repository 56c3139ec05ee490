#pragma once

#include <sensor_msgs/CameraInfo.h>

#include "common/organized_cloud.h"

namespace openpose_ros_nodelets
{

/// Return the pinhole camera that sees each point of a cloud at its pixel; the header is left empty.
/// Throws BadInputError where no such camera explains the points, or too few of them are valid.
sensor_msgs::CameraInfo fittedCamera(const OrganizedCloud& cloud);

}  // namespace openpose_ros_nodelets
