/**
 * Measured joints: their surface is at the inferred depth and of the person.
 *
 * Arguments: z, depths of the joints [m]; offsets, depth of the joint under the surface [m]; foreign, samples on other
 * people.
 */
#include <algorithm>
#include <cmath>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** Support of a joint by the samples of one window. */
struct Support
{
  double total, own, in_front;  ///< weights of the valid samples, of those that support the joint, and in front of it
  double surface;               ///< mean of those that support it [m]
};

Support supportOf(const Constants& method, const double* samples, const bool* foreign, double surface, double hides)
{
  Support result{ 0.0, 0.0, 0.0, 0.0 };
  for (int i = 0; i < SAMPLES; ++i)
  {
    const double weight = method.windows.weights[i], depth = samples[i];
    result.total += std::isfinite(depth) ? weight : 0.0;
    result.in_front += depth < hides ? weight : 0.0;
    if (std::abs(depth - surface) < method.measuring.agreement && (foreign == nullptr || !foreign[i]))
    {
      result.own += weight;
      result.surface += weight * depth;
    }
  }
  result.surface /= std::max(result.own, 1e-9);
  return result;
}
}  // namespace

py::tuple measure(const Constants& method, const SeenArrays& seen, const Doubles& z, const Doubles& offsets,
                  const std::optional<Flags>& foreign)
{
  const auto& [rays, scores, known, samples] = seen;
  const Constants::Measuring& s = method.measuring;
  const py::ssize_t people = countOf(rays);
  const double* ray = checked(rays, "rays", { people, JOINTS, 3 });
  checked(scores, "scores", { people, JOINTS });
  const bool* found = checked(known, "known", { people, JOINTS });
  const double* sample = checked(samples, "samples", { people, JOINTS, SAMPLES });
  const double* depth = checked(z, "z", { people, JOINTS });
  const double* offset = checked(offsets, "offsets", { people, JOINTS });
  const bool* others = checked(foreign, "foreign", { people, JOINTS, SAMPLES });
  py::array_t<double> xyz(Shape{ people, JOINTS, 3 });
  py::array_t<bool> measured(Shape{ people, JOINTS });
  double* xyz_out = xyz.mutable_data();
  bool* measured_out = measured.mutable_data();
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    const double thickness = method.body.thicknesses[row % JOINTS];
    const Support support =
        supportOf(method, sample + row * SAMPLES, others == nullptr ? nullptr : others + row * SAMPLES,
                  depth[row] - offset[row], depth[row] - std::max(thickness, offset[row]));
    const auto& head = method.joints.head;
    const bool of_head = std::find(head.begin(), head.end(), row % JOINTS) != head.end();
    // a face that is turned away is under the head
    measured_out[row] = found[row] && support.own > s.least_support * support.total &&
                        support.own >= support.in_front && (!of_head || offset[row] < thickness);
    store(at(ray + 3 * row) * (measured_out[row] && !of_head ? support.surface + offset[row] : depth[row]),
          xyz_out + 3 * row);
  }
  return py::make_tuple(xyz, measured);
}
}  // namespace skeleton_extract_3d
