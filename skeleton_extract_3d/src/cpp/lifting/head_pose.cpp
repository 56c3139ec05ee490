/** Fits rigid heads to their keypoints. */
#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
double square(double value)
{
  return value * value;
}

/** Return the depth of the front of an ellipsoid that is turned by a yaw, from the middle of the ears [m]. */
double frontOf(const Constants::Body& body, double across, double down, double cosine, double sine)
{
  const double side = body.head_axes[0], height = body.head_axes[1], length = body.head_axes[2];
  across -= body.head_ahead * sine;
  // a quadratic in z: c z^2 + 2 b x z + a x^2 = level, the cross section at this height
  const double a = square(cosine / side) + square(sine / length);
  const double b = cosine * sine * (1 / square(side) - 1 / square(length));
  const double c = square(sine / side) + square(cosine / length);
  const double level = std::max(1 - square(down / height), 0.1);
  const double root = std::sqrt(std::max(square(b * across) - c * (a * square(across) - level), 0.0));
  return -body.head_ahead * cosine - (b * across + root) / c;
}

struct Pose
{
  double x, y;          ///< the middle of the ears [m]
  double cosine, sine;  ///< of the yaw
  bool known;           ///< whether any joint of the head was found
};

/** Fit x = x0 + left cos(yaw) + ahead sin(yaw) by least squares, with the yaw of the shoulders as a prior. */
Pose fitPose(const Constants& method, const double* rays, const double* scores, double root, double scale,
             double shoulder_cosine)
{
  const Constants::Head& s = method.head;
  Matrix matrix{};
  Direction right_side{ 0.0, 0.0, 0.0 };
  double total = 0.0, y = 0.0;
  for (int i = 0; i < HEAD_JOINTS; ++i)
  {
    const Index joint = method.joints.head[i];
    const double x = rays[3 * joint] * root, weight = std::isfinite(x) ? scores[joint] : 0.0;
    if (!(weight > 0.0))
    {
      continue;
    }
    const Direction point = at(method.body.head_points.data() + 3 * i) * scale;
    const double terms[3] = { 1.0, point.x, point.z }, precision = weight / square(s.error);
    for (int k = 0; k < 9; ++k)
    {
      matrix[k] += precision * terms[k / 3] * terms[k % 3];
    }
    right_side = right_side + at(terms) * (precision * x);
    total += weight;
    y += weight * (rays[3 * joint + 1] * root - point.y);
  }
  matrix[0] += 1e-6;
  matrix[4] += 1 / square(s.yaw_spread);
  matrix[8] += 1 / square(s.yaw_spread);
  right_side.y += 1 / square(s.yaw_spread) * shoulder_cosine;
  const Direction solution = inverse(matrix) * right_side;
  const double norm = std::max(std::hypot(solution.y, solution.z), 1e-6);
  return { solution.x, y / std::max(total, 1e-9), solution.y / norm, solution.z / norm, total > 0.0 };
}
}  // namespace

py::tuple estimateHeadPose(const Constants& method, const Doubles& rays, const Doubles& scores, const Doubles& root,
                           const Doubles& scale, const Doubles& shoulder_cosine)
{
  const py::ssize_t people = countOf(rays);
  const double* ray = checked(rays, "rays", { people, JOINTS, 3 });
  const double* score = checked(scores, "scores", { people, JOINTS });
  const double* trunk = checked(root, "root", { people });
  const double* size = checked(scale, "scale", { people });
  const double* cosine = checked(shoulder_cosine, "shoulder_cosine", { people });
  py::array_t<double> to_head(Shape{ people, 3 }), depths(Shape{ people, HEAD_JOINTS });
  py::array_t<double> surface(Shape{ people, HEAD_JOINTS });
  py::array_t<bool> known(people);
  for (py::ssize_t p = 0; p < people; ++p)
  {
    const Pose pose =
        fitPose(method, ray + p * JOINTS * 3, score + p * JOINTS, trunk[p], size[p], cosine[p]);
    store({ pose.x / trunk[p], pose.y / trunk[p], 1.0 }, to_head.mutable_data(p));
    known.mutable_data()[p] = pose.known;
    for (int i = 0; i < HEAD_JOINTS; ++i)
    {
      const Direction point = at(method.body.head_points.data() + 3 * i);
      const double depth = (point.x * pose.sine - point.z * pose.cosine) * size[p];
      const double front =
          frontOf(method.body, point.x * pose.cosine + point.z * pose.sine, point.y, pose.cosine, pose.sine) * size[p];
      *depths.mutable_data(p, i) = depth;
      // off the outline of the ellipsoid the joint itself is the surface
      *surface.mutable_data(p, i) = std::min(front, depth - method.body.under_skin[method.joints.head[i]]);
    }
  }
  return py::make_tuple(to_head, depths, surface, known);
}
}  // namespace skeleton_extract_3d
