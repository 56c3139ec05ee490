#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <vector>

#include "common/organized_cloud.h"

namespace openpose_ros_nodelets
{

/// Check that a cloud has depth, in metres, by a grid of its points. Throws BadInputError: no point is valid, or their
/// median depth is beyond what `PlausibilityConstants` of skeleton_extract_3d (points/constants.py) allows.
inline void requireDepth(const OrganizedCloud& cloud)
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
    throw BadInputError("cloud has no valid point: is the depth camera covered, or is this another topic?");
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  if (*middle >= NEAREST && *middle <= FURTHEST)
    return;
  std::ostringstream text;
  text << "cloud has a median depth of " << *middle << " m, expected " << NEAREST << " to " << FURTHEST
       << " m: is it in millimetres?";
  throw BadInputError(text.str());
}

}  // namespace openpose_ros_nodelets
