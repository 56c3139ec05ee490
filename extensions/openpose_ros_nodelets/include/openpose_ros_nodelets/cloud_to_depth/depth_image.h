#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include <boost/make_shared.hpp>
#include <sensor_msgs/Image.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"

namespace openpose_ros_nodelets
{

/// The encodings of REP 118: 16UC1, millimetres, 0 for what is no depth (not finite, not in front of the camera, or
/// farther than the type can hold), and 32FC1, metres, NaN for that.
template <typename Pixel>
constexpr const char* ENCODING = sizeof(Pixel) == 2 ? "16UC1" : "32FC1";

inline void toPixel(float z, std::uint16_t& pixel)
{
  const float millimetres = 1000.0f * z + 0.5f;
  pixel = millimetres >= 1.0f && millimetres < 65536.0f ? static_cast<std::uint16_t>(millimetres) : 0;
}

inline void toPixel(float z, float& pixel)
{
  pixel = z > 0.0f && z <= std::numeric_limits<float>::max() ? z : std::numeric_limits<float>::quiet_NaN();
}

/// Return the depth image of a cloud; its header is left empty. Throws BadInputError for a cloud without a valid point.
template <typename Pixel>
sensor_msgs::ImagePtr depthImage(const OrganizedCloud& cloud)
{
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->width = cloud.width();
  image->height = cloud.height();
  image->encoding = ENCODING<Pixel>;
  image->step = cloud.width() * sizeof(Pixel);
  image->data.resize(image->step * image->height);
  const std::size_t width = cloud.width(), step = cloud.pointStep();
  Pixel* depths = reinterpret_cast<Pixel*>(image->data.data());
  std::size_t valid = 0;
  for (std::size_t row = 0; row < cloud.height(); ++row, depths += width)
  {
    const std::uint8_t* point = cloud.rowOfZ(row);
    for (std::size_t column = 0; column < width; ++column, point += step)
    {
      float z;
      std::memcpy(&z, point, sizeof(z));
      toPixel(z, depths[column]);
    }
    valid += std::count_if(depths, depths + width, [](Pixel depth) { return depth > 0; });
  }
  if (valid == 0)
    throw BadInputError("cloud has no valid point");
  return image;
}

}  // namespace openpose_ros_nodelets
