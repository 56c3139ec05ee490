#include "cloud_message.h"

#include <algorithm>
#include <limits>

#include <boost/make_shared.hpp>

namespace openpose_ros_nodelets
{
namespace
{

using sensor_msgs::PointField;

/// Return where in a point a field of four bytes lies; none: there is no field of this name. Throws BadInputError: it is
/// of another type, or lies beyond the point.
std::optional<std::size_t> offsetOf(const sensor_msgs::PointCloud2& message, const std::string& name, int datatype)
{
  for (const PointField& field : message.fields)
  {
    if (field.name != name)
      continue;
    if (field.datatype != datatype || field.offset + sizeof(float) > message.point_step)
      throw BadInputError("cloud has field '" + name + "' of datatype " + std::to_string(field.datatype) + " at byte " +
                          std::to_string(field.offset) + " of points of " + std::to_string(message.point_step) +
                          " bytes, expected datatype " + std::to_string(datatype));
    return field.offset;
  }
  return std::nullopt;
}

/// Return where all fields end in a point, as a multiple of the size of a label; what is said to lie beyond the point
/// is not there.
std::size_t endOf(const sensor_msgs::PointCloud2& cloud)
{
  constexpr std::size_t SIZES[] = { 8, 1, 1, 2, 2, 4, 4, 4, 8 };  // by datatype
  std::size_t end = 0;
  for (const PointField& field : cloud.fields)
    end = std::max(end, field.offset + SIZES[field.datatype % 9] * std::size_t(std::max(field.count, 1U)));
  end = std::min<std::size_t>(end, cloud.point_step);
  return (end + sizeof(std::uint32_t) - 1) / sizeof(std::uint32_t) * sizeof(std::uint32_t);
}

/// Return the cloud with points that end behind a label at `offset`.
sensor_msgs::PointCloud2Ptr widened(const sensor_msgs::PointCloud2& cloud, std::size_t offset)
{
  const auto wide = boost::make_shared<sensor_msgs::PointCloud2>(cloud);
  wide->point_step = offset + sizeof(std::uint32_t);
  wide->row_step = wide->point_step * cloud.width;
  wide->data.resize(std::size_t(wide->row_step) * cloud.height);
  for (std::size_t row = 0; row < cloud.height; ++row)
    for (std::size_t column = 0; column < cloud.width; ++column)
      std::memcpy(&wide->data[row * wide->row_step + column * wide->point_step],
                  &cloud.data[row * cloud.row_step + column * cloud.point_step], cloud.point_step);
  return wide;
}

}  // namespace

OrganizedCloud::OrganizedCloud(const sensor_msgs::PointCloud2& message)
  : data_(message.data.data())
  , width_(message.width)
  , height_(message.height)
  , point_step_(message.point_step)
  , row_step_(message.row_step)
{
  const std::string size = std::to_string(width_) + " x " + std::to_string(height_);
  if (width_ < 2 || height_ < 2)
    throw BadInputError("cloud is not organized: it has " + size + " points, expected one per pixel of the image");
  if (message.is_bigendian)
    throw BadInputError("cloud is big-endian, expected little-endian");
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::string name(1, "xyz"[axis]);
    const std::optional<std::size_t> offset = offsetOf(message, name, PointField::FLOAT32);
    if (!offset)
      throw BadInputError("cloud has no field '" + name + "'");
    offsets_[axis] = *offset;
  }
  const std::size_t row = width_ * point_step_, needed = (height_ - 1) * row_step_ + row;
  if (row_step_ < row || message.data.size() < needed)
    throw BadInputError("cloud is truncated: rows of " + std::to_string(row_step_) + " and data of " +
                        std::to_string(message.data.size()) + " bytes, expected " + std::to_string(row) + " and " +
                        std::to_string(needed) + " for " + size + " points");
}

sensor_msgs::PointCloud2Ptr withLabels(const sensor_msgs::PointCloud2& cloud, const std::vector<std::uint32_t>& labels)
{
  const std::optional<std::size_t> present = offsetOf(cloud, "label", PointField::UINT32);
  std::size_t offset = present ? *present : endOf(cloud);
  const bool has_room = offset + sizeof(std::uint32_t) <= cloud.point_step;
  if (!has_room)
    offset = std::max<std::size_t>(offset, cloud.point_step);
  const sensor_msgs::PointCloud2Ptr labelled =
      has_room ? boost::make_shared<sensor_msgs::PointCloud2>(cloud) : widened(cloud, offset);
  if (!present)
  {
    PointField& field = *labelled->fields.emplace(labelled->fields.end());
    field.name = "label";
    field.offset = offset;
    field.datatype = PointField::UINT32;
    field.count = 1;
  }
  for (std::size_t row = 0; row < cloud.height; ++row)
  {
    std::uint8_t* point = &labelled->data[row * labelled->row_step + offset];
    for (std::size_t column = 0; column < cloud.width; ++column, point += labelled->point_step)
      std::memcpy(point, &labels[row * cloud.width + column], sizeof(std::uint32_t));
  }
  return labelled;
}

sensor_msgs::PointCloud2Ptr withoutLabelled(const sensor_msgs::PointCloud2& cloud,
                                            const std::vector<std::uint32_t>& labels)
{
  constexpr float MISSING = std::numeric_limits<float>::quiet_NaN();
  const auto rest = boost::make_shared<sensor_msgs::PointCloud2>(cloud);
  rest->is_dense = false;
  for (const char* axis : { "x", "y", "z" })
  {
    const std::size_t offset = offsetOf(cloud, axis, PointField::FLOAT32).value();
    for (std::size_t index = 0; index < labels.size(); ++index)
      if (labels[index] != 0)
        std::memcpy(&rest->data[index / cloud.width * cloud.row_step + index % cloud.width * cloud.point_step + offset],
                    &MISSING, sizeof(MISSING));
  }
  return rest;
}

}  // namespace openpose_ros_nodelets
