/** Lengths of bones: learnt from measured joints, and constraints on uncertain ones. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** Measured sizes of one person, see measures.Sizes. */
struct PersonSizes
{
  double &stature, &stature_weight;
  double *bones, *bone_weights;
};

/** Move the stature towards the median ratio of the bones to those of an adult. */
void learnStature(const Constants& method, const double* xyz, const bool* good, PersonSizes& sizes)
{
  const Constants::Body& body = method.body;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < body.sized_lengths.size(); ++i)
  {
    const Index start = body.sized_pairs[2 * i], end = body.sized_pairs[2 * i + 1];
    if (good[start] && good[end])
    {
      ratios.push_back(distanceBetween(at(xyz + 3 * start), at(xyz + 3 * end)) / body.sized_lengths[i]);
    }
  }
  const std::size_t count = ratios.size();
  if (count < method.sizes.least_bones)
  {
    return;
  }
  std::sort(ratios.begin(), ratios.end());
  const double median = (ratios[(count - 1) / 2] + ratios[count / 2]) / 2;
  const double stature =
      std::min(std::max(median * body.adult_stature, body.stature_limits[0]), body.stature_limits[1]);
  const double weight = std::min(sizes.stature_weight + 1, method.sizes.most_frames);
  // the first frame counts half, an adult's stature the other half
  sizes.stature += (stature - sizes.stature) * (weight > 1 ? 1 / weight : 0.5);
  sizes.stature_weight = weight;
}

/** Update the mean length of each kind of bone with one frame. */
void learnBones(const Constants& method, const double* xyz, const bool* good, PersonSizes& sizes)
{
  const Constants::Joints& joints = method.joints;
  std::array<double, BONE_KINDS> total{}, count{};
  const auto add = [&](Index kind, double length) {
    total[kind] += length;
    count[kind] += 1;
  };
  for (std::size_t i = 0; i + 1 < joints.measured_kinds.size(); ++i)
  {
    const Index start = joints.measured_bones[2 * i], end = joints.measured_bones[2 * i + 1];
    if (good[start] && good[end])
    {
      add(joints.measured_kinds[i], distanceBetween(at(xyz + 3 * start), at(xyz + 3 * end)));
    }
  }
  if (good[joints.neck] && good[joints.hips[0]] && good[joints.hips[1]])
  {
    const Direction hips = (at(xyz + 3 * joints.hips[0]) + at(xyz + 3 * joints.hips[1])) * 0.5;
    add(joints.measured_kinds.back(), distanceBetween(at(xyz + 3 * joints.neck), hips));
  }
  for (int kind = 0; kind < BONE_KINDS; ++kind)
  {
    const double weight = sizes.bone_weights[kind] + count[kind];
    const double change = total[kind] / std::max(count[kind], 1.0) - sizes.bones[kind];
    sizes.bones[kind] += change * (count[kind] / std::max(weight, 1.0));
    sizes.bone_weights[kind] = std::min(weight, method.sizes.most_frames);
  }
}

/** Bring the joints of one person nearer to where a bone has its length, each as far as it is uncertain. */
void satisfyBone(double length, double spread, const double* start_covariance,
                 const double* end_covariance, double* start, double* end)
{
  const Direction along = at(end) - at(start);
  const double distance = std::max(std::sqrt(dot(along, along)), 1e-6), excess = distance - length;
  if (!std::isfinite(excess))
  {
    return;
  }
  const Direction unit_along{ along.x / distance, along.y / distance, along.z / distance };
  const Direction start_pull = matrixAt(start_covariance) * unit_along;
  const Direction end_pull = matrixAt(end_covariance) * unit_along;
  const double uncertainty = spread * length;
  const double share = excess / (dot(start_pull + end_pull, unit_along) + uncertainty * uncertainty);
  store(at(start) + start_pull * share, start);
  store(at(end) - end_pull * share, end);
}
}  // namespace

py::tuple withFrame(const Constants& method, const std::array<Doubles, 4>& sizes, const Doubles& xyz, const Flags& good)
{
  const py::ssize_t people = countOf(xyz);
  const double* place = checked(xyz, "xyz", { people, JOINTS, 3 });
  const bool* use = checked(good, "good", { people, JOINTS });
  py::array_t<double> stature = copyOf(sizes[0], "stature", { people });
  py::array_t<double> stature_weight = copyOf(sizes[1], "stature_weight", { people });
  py::array_t<double> bones = copyOf(sizes[2], "bones", { people, BONE_KINDS });
  py::array_t<double> bone_weights = copyOf(sizes[3], "bone_weights", { people, BONE_KINDS });
  for (py::ssize_t p = 0; p < people; ++p)
  {
    PersonSizes person{ *stature.mutable_data(p), *stature_weight.mutable_data(p), bones.mutable_data(p),
                        bone_weights.mutable_data(p) };
    learnStature(method, place + p * JOINTS * 3, use + p * JOINTS, person);
    learnBones(method, place + p * JOINTS * 3, use + p * JOINTS, person);
  }
  return py::make_tuple(stature, stature_weight, bones, bone_weights);
}

py::array_t<double> satisfyLengths(const Constants& method, const Doubles& xyz, const Doubles& covariance,
                                   const Doubles& lengths, const Doubles& spreads, const Flags& usable)
{
  const py::ssize_t people = countOf(xyz);
  const double* noise = checked(covariance, "covariance", { people, JOINTS, 3, 3 });
  const double* length = checked(lengths, "lengths", { people, BONE_KINDS });
  const double* spread = checked(spreads, "spreads", { people, BONE_KINDS });
  const bool* use = checked(usable, "usable", { people, JOINTS });
  py::array_t<double> result = copyOf(xyz, "xyz", { people, JOINTS, 3 });
  const std::vector<Index>& order = method.joints.satisfied_bones;
  for (py::ssize_t p = 0; p < people; ++p)
  {
    for (std::size_t i = 0; i + 2 < order.size(); i += 3)
    {
      const Index start = p * JOINTS + order[i], end = p * JOINTS + order[i + 1];
      const Index kind = p * BONE_KINDS + order[i + 2];
      if (use[start] && use[end])
      {
        satisfyBone(length[kind], spread[kind], noise + 9 * start, noise + 9 * end,
                    result.mutable_data() + 3 * start, result.mutable_data() + 3 * end);
      }
    }
  }
  return result;
}
}  // namespace skeleton_extract_3d
