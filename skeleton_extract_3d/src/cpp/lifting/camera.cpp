/** Twins of camera.py. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

#include "arrays.h"
#include "bindings.h"

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
  for (std::size_t i = 0; i < x.size(); ++i)
  {
    errors[i] = std::abs(slope * (x[i] - x_mean) - (y[i] - y_mean));
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size()) / 2;
  std::nth_element(errors.begin(), middle, errors.end());
  return { slope, y_mean - slope * x_mean, *middle };
}

std::optional<std::array<double, 5>> fitPinhole(const Doubles& points, const Integers& pixels, std::size_t least_points,
                                                double least_square)
{
  const py::ssize_t count = sizeOf(points, "points", 2, 1);
  const double *x = checked(points, "points", { 3, count }), *y = x + count, *z = y + count;
  const std::int64_t *u = checked(pixels, "pixels", { 2, count }), *v = u + count;
  std::array<std::vector<double>, 2> slopes, at;
  for (py::ssize_t i = 0; i < count; ++i)
  {
    if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]) && z[i] > 0.0)
    {
      slopes[0].push_back(x[i] / z[i]);
      slopes[1].push_back(y[i] / z[i]);
      at[0].push_back(static_cast<double>(u[i]));
      at[1].push_back(static_cast<double>(v[i]));
    }
  }
  const auto all_alike = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [&values](double value) { return value == values.front(); });
  };
  if (slopes[0].size() < least_points || all_alike(at[0]) || all_alike(at[1]))
  {
    return std::nullopt;
  }
  const Line horizontal = fitLine(slopes[0], at[0], least_square), vertical = fitLine(slopes[1], at[1], least_square);
  return { { horizontal.slope, vertical.slope, horizontal.offset, vertical.offset,
             std::max(horizontal.error, vertical.error) } };
}
}  // namespace

void bindCamera(py::module& module)
{
  module.def("fit_pinhole", &fitPinhole, "Twin of camera.fit_pinhole.", py::arg("points"), py::arg("pixels"),
             py::arg("least_points"), py::arg("least_square"));
}
}  // namespace skeleton_extract_3d
