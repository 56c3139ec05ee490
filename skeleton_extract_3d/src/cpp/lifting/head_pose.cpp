/** Twins of head_pose.py. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "arrays.h"
#include "bindings.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
struct HeadSettings
{
  const std::int64_t* joints;
  const double* points;  ///< left, down, forwards of each joint [m]
  const double* offsets;
  int count;
  std::array<double, 3> axes;
  double ahead, error, cosine_spread, sine_spread;
};

/** Return the depth of the front of a turned ellipsoid, see head_pose._surface. */
double headSurface(double across, double down, double cosine, double sine, const HeadSettings& s)
{
  const auto [side, height, length] = s.axes;
  const auto square = [](double value) { return value * value; };
  across -= s.ahead * sine;
  const double a = square(cosine / side) + square(sine / length);
  const double b = cosine * sine * (1 / square(side) - 1 / square(length));
  const double c = square(sine / side) + square(cosine / length);
  const double level = std::max(1 - square(down / height), 0.1);
  const double root = std::sqrt(std::max(square(b * across) - c * (a * square(across) - level), 0.0));
  return -s.ahead * cosine - (b * across + root) / c;
}

/** Fit one person's head; return whether any of its joints was found. */
bool headPose(const double* rays, const double* scores, double root, double scale, double shoulder_cosine,
              const HeadSettings& s, double* ray, double* depths, double* surface)
{
  Matrix matrix{};
  Direction right_side{ 0.0, 0.0, 0.0 };
  double total = 0.0, y = 0.0;
  for (int i = 0; i < s.count; ++i)
  {
    const double* to = rays + 3 * s.joints[i];
    const double place_x = to[0] * root, place_y = to[1] * root;
    const double weight = std::isfinite(place_x) ? scores[s.joints[i]] : 0.0;
    if (!(weight > 0.0))
    {
      continue;
    }
    const double terms[3] = { 1.0, s.points[3 * i] * scale, s.points[3 * i + 2] * scale };
    const double precision = weight / (s.error * s.error);
    for (int j = 0; j < 3; ++j)
    {
      for (int k = 0; k < 3; ++k)
      {
        matrix[3 * j + k] += precision * terms[j] * terms[k];
      }
    }
    right_side = sum(right_side, scaled({ terms[0], terms[1], terms[2] }, precision * place_x));
    total += weight;
    y += weight * (place_y - s.points[3 * i + 1] * scale);
  }
  const double of_cosine = 1 / (s.cosine_spread * s.cosine_spread), of_sine = 1 / (s.sine_spread * s.sine_spread);
  matrix[0] += 1e-6;
  matrix[4] += of_cosine;
  matrix[8] += of_sine;
  right_side.y += of_cosine * shoulder_cosine;
  const Direction solution = product(inverse(matrix), right_side);
  const double norm = std::max(std::hypot(solution.y, solution.z), 1e-6);
  const double cosine = solution.y / norm, sine = solution.z / norm;
  ray[0] = solution.x / root;
  ray[1] = y / std::max(total, 1e-9) / root;
  ray[2] = 1.0;
  for (int i = 0; i < s.count; ++i)
  {
    const double left = s.points[3 * i] * scale, down = s.points[3 * i + 1] * scale;
    const double ahead = s.points[3 * i + 2] * scale;
    depths[i] = left * sine - ahead * cosine;
    const double front =
        headSurface((left * cosine + ahead * sine) / scale, down / scale, cosine, sine, s) * scale;
    // off the outline of the ellipsoid the joint itself is the surface
    surface[i] = std::min(front, depths[i] - s.offsets[i]);
  }
  return total > 0.0;
}

py::tuple estimateHeadPose(const Doubles& rays, const Doubles& scores, const Doubles& root, const Doubles& scale,
                           const Doubles& shoulder_cosine, const Integers& head, const Doubles& points,
                           const Doubles& offsets, const std::array<double, 3>& axes, double ahead, double error,
                           double cosine_spread, double sine_spread)
{
  const py::ssize_t people = sizeOf(rays, "rays", 3, 0), joints = rays.shape(1), count = sizeOf(head, "joints", 1, 0);
  checkWithin(head.data(), count, joints, "joints");
  const HeadSettings settings{ head.data(), checked(points, "points", { count, 3 }),
                               checked(offsets, "offsets", { count }), static_cast<int>(count), axes, ahead, error,
                               cosine_spread, sine_spread };
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const double* score = checked(scores, "scores", { people, joints });
  const double* trunk = checked(root, "root", { people });
  const double* size = checked(scale, "scale", { people });
  const double* cosine = checked(shoulder_cosine, "shoulder_cosine", { people });
  py::array_t<double> to_head({ people, py::ssize_t{ 3 } }), depths({ people, count }), surface({ people, count });
  py::array_t<bool> known(people);
  for (py::ssize_t p = 0; p < people; ++p)
  {
    known.mutable_data()[p] = headPose(
        ray + p * joints * 3, score + p * joints, trunk[p], size[p], cosine[p], settings,
        to_head.mutable_data() + 3 * p, depths.mutable_data() + p * count, surface.mutable_data() + p * count);
  }
  return py::make_tuple(to_head, depths, surface, known);
}
}  // namespace

void bindHeadPose(py::module& module)
{
  module.def("estimate_head_pose", &estimateHeadPose, "Twin of head_pose.estimate_head_pose.", py::arg("rays"),
             py::arg("scores"), py::arg("root"), py::arg("scale"), py::arg("shoulder_cosine"), py::arg("joints"),
             py::arg("points"), py::arg("offsets"), py::arg("axes"), py::arg("ahead"), py::arg("error"),
             py::arg("cosine_spread"), py::arg("sine_spread"));
}
}  // namespace skeleton_extract_3d
