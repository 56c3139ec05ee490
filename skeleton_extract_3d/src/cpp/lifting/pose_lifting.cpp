/** Twins of pose_lifting.py. */
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "body.h"
#include "geometry.h"
#include "surfaces.h"

namespace skeleton_extract_3d
{
namespace
{
struct JointRules
{
  const double* thicknesses;  ///< joint by joint [m]
  const std::int64_t* head;
  int head_count;
  const std::int64_t* chains;  ///< roots, middles and ends of the four limbs
  const bool* legs;
  double agreement, least_support, against_front, least_own, shortest, longest, bone_error, sure_end, unsure_end,
      folded;
};

struct PersonSeen
{
  const double *rays, *scores;
  const bool* known;
  const double *depth, *z, *offsets, *own;
  const bool* foreign;
  const float *upper, *lower;
};

struct PersonMeasured
{
  double *xyz, *surface;
  bool *measured, *plausible;
};

/** Mark the joints that end a bone of a possible length. */
void markPlausible(const PersonSeen& seen, int joints, const JointRules& s, const PersonMeasured& out)
{
  std::fill_n(out.plausible, joints, true);
  for (int limb = 0; limb < LIMBS; ++limb)
  {
    const std::int64_t root = s.chains[limb], middle = s.chains[LIMBS + limb], end = s.chains[2 * LIMBS + limb];
    const double *at_root = out.xyz + 3 * root, *at_middle = out.xyz + 3 * middle, *at_end = out.xyz + 3 * end;
    const double upper = seen.upper[limb], lower = seen.lower[limb];
    const auto possible = [&s](double distance, double length) {
      return distance > s.shortest * length && distance < s.longest * length + s.bone_error;
    };
    out.plausible[middle] = possible(distanceBetween(at_root, at_middle), upper) ||
                            !(seen.known[root] && seen.known[middle]);
    const bool of_end = possible(distanceBetween(at_middle, at_end), lower) || !(seen.known[middle] && seen.known[end]);
    const bool folded = seen.known[root] && distanceBetween(at_root, at_end) < s.folded * (upper + lower) &&
                        (s.legs[limb] || seen.scores[middle] < s.unsure_end);
    out.plausible[end] = of_end && (out.plausible[middle] || seen.scores[end] > s.sure_end) &&
                         !(folded && seen.scores[end] < s.unsure_end);
  }
}

/** Decide which joints of one person were seen, and put those where their surface is. */
void measure(const PersonSeen& seen, int joints, int samples, Window& window, const JointRules& s,
             const PersonMeasured& out)
{
  const auto is_head = [&s](int joint) {
    const std::int64_t* end = s.head + s.head_count;
    return std::find(s.head, end, joint) != end;
  };
  for (int joint = 0; joint < joints; ++joint)
  {
    const double z = seen.z[joint], offset = seen.offsets[joint], thickness = s.thicknesses[joint];
    const double* depth = seen.depth + joint * samples;
    const double hides = z - std::max(thickness, offset);
    double support = 0.0, moment = 0.0, in_front = 0.0;
    window.look(depth);
    for (int i = 0; i < samples; ++i)
    {
      const double weight = window.weight(i);
      if (std::abs(depth[i] + offset - z) < s.agreement &&
          (seen.foreign == nullptr || !seen.foreign[joint * samples + i]))
      {
        support += weight;
        moment += weight * depth[i];
      }
      in_front += depth[i] < hides ? weight : 0.0;
    }
    const double surface = moment / std::max(support, 1e-9);
    bool measured = seen.known[joint] && support > s.least_support && seen.own[joint] > s.least_own &&
                    support >= s.against_front * in_front;
    double at = z;
    if (is_head(joint))
    {
      measured = measured && offset < thickness;
    }
    else if (measured)
    {
      at = surface + offset;
    }
    out.measured[joint] = measured;
    for (int i = 0; i < 3; ++i)
    {
      out.xyz[3 * joint + i] = seen.rays[3 * joint + i] * at;
      out.surface[3 * joint + i] = seen.rays[3 * joint + i] * surface;
    }
  }
  markPlausible(seen, joints, s, out);
  for (int joint = 0; joint < joints; ++joint)
  {
    out.measured[joint] = out.measured[joint] && out.plausible[joint];
    if (!out.measured[joint])
    {
      std::fill_n(out.surface + 3 * joint, 3, std::numeric_limits<double>::quiet_NaN());
    }
  }
}

/** Add the costs of being elsewhere than before to those of one joint. */
void addMemory(double root, double depth, double sigma, const double* deltas, int steps, double limit, float* costs)
{
  for (int i = 0; i < steps; ++i)
  {
    const double off = (root + deltas[i] - depth) / sigma;
    costs[i] += std::isfinite(off) ? static_cast<float>(std::min(off * off, limit)) : 0.0f;
  }
}

py::tuple measureOf(const Doubles& rays, const Doubles& scores, const Flags& known, const Doubles& depth,
                    const Doubles& z, const Doubles& offsets, const Doubles& own, const std::optional<Flags>& foreign,
                    const Floats& upper, const Floats& lower, const Doubles& weights, const Doubles& thicknesses,
                    const Integers& head, const Integers& chains, const Flags& legs, double agreement,
                    double least_support, double against_front, double least_own, double shortest, double longest,
                    double bone_error, double sure_end, double unsure_end, double folded)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const JointRules rules{ checked(thicknesses, "thicknesses", { joints }), head.data(), static_cast<int>(head.size()),
                          checked(chains, "chains", { 3 * LIMBS }), checked(legs, "legs", { LIMBS }), agreement,
                          least_support, against_front, least_own, shortest, longest, bone_error, sure_end, unsure_end,
                          folded };
  checkWithin(rules.chains, 3 * LIMBS, joints, "chains");
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const double* score = checked(scores, "scores", { people, joints });
  const bool* found = checked(known, "known", { people, joints });
  const double* at = checked(z, "z", { people, joints });
  const double* offset = checked(offsets, "offsets", { people, joints });
  const double* likely_own = checked(own, "own", { people, joints });
  const bool* others = checked(foreign, "foreign", { people, joints, samples });
  const float* upper_length = checked(upper, "upper", { people, LIMBS });
  const float* lower_length = checked(lower, "lower", { people, LIMBS });
  Window window(checked(weights, "weights", { samples }), samples);
  py::array_t<double> xyz({ people, joints, py::ssize_t{ 3 } }), surface({ people, joints, py::ssize_t{ 3 } });
  py::array_t<bool> measured({ people, joints }), plausible({ people, joints });
  for (py::ssize_t p = 0; p < people; ++p)
  {
    const py::ssize_t row = p * joints;
    measure({ ray + 3 * row, score + row, found + row, depth.data() + row * samples, at + row, offset + row,
              likely_own + row, others == nullptr ? nullptr : others + row * samples, upper_length + p * LIMBS,
              lower_length + p * LIMBS },
            joints, samples, window, rules,
            { xyz.mutable_data() + 3 * row, surface.mutable_data() + 3 * row, measured.mutable_data() + row,
              plausible.mutable_data() + row });
  }
  return py::make_tuple(xyz, surface, measured, plausible);
}

py::array_t<float> withMemory(const Floats& costs, const Doubles& root, const Doubles& depth, const Doubles& sigma,
                              const Doubles& deltas, double limit)
{
  const py::ssize_t people = sizeOf(costs, "costs", 3, 0), joints = costs.shape(1), steps = costs.shape(2);
  const double* trunk = checked(root, "root", { people });
  const double* before = checked(depth, "depth", { people, joints });
  const double* deviation = checked(sigma, "sigma", { people, joints });
  const double* delta = checked(deltas, "deltas", { steps });
  py::array_t<float> result({ people, joints, steps });
  std::copy_n(costs.data(), costs.size(), result.mutable_data());
  for (py::ssize_t row = 0; row < people * joints; ++row)
  {
    addMemory(trunk[row / joints], before[row], deviation[row], delta, steps, limit,
              result.mutable_data() + row * steps);
  }
  return result;
}
}  // namespace

void bindPoseLifting(py::module& module)
{
  module.def("with_memory", &withMemory, "Twin of pose_lifting.with_memory.", py::arg("costs"), py::arg("root"),
             py::arg("depth"), py::arg("sigma"), py::arg("deltas"), py::arg("limit"));
  module.def("measure", &measureOf, "Twin of pose_lifting.measure.", py::arg("rays"), py::arg("scores"),
             py::arg("known"), py::arg("depth"), py::arg("z"), py::arg("offsets"), py::arg("own"), py::arg("foreign"),
             py::arg("upper"), py::arg("lower"), py::arg("weights"), py::arg("thicknesses"), py::arg("head"),
             py::arg("chains"), py::arg("legs"), py::arg("agreement"), py::arg("least_support"),
             py::arg("against_front"), py::arg("least_own"), py::arg("shortest"), py::arg("longest"),
             py::arg("bone_error"), py::arg("sure_end"), py::arg("unsure_end"), py::arg("folded"));
}
}  // namespace skeleton_extract_3d
