/** Twins of joint_filter.py. */
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
/** The filters of points, point by point: (N, 3) and (N, 3, 3). */
struct FilterState
{
  double *position, *velocity, *position_covariance, *cross_covariance, *velocity_covariance;
};

/** Move points on; they take turns in having one of some accelerations [m/s^2]. */
void predict(const FilterState& state, int points, double elapsed, const double* acceleration, int kinds)
{
  const double square = elapsed * elapsed;
  for (int point = 0; point < points; ++point)
  {
    const double a = acceleration[point % kinds], noise = a * a;
    for (int i = 0; i < 3; ++i)
    {
      state.position[3 * point + i] += elapsed * state.velocity[3 * point + i];
    }
    double *of_position = state.position_covariance + 9 * point, *cross = state.cross_covariance + 9 * point;
    double* of_velocity = state.velocity_covariance + 9 * point;
    const Matrix turned = transposed(matrixAt(cross));
    for (int i = 0; i < 9; ++i)
    {
      const double driven = i % 4 == 0 ? noise : 0.0;  // on the diagonal
      of_position[i] += elapsed * (cross[i] + turned[i]) + square * of_velocity[i] + square * square / 4 * driven;
    }
    for (int i = 0; i < 9; ++i)
    {
      const double driven = i % 4 == 0 ? noise : 0.0;
      cross[i] += elapsed * of_velocity[i] + square * elapsed / 2 * driven;
      of_velocity[i] += square * driven;
    }
  }
}

/** Take the measurement of one point in. */
void correct(const FilterState& state, int point, const double* measured, const double* covariance,
             double trusted_deviations)
{
  double *position = state.position + 3 * point, *velocity = state.velocity + 3 * point;
  double *of_position = state.position_covariance + 9 * point, *of_both = state.cross_covariance + 9 * point;
  double* of_velocity = state.velocity_covariance + 9 * point;
  const Matrix prior = matrixAt(of_position), cross = matrixAt(of_both), noise = matrixAt(covariance);
  const Direction innovation{ measured[0] - position[0], measured[1] - position[1], measured[2] - position[2] };
  Matrix certainty = inverse(sum(prior, 1.0, noise));
  const double limit = trusted_deviations * trusted_deviations, off = dot(innovation, product(certainty, innovation));
  if (off > limit)
  {
    certainty = inverse(sum(prior, off / limit, noise));
  }
  const Matrix gain = product(prior, certainty), speed_gain = product(transposed(cross), certainty);
  const Direction moved = product(gain, innovation), sped = product(speed_gain, innovation);
  position[0] += moved.x;
  position[1] += moved.y;
  position[2] += moved.z;
  velocity[0] += sped.x;
  velocity[1] += sped.y;
  velocity[2] += sped.z;
  const auto store = [](const Matrix& matrix, double* values) { std::copy(matrix.begin(), matrix.end(), values); };
  store(symmetric(sum(matrixAt(of_velocity), -1.0, product(speed_gain, cross))), of_velocity);
  store(symmetric(sum(prior, -1.0, product(gain, prior))), of_position);
  store(sum(cross, -1.0, product(gain, cross)), of_both);
}

/** Position, velocity and their covariances, see joint_filter.JointFilter. */
using FilterArrays = std::array<Doubles, 5>;

/** Copies of the arrays of a filter. */
class FilterCopy
{
public:
  explicit FilterCopy(const FilterArrays& state)
    : tracks(sizeOf(state[0], "position", 3, 0)), points(state[0].shape(1))
  {
    for (std::size_t i = 0; i < state.size(); ++i)
    {
      const double* values = i < 2 ? checked(state[i], "position and velocity", { tracks, points, 3 }) :
                                     checked(state[i], "covariances", { tracks, points, 3, 3 });
      arrays_[i] = py::array_t<double>(std::vector<py::ssize_t>(state[i].shape(), state[i].shape() + state[i].ndim()));
      std::copy_n(values, state[i].size(), arrays_[i].mutable_data());
    }
  }

  FilterState state()
  {
    return { arrays_[0].mutable_data(), arrays_[1].mutable_data(), arrays_[2].mutable_data(),
             arrays_[3].mutable_data(), arrays_[4].mutable_data() };
  }
  py::tuple arrays() const
  {
    return py::make_tuple(arrays_[0], arrays_[1], arrays_[2], arrays_[3], arrays_[4]);
  }

  const py::ssize_t tracks, points;

private:
  std::array<py::array_t<double>, 5> arrays_;
};

py::tuple predictOf(const FilterArrays& state, double elapsed, const Doubles& acceleration)
{
  FilterCopy copy(state);
  const double* by_point = checked(acceleration, "acceleration", { copy.points });
  predict(copy.state(), copy.tracks * copy.points, elapsed, by_point, copy.points);
  return copy.arrays();
}

py::tuple correctOf(const FilterArrays& state, const Integers& rows, const Doubles& measured, const Doubles& covariance,
                    const Flags& mask, double trusted_deviations)
{
  FilterCopy copy(state);
  const py::ssize_t count = sizeOf(rows, "rows", 1, 0), points = copy.points;
  checkWithin(rows.data(), count, copy.tracks, "rows");
  const double* at = checked(measured, "measured", { count, points, 3 });
  const double* noise = checked(covariance, "covariance", { count, points, 3, 3 });
  const bool* use = checked(mask, "mask", { count, points });
  for (py::ssize_t i = 0; i < count * points; ++i)
  {
    if (use[i])
    {
      correct(copy.state(), rows.data()[i / points] * points + i % points, at + 3 * i, noise + 9 * i,
              trusted_deviations);
    }
  }
  return copy.arrays();
}
}  // namespace

void bindJointFilter(py::module& module)
{
  module.def("predict", &predictOf, "Twin of joint_filter.JointFilter.predict.", py::arg("state"), py::arg("elapsed"),
             py::arg("acceleration"));
  module.def("correct", &correctOf, "Twin of joint_filter.JointFilter.correct.", py::arg("state"), py::arg("rows"),
             py::arg("measured"), py::arg("covariance"), py::arg("mask"), py::arg("trusted_deviations"));
}
}  // namespace skeleton_extract_3d
