#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <sensor_msgs/PointCloud2.h>

namespace openpose_ros_nodelets
{

/// A message can not be used; the text says what was expected and what came.
class BadInputError : public std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// A cloud with a point per pixel, read in the bytes of its message, which has to live as long.
class OrganizedCloud
{
public:
  /// Throws BadInputError for a cloud that is not organized, is big-endian, has no float32 x, y and z, or whose data do
  /// not reach as far as its sizes say.
  explicit OrganizedCloud(const sensor_msgs::PointCloud2& message);

  /// A point [m]; a coordinate is NaN, infinite or not in front of the camera where it is missing.
  Eigen::Vector3f at(std::size_t row, std::size_t column) const
  {
    const std::uint8_t* point = data_ + row * row_step_ + column * point_step_;
    Eigen::Vector3f result;
    for (int axis = 0; axis < 3; ++axis)
      std::memcpy(&result[axis], point + offsets_[axis], sizeof(float));
    return result;
  }

  std::size_t width() const
  {
    return width_;
  }
  std::size_t height() const
  {
    return height_;
  }

private:
  const std::uint8_t* data_;
  std::size_t width_, height_, point_step_, row_step_, offsets_[3];
};

/// Return a cloud with the field `label` (uint32) after its own ones: in the padding of its points where there is
/// room, as in PCL's PointXYZRGBL, else behind each point. A cloud that has this field gets new values in it.
///
/// `cloud` is organized. `labels`: one per point, row by row. Throws BadInputError if its field `label` is of another
/// type.
sensor_msgs::PointCloud2Ptr withLabels(const sensor_msgs::PointCloud2& cloud, const std::vector<std::uint32_t>& labels);

/// Return a cloud whose points with a label are NaN.
sensor_msgs::PointCloud2Ptr withoutLabelled(const sensor_msgs::PointCloud2& cloud,
                                            const std::vector<std::uint32_t>& labels);

}  // namespace openpose_ros_nodelets
