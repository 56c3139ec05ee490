/** Peaks of confidence maps, with sub-pixel positions. */
#include <algorithm>
#include <cmath>

#include "types.h"

namespace openpose_ros_decode
{
namespace
{
constexpr int BLOCK = 32;  ///< cells of a row that are passed over together if none exceeds the threshold

/** Whether any value exceeds a threshold; without branches, so that compilers make vector instructions of it. */
bool anyAbove(const float* values, int count, float threshold)
{
  int above = 0;
  for (int i = 0; i < count; ++i)
  {
    above += values[i] > threshold;
  }
  return above > 0;
}

/** Whether a cell is higher than its neighbours; strict on one side only, so that two equal ones are one peak. */
bool isPeak(const float* cell, std::ptrdiff_t row)
{
  const float top = *cell;
  return top > cell[-1] && top > cell[-row] && top > cell[-row - 1] && top > cell[-row + 1] && top >= cell[1] &&
         top >= cell[row] && top >= cell[row - 1] && top >= cell[row + 1];
}

/** Where the parabola through a peak and its two neighbours has its top [cells, within +-0.5]. */
float parabolaOffset(const float* cell, std::ptrdiff_t step)
{
  const float before = cell[-step];
  const float after = cell[step];
  if (!std::isfinite(before) || !std::isfinite(after))
  {
    return 0.0f;
  }
  const float curvature = 2.0f * *cell - before - after;
  return curvature > 0.0f ? std::min(std::max((after - before) / (2.0f * curvature), -0.5f), 0.5f) : 0.0f;
}

bool isStronger(const Peak& first, const Peak& second)
{
  return first.score > second.score;
}
}  // namespace

std::vector<Peak> findPeaks(const Maps& maps, double scale, double max_x, double max_y, float threshold,
                            const Settings& settings)
{
  std::vector<Peak> peaks;
  for (int joint = 0; joint < maps.count; ++joint)
  {
    const std::size_t first = peaks.size();
    for (int v = 1; v < maps.height - 1; ++v)
    {
      const float* row = maps.map(joint) + static_cast<std::size_t>(v) * maps.width;
      for (int u = 1; u < maps.width - 1; ++u)
      {
        if (u % BLOCK == 1 && !anyAbove(row + u, std::min(BLOCK, maps.width - 1 - u), threshold))
        {
          u += BLOCK - 1;
          continue;
        }
        if (!(row[u] > threshold) || !isPeak(row + u, maps.width))
        {
          continue;
        }
        const double column = u - 1 + static_cast<double>(parabolaOffset(row + u, 1));
        const double line = v - 1 + static_cast<double>(parabolaOffset(row + u, maps.width));
        const float x = static_cast<float>((column + 0.5) * scale - 0.5);
        const float y = static_cast<float>((line + 0.5) * scale - 0.5);
        if (x <= max_x && y <= max_y)
        {
          peaks.push_back({ joint, x, y, std::min(row[u], 1.0f) });
        }
      }
    }
    std::stable_sort(peaks.begin() + first, peaks.end(), isStronger);
    peaks.resize(std::min(peaks.size(), first + settings.max_peaks_per_joint), Peak{});
  }
  std::stable_sort(peaks.begin(), peaks.end(), isStronger);
  peaks.resize(std::min<std::size_t>(peaks.size(), settings.max_peaks), Peak{});
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.joint < b.joint; });
  return peaks;
}
}  // namespace openpose_ros_decode
