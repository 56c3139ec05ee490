#pragma once

#include <cstdint>
#include <vector>

#include <sensor_msgs/PointCloud2.h>

namespace openpose_ros_nodelets
{

/// Return a cloud with the field `label` (uint32) after its own ones: in the padding of its points where there is
/// room, as in PCL's PointXYZRGBL, else behind each point. A cloud that has this field gets new values in it.
///
/// `cloud` is organized. `labels`: one per point, row by row. Throws BadInputError if the cloud's field `label` is of
/// another type.
sensor_msgs::PointCloud2Ptr withLabels(const sensor_msgs::PointCloud2& cloud, const std::vector<std::uint32_t>& labels);

/// Return a cloud whose points with a label are NaN.
sensor_msgs::PointCloud2Ptr withoutLabelled(const sensor_msgs::PointCloud2& cloud,
                                            const std::vector<std::uint32_t>& labels);

}  // namespace openpose_ros_nodelets
