#pragma once

#include <cstdint>
#include <utility>

#include <sensor_msgs/CameraInfo.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"

namespace openpose_ros_nodelets
{

/// Return width and height of the images of a camera info, after its region of interest and binning, as
/// image_geometry::PinholeCameraModel has them.
std::pair<std::uint32_t, std::uint32_t> imageSize(const sensor_msgs::CameraInfo& info);

/// Return the pinhole camera that sees each point of a cloud at its pixel; the header is left empty.
/// Throws BadInputError where no such camera explains the points, or too few of them are valid.
sensor_msgs::CameraInfo fittedCamera(const OrganizedCloud& cloud);

}  // namespace openpose_ros_nodelets
