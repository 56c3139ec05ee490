/**
 * Measured joints: their surface is at the inferred depth and of the person, and their bones have possible lengths.
 *
 * Arguments: z, depths of the joints [m]; offsets, depth of the joint under the surface [m]; foreign, samples on other
 * people; lengths of the bones of the limbs [m].
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

/** Mark the joints of one person that end a bone of a possible length. */
void markPlausible(const Constants& method, const double* xyz, const double* scores, const bool* known,
                   const float* lengths, bool* plausible)
{
  const Constants::Measuring& s = method.measuring;
  const double sure = method.sizes.least_score;
  std::fill_n(plausible, JOINTS, true);
  for (int limb = 0; limb < LIMBS; ++limb)
  {
    const Index root = method.joints.roots[limb], middle = method.joints.middles[limb], end = method.joints.ends[limb];
    const double upper = lengths[limb], lower = lengths[LIMBS + limb];
    const auto apart = [xyz](Index a, Index b) { return distanceBetween(at(xyz + 3 * a), at(xyz + 3 * b)); };
    const auto possible = [&](Index a, Index b, double length) {
      const double distance = apart(a, b);
      const double longest = s.longest * length + method.inference.keypoint_error;
      return !(known[a] && known[b]) || (distance > s.shortest * length && distance < longest);
    };
    // arms fold, legs of standing people do not
    const bool folded = known[root] && apart(root, end) < s.folded * (upper + lower) &&
                        (limb >= LIMBS / 2 || scores[middle] < sure);
    plausible[middle] = possible(root, middle, upper);
    plausible[end] = possible(middle, end, lower) && (plausible[middle] || scores[end] > sure) &&
                     !(folded && scores[end] < sure);
  }
}
}  // namespace

py::tuple measure(const Constants& method, const SeenArrays& seen, const Doubles& z, const Doubles& offsets,
                  const std::optional<Flags>& foreign, const Floats& lengths)
{
  const auto& [rays, scores, known, samples] = seen;
  const Constants::Measuring& s = method.measuring;
  const py::ssize_t people = countOf(rays);
  const double* ray = checked(rays, "rays", { people, JOINTS, 3 });
  const double* score = checked(scores, "scores", { people, JOINTS });
  const bool* found = checked(known, "known", { people, JOINTS });
  const double* sample = checked(samples, "samples", { people, JOINTS, SAMPLES });
  const double* depth = checked(z, "z", { people, JOINTS });
  const double* offset = checked(offsets, "offsets", { people, JOINTS });
  const bool* others = checked(foreign, "foreign", { people, JOINTS, SAMPLES });
  const float* length = checked(lengths, "lengths", { people, 2 * LIMBS });
  py::array_t<double> xyz(Shape{ people, JOINTS, 3 });
  py::array_t<bool> measured(Shape{ people, JOINTS }), plausible(Shape{ people, JOINTS });
  double* xyz_out = xyz.mutable_data();
  bool *measured_out = measured.mutable_data(), *plausible_out = plausible.mutable_data();
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    const double thickness = method.body.thickness[row % JOINTS];
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
  for (py::ssize_t p = 0; p < people; ++p)
  {
    markPlausible(method, xyz_out + p * JOINTS * 3, score + p * JOINTS, found + p * JOINTS, length + p * 2 * LIMBS,
                  plausible_out + p * JOINTS);
  }
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    measured_out[row] = measured_out[row] && plausible_out[row];
  }
  return py::make_tuple(xyz, measured, plausible);
}
}  // namespace skeleton_extract_3d
