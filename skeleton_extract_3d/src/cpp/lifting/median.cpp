/** Medians of the values that there are, and people in one place by the median distance of their joints. */
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** Return the lower median of values, whose order changes; NaN without any. */
double medianOf(std::vector<double>& values)
{
  if (values.empty())
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto middle = values.begin() + (values.size() - 1) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
}  // namespace

py::array_t<double> lowerMedian(const Constants&, const Doubles& values)
{
  if (values.ndim() == 0)
  {
    throw std::invalid_argument("values must have an axis");
  }
  const py::ssize_t count = values.shape(values.ndim() - 1);
  py::array_t<double> result(Shape(values.shape(), values.shape() + values.ndim() - 1));
  std::vector<double> finite;
  for (py::ssize_t row = 0; row < result.size(); ++row)
  {
    const double* from = values.data() + row * count;
    finite.clear();
    std::copy_if(from, from + count, std::back_inserter(finite), [](double value) { return std::isfinite(value); });
    result.mutable_data()[row] = medianOf(finite);
  }
  return result;
}

py::array_t<bool> inOnePlace(const Constants& method, const Doubles& xyz, const Flags& placed, int least_joints,
                             double reach)
{
  const py::ssize_t people = countOf(xyz);
  const double* place = checked(xyz, "xyz", { people, JOINTS, 3 });
  const bool* there = checked(placed, "placed", { people, JOINTS });
  py::array_t<bool> result(Shape{ people, people });
  std::vector<double> distances;
  // whether the joints of b are near those of a, left and right as they are or exchanged
  const auto are_near = [&](py::ssize_t a, py::ssize_t b, bool exchanged) {
    int common = 0;
    distances.clear();
    for (Index joint = 0; joint < JOINTS; ++joint)
    {
      const Index one = a * JOINTS + joint, other = b * JOINTS + (exchanged ? method.joints.swap[joint] : joint);
      if (there[one] && there[other])
      {
        ++common;
        const double distance = distanceBetween(at(place + 3 * one), at(place + 3 * other));
        if (std::isfinite(distance))
        {
          distances.push_back(distance);
        }
      }
    }
    return common >= least_joints && medianOf(distances) < reach;
  };
  for (py::ssize_t a = 0; a < people; ++a)
  {
    for (py::ssize_t b = a; b < people; ++b)
    {
      const bool same = are_near(a, b, false) || are_near(a, b, true);
      *result.mutable_data(a, b) = *result.mutable_data(b, a) = same;
    }
  }
  return result;
}
}  // namespace skeleton_extract_3d
