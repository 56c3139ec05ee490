/** Fits a pinhole camera to points. */
#include <openpose_ros_pkg/pinhole_fit.h>

#include <array>
#include <vector>

#include "steps.h"

namespace skeleton_extract_3d
{
std::optional<std::array<double, 5>> fitPinhole(const Constants& method, const Doubles& points, const Integers& pixels)
{
  const py::ssize_t count = points.ndim() == 2 ? points.shape(1) : 0;
  const double *x = points.data(), *y = x + count, *z = y + count;
  const Index *u = pixels.data(), *v = u + count;
  std::vector<openpose_ros_pkg::SeenPoint> seen;
  for (py::ssize_t i = 0; i < count; ++i)
  {
    if (openpose_ros_pkg::isSeen(x[i], y[i], z[i]))
    {
      seen.push_back({ x[i], y[i], z[i], static_cast<double>(u[i]), static_cast<double>(v[i]) });
    }
  }
  openpose_ros_pkg::PinholeFitConstants constants;
  constants.least_points = method.camera_fit.least_points;
  const std::optional<openpose_ros_pkg::PinholeFit> fit = openpose_ros_pkg::fittedPinhole(seen, constants);
  if (!fit)
  {
    return std::nullopt;
  }
  return { { fit->fx, fit->fy, fit->cx, fit->cy, fit->error } };
}
}  // namespace skeleton_extract_3d
