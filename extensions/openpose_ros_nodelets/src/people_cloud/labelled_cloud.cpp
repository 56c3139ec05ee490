#include "openpose_ros_nodelets/people_cloud/labelled_cloud.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include <boost/make_shared.hpp>

#include "openpose_ros_nodelets/common/organized_cloud.h"

namespace openpose_ros_nodelets
{
namespace
{

using sensor_msgs::PointField;

std::size_t sizeOf(const PointField& field)
{
  constexpr std::size_t SIZES[] = { 0, 1, 1, 2, 2, 4, 4, 4, 8 };  // by datatype
  if (field.datatype >= sizeof(SIZES) / sizeof(SIZES[0]))
    throw BadInputError("cloud has field '" + field.name + "' of datatype " + std::to_string(field.datatype));
  return SIZES[field.datatype] * std::max<std::size_t>(field.count, 1);
}

/// Return where all fields end in a point, as a multiple of the size of a label; what is said to lie beyond the point
/// is not there.
std::size_t endOf(const sensor_msgs::PointCloud2& cloud)
{
  std::size_t end = 0;
  for (const PointField& field : cloud.fields)
    end = std::max(end, field.offset + sizeOf(field));
  end = std::min<std::size_t>(end, cloud.point_step);
  return (end + sizeof(std::uint32_t) - 1) / sizeof(std::uint32_t) * sizeof(std::uint32_t);
}

PointField labelAt(std::size_t offset)
{
  PointField field;
  field.name = "label";
  field.offset = offset;
  field.datatype = PointField::UINT32;
  field.count = 1;
  return field;
}

/// Return the cloud with points that end behind a label at `offset`.
sensor_msgs::PointCloud2Ptr widened(const sensor_msgs::PointCloud2& cloud, std::size_t offset)
{
  const auto wide = boost::make_shared<sensor_msgs::PointCloud2>();
  wide->header = cloud.header;
  wide->height = cloud.height;
  wide->width = cloud.width;
  wide->fields = cloud.fields;
  wide->is_bigendian = cloud.is_bigendian;
  wide->is_dense = cloud.is_dense;
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
    labelled->fields.push_back(labelAt(offset));
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
  for (const PointField& field : cloud.fields)
  {
    const bool is_coordinate = field.name == "x" || field.name == "y" || field.name == "z";
    // of several fields of one name, only the first was checked
    if (!is_coordinate || field.offset + sizeof(MISSING) > cloud.point_step)
      continue;
    for (std::size_t index = 0; index < labels.size(); ++index)
      if (labels[index] != 0)
        std::memcpy(&rest->data[index / cloud.width * cloud.row_step + index % cloud.width * cloud.point_step +
                                field.offset],
                    &MISSING, sizeof(MISSING));
  }
  return rest;
}

}  // namespace openpose_ros_nodelets
