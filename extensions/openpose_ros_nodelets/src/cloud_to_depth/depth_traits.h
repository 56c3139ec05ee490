#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace openpose_ros_nodelets
{

/// Units and missing values of depth images, as REP 118 has them. `fromMetres` gives the pixel of a depth, and `MISSING`
/// for what is no depth: not finite, not in front of the camera, or farther than the type can hold.
template <typename Pixel>
struct DepthTraits;

/// 16UC1: millimetres.
template <>
struct DepthTraits<std::uint16_t>
{
  static constexpr const char* ENCODING = "16UC1";
  static constexpr std::uint16_t MISSING = 0;

  static std::uint16_t fromMetres(float z)
  {
    const float millimetres = 1000.0f * z + 0.5f;
    return millimetres >= 1.0f && millimetres < 65536.0f ? static_cast<std::uint16_t>(millimetres) : MISSING;
  }
  static bool isValid(std::uint16_t depth)
  {
    return depth != MISSING;
  }
};

/// 32FC1: metres.
template <>
struct DepthTraits<float>
{
  static constexpr const char* ENCODING = "32FC1";
  static constexpr float MISSING = std::numeric_limits<float>::quiet_NaN();

  static float fromMetres(float z)
  {
    return z > 0.0f && z <= std::numeric_limits<float>::max() ? z : MISSING;
  }
  static bool isValid(float depth)
  {
    return depth > 0.0f;
  }
};

}  // namespace openpose_ros_nodelets
