#pragma once

#include <cstddef>
#include <cstring>

#include <boost/make_shared.hpp>
#include <sensor_msgs/Image.h>

#include "cloud_to_depth/depth_traits.h"
#include "common/organized_cloud.h"

namespace openpose_ros_nodelets
{

/// Write the depths of a cloud, row by row without gaps, and return the number of those that are valid.
template <typename Pixel>
std::size_t writeDepths(const OrganizedCloud& cloud, Pixel* depths)
{
  using Traits = DepthTraits<Pixel>;
  const std::size_t width = cloud.width(), step = cloud.pointStep();
  std::size_t valid = 0;
  for (std::size_t row = 0; row < cloud.height(); ++row, depths += width)
  {
    const std::uint8_t* point = cloud.rowOfZ(row);
    for (std::size_t column = 0; column < width; ++column, point += step)
    {
      float z;
      std::memcpy(&z, point, sizeof(z));
      depths[column] = Traits::fromMetres(z);
    }
    for (std::size_t column = 0; column < width; ++column)
      valid += Traits::isValid(depths[column]);
  }
  return valid;
}

/// Return the depth image of a cloud; its header is left empty. Throws BadInputError for a cloud without a valid point.
template <typename Pixel>
sensor_msgs::ImagePtr depthImage(const OrganizedCloud& cloud)
{
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->width = cloud.width();
  image->height = cloud.height();
  image->encoding = DepthTraits<Pixel>::ENCODING;
  image->step = cloud.width() * sizeof(Pixel);
  image->data.resize(image->step * image->height);
  if (writeDepths(cloud, reinterpret_cast<Pixel*>(image->data.data())) == 0)
    throw BadInputError("cloud has no valid point");
  return image;
}

}  // namespace openpose_ros_nodelets
