/** Kalman filters of points: corrections. */
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** Position, velocity and their covariances, of one point. */
struct PointState
{
  double *position, *velocity, *position_covariance, *cross_covariance, *velocity_covariance;
};

void storeSymmetric(const Matrix& m, double* values)
{
  // without, what rounding leaves would grow from frame to frame
  const Matrix mean = sum(m, 1.0, transposed(m));
  std::transform(mean.begin(), mean.end(), values, [](double value) { return value / 2; });
}

/** Take one measurement into one point. */
void correctPoint(const PointState& point, const double* measured, const double* covariance, double trusted_deviations)
{
  const Matrix prior = matrixAt(point.position_covariance), cross_covariance = matrixAt(point.cross_covariance);
  const Matrix noise = matrixAt(covariance);
  const Direction innovation = at(measured) - at(point.position);
  Matrix certainty = inverse(sum(prior, 1.0, noise));
  const double limit = trusted_deviations * trusted_deviations, off = dot(innovation, certainty * innovation);
  if (off > limit)
  {
    certainty = inverse(sum(prior, off / limit, noise));
  }
  const Matrix gain = prior * certainty, speed_gain = transposed(cross_covariance) * certainty;
  store(at(point.position) + gain * innovation, point.position);
  store(at(point.velocity) + speed_gain * innovation, point.velocity);
  storeSymmetric(sum(matrixAt(point.velocity_covariance), -1.0, speed_gain * cross_covariance),
                 point.velocity_covariance);
  storeSymmetric(sum(prior, -1.0, gain * prior), point.position_covariance);
  const Matrix both = sum(cross_covariance, -1.0, gain * cross_covariance);
  std::copy(both.begin(), both.end(), point.cross_covariance);
}
}  // namespace

py::tuple correct(const Constants& method, const FilterArrays& state, const Doubles& measured, const Doubles& covariance,
                  const Flags& mask)
{
  const py::ssize_t tracks = countOf(state[0]), points = state[0].ndim() == 3 ? state[0].shape(1) : 0;
  std::array<py::array_t<double>, 5> result;
  std::array<double*, 5> to;
  for (std::size_t i = 0; i < state.size(); ++i)
  {
    result[i] = i < 2 ? copyOf(state[i], "position and velocity", { tracks, points, 3 }) :
                        copyOf(state[i], "covariances", { tracks, points, 3, 3 });
    to[i] = result[i].mutable_data();
  }
  const double* place = checked(measured, "measured", { tracks, points, 3 });
  const double* noise = checked(covariance, "covariance", { tracks, points, 3, 3 });
  const bool* use = checked(mask, "mask", { tracks, points });
  for (py::ssize_t i = 0; i < tracks * points; ++i)
  {
    if (use[i])
    {
      correctPoint({ to[0] + 3 * i, to[1] + 3 * i, to[2] + 9 * i, to[3] + 9 * i, to[4] + 9 * i }, place + 3 * i,
                   noise + 9 * i, method.correction.trusted_deviations);
    }
  }
  return py::make_tuple(result[0], result[1], result[2], result[3], result[4]);
}
}  // namespace skeleton_extract_3d
