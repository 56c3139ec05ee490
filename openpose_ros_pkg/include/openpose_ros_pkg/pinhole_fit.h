/** Fits a pinhole camera to the points of an organized cloud. Needs neither ROS nor Python. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <vector>

namespace openpose_ros_pkg
{
/** What CameraFitConstants of skeleton_extract_3d (points/constants.py) documents; a test holds both equal. */
struct PinholeFitConstants
{
  std::size_t columns = 32, rows = 18;  ///< of the grid of points that the camera is fitted to
  std::size_t least_points = 12;
  double tolerance = 3.0;  ///< [px]
  double least_square = 1e-12;
};

/** A camera, for which u = fx x / z + cx and v = fy y / z + cy [px]; error: greater one of the median distances. */
struct PinholeFit
{
  double fx, fy, cx, cy, error;
};

/** A valid point and its pixel. */
struct SeenPoint
{
  double x, y, z, column, row;
};

/** Tell whether a point can be in front of a camera. */
inline bool isSeen(double x, double y, double z)
{
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z) && z > 0.0;
}

namespace detail
{
struct Line
{
  double slope, offset, error;  ///< error: median distance
};

/** Fit y = slope x + offset by least squares. */
inline Line fitLine(const std::vector<double>& x, const std::vector<double>& y, double least_square)
{
  const double count = x.size();
  const double x_mean = std::accumulate(x.begin(), x.end(), 0.0) / count;
  const double y_mean = std::accumulate(y.begin(), y.end(), 0.0) / count;
  double square = 0.0, both = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
  {
    square += (x[i] - x_mean) * (x[i] - x_mean);
    both += (x[i] - x_mean) * (y[i] - y_mean);
  }
  const double slope = both / std::max(square, least_square);
  std::vector<double> errors(x.size());
  std::transform(x.begin(), x.end(), y.begin(), errors.begin(),
                 [=](double a, double b) { return std::abs(slope * (a - x_mean) - (b - y_mean)); });
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size()) / 2;
  std::nth_element(errors.begin(), middle, errors.end());
  return { slope, y_mean - slope * x_mean, *middle };
}

inline bool allAlike(const std::vector<double>& values)
{
  return std::all_of(values.begin(), values.end(), [&values](double value) { return value == values.front(); });
}
}  // namespace detail

/** Return the camera by least squares; nothing where there are too few points to tell. */
inline std::optional<PinholeFit> fittedPinhole(const std::vector<SeenPoint>& points, const PinholeFitConstants& method)
{
  std::vector<double> x_slopes, y_slopes, columns, rows;
  for (const SeenPoint& point : points)
  {
    x_slopes.push_back(point.x / point.z);
    y_slopes.push_back(point.y / point.z);
    columns.push_back(point.column);
    rows.push_back(point.row);
  }
  if (points.empty() || points.size() < method.least_points || detail::allAlike(columns) || detail::allAlike(rows))
  {
    return std::nullopt;
  }
  const detail::Line across = detail::fitLine(x_slopes, columns, method.least_square);
  const detail::Line down = detail::fitLine(y_slopes, rows, method.least_square);
  return PinholeFit{ across.slope, down.slope, across.offset, down.offset, std::max(across.error, down.error) };
}
}  // namespace openpose_ros_pkg
