#include "openpose_ros_nodelets/common/organized_cloud.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace openpose_ros_nodelets
{
namespace
{

[[noreturn]] void refuse(const std::string& text)
{
  throw BadInputError("cloud " + text);
}

std::string size(const sensor_msgs::PointCloud2& message)
{
  return std::to_string(message.width) + " x " + std::to_string(message.height);
}

std::size_t offsetOfCoordinate(const sensor_msgs::PointCloud2& message, const std::string& name)
{
  const std::optional<std::size_t> offset = offsetOf(message, name, sensor_msgs::PointField::FLOAT32);
  if (!offset)
    refuse("has no field '" + name + "'");
  return *offset;
}

}  // namespace

std::optional<std::size_t> offsetOf(const sensor_msgs::PointCloud2& message, const std::string& name, int datatype)
{
  for (const sensor_msgs::PointField& field : message.fields)
  {
    if (field.name != name)
      continue;
    if (field.datatype != datatype)
      refuse("has field '" + name + "' of datatype " + std::to_string(field.datatype) + ", expected " +
             (datatype == sensor_msgs::PointField::FLOAT32 ? "FLOAT32 (7)" : "UINT32 (6)"));
    if (field.offset + sizeof(float) > message.point_step)
      refuse("has field '" + name + "' at byte " + std::to_string(field.offset) + " of points of " +
             std::to_string(message.point_step) + " bytes");
    return field.offset;
  }
  return std::nullopt;
}

CloudPoints::CloudPoints(const sensor_msgs::PointCloud2& message)
  : data_(message.data.data())
  , width_(message.width)
  , height_(message.height)
  , point_step_(message.point_step)
  , row_step_(message.row_step)
{
  if (message.is_bigendian)
    refuse("is big-endian, expected little-endian");
  x_ = offsetOfCoordinate(message, "x");
  y_ = offsetOfCoordinate(message, "y");
  z_ = offsetOfCoordinate(message, "z");
  if (row_step_ < width_ * point_step_)
    refuse("has rows of " + std::to_string(row_step_) + " bytes, expected at least " +
           std::to_string(width_ * point_step_) + " for " + size(message) + " points");
  const std::size_t needed = height_ == 0 ? 0 : (height_ - 1) * row_step_ + width_ * point_step_;
  if (message.data.size() < needed)
    refuse("is truncated: " + std::to_string(message.data.size()) + " bytes, expected " + std::to_string(needed) +
           " for " + size(message) + " points");
}

OrganizedCloud::OrganizedCloud(const sensor_msgs::PointCloud2& message) : CloudPoints(message)
{
  if (width() < 2 || height() < 2)
    refuse("is not organized: it has " + size(message) + " points, expected one per pixel of the image");
}

void requireDepth(const OrganizedCloud& cloud)
{
  constexpr std::size_t COLUMNS = 48, ROWS = 27;
  constexpr float NEAREST = 0.05f, FURTHEST = 60.0f;  // [m]
  std::vector<float> depths;
  for (std::size_t i = 0; i < ROWS; ++i)
    for (std::size_t j = 0; j < COLUMNS; ++j)
    {
      const float z = cloud.z((2 * j + 1) * cloud.width() / (2 * COLUMNS), (2 * i + 1) * cloud.height() / (2 * ROWS));
      if (std::isfinite(z) && z > 0.0f)
        depths.push_back(z);
    }
  if (depths.empty())
    refuse("has no valid point: is the depth camera covered, or is this another topic?");
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  if (*middle >= NEAREST && *middle <= FURTHEST)
    return;
  std::ostringstream text;
  text << "has a median depth of " << *middle << " m, expected " << NEAREST << " to " << FURTHEST
       << " m: is it in millimetres?";
  refuse(text.str());
}

}  // namespace openpose_ros_nodelets
