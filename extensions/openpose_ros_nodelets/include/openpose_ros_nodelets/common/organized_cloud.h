#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>

#include <sensor_msgs/PointCloud2.h>

namespace openpose_ros_nodelets
{

/// A message can not be used; the text says what was expected and what came.
class BadInputError : public std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// Return where in a point a field of four bytes lies; none: there is no field of this name. Throws BadInputError: it is
/// not FLOAT32 or UINT32, as the caller expects, or lies beyond the point.
std::optional<std::size_t> offsetOf(const sensor_msgs::PointCloud2& message, const std::string& name, int datatype);

/// The coordinates of a cloud, read in the bytes of its message, which has to live as long.
class CloudPoints
{
public:
  /// Throws BadInputError for a cloud that has no float32 x, y and z, is big-endian, or whose data do not reach as far
  /// as its sizes say.
  explicit CloudPoints(const sensor_msgs::PointCloud2& message);

  /// One coordinate [m]; NaN, infinite or not in front of the camera where the point is missing.
  float x(std::size_t column, std::size_t row) const
  {
    return value(x_, column, row);
  }
  float y(std::size_t column, std::size_t row) const
  {
    return value(y_, column, row);
  }
  float z(std::size_t column, std::size_t row) const
  {
    return value(z_, column, row);
  }

  /// Where z of the first point of a row lies; that of the next point is `pointStep` bytes further.
  const std::uint8_t* rowOfZ(std::size_t row) const
  {
    return data_ + row * row_step_ + z_;
  }

  std::size_t width() const
  {
    return width_;
  }
  std::size_t height() const
  {
    return height_;
  }
  std::size_t pointStep() const
  {
    return point_step_;
  }

private:
  float value(std::size_t offset, std::size_t column, std::size_t row) const
  {
    float value;
    std::memcpy(&value, data_ + row * row_step_ + column * point_step_ + offset, sizeof(value));
    return value;
  }

  const std::uint8_t* data_;
  std::size_t width_, height_, point_step_, row_step_;
  std::size_t x_, y_, z_;  ///< offsets in a point [bytes]
};

/// A cloud with a point per pixel.
class OrganizedCloud : public CloudPoints
{
public:
  /// Throws BadInputError also for a cloud that is not organized.
  explicit OrganizedCloud(const sensor_msgs::PointCloud2& message);
};

/// Check that a cloud has depth, in metres, by a grid of its points. Throws BadInputError: no point is valid, or their
/// median depth is beyond what `PlausibilityConstants` of skeleton_extract_3d (points/constants.py) allows.
void requireDepth(const OrganizedCloud& cloud);

}  // namespace openpose_ros_nodelets
