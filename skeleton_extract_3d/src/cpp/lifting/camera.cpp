/** Fits a pinhole camera to points. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
struct Line
{
  double slope, offset, error;  ///< error: median distance
};

/** Fit y = slope x + offset by least squares. */
Line fitLine(const std::vector<double>& x, const std::vector<double>& y, double least_square)
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
}  // namespace

std::optional<std::array<double, 5>> fitPinhole(const Constants& method, const Doubles& points, const Integers& pixels)
{
  const py::ssize_t count = points.ndim() == 2 ? points.shape(1) : 0;
  const double *x = checked(points, "points", { 3, count }), *y = x + count, *z = y + count;
  const Index *u = checked(pixels, "pixels", { 2, count }), *v = u + count;
  std::vector<double> x_slopes, y_slopes, columns, rows;
  for (py::ssize_t i = 0; i < count; ++i)
  {
    if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]) && z[i] > 0.0)
    {
      x_slopes.push_back(x[i] / z[i]);
      y_slopes.push_back(y[i] / z[i]);
      columns.push_back(static_cast<double>(u[i]));
      rows.push_back(static_cast<double>(v[i]));
    }
  }
  const auto all_alike = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [&values](double value) { return value == values.front(); });
  };
  const Constants::CameraFit& fit = method.camera_fit;
  if (x_slopes.size() < fit.least_points || all_alike(columns) || all_alike(rows))
  {
    return std::nullopt;
  }
  const Line across = fitLine(x_slopes, columns, fit.least_square), down = fitLine(y_slopes, rows, fit.least_square);
  return { { across.slope, down.slope, across.offset, down.offset, std::max(across.error, down.error) } };
}
}  // namespace skeleton_extract_3d
