/** Twins of body_measures.py. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
struct MeasureSettings
{
  const std::int64_t* sized_pairs;
  const double* sized_lengths;
  int sized;
  int least_bones;
  double adult_stature;
  std::pair<double, double> stature_limits;
  const double* adult_lengths;  ///< kind by kind
  int kind_count;
  std::int64_t neck;
  const std::int64_t *hips, *pairs, *kinds;  ///< the last kind is the trunk's
  int pair_count;
  double prior_frames, most_frames, most_change;
};

struct PersonSizes
{
  double &stature, &stature_weight;
  double *bones, *bone_weights;
};

void addStature(const double* xyz, const bool* good, const MeasureSettings& s, std::vector<double>& ratios,
                PersonSizes& sizes)
{
  ratios.clear();
  for (int i = 0; i < s.sized; ++i)
  {
    const std::int64_t start = s.sized_pairs[2 * i], end = s.sized_pairs[2 * i + 1];
    if (good[start] && good[end])
    {
      ratios.push_back(distanceBetween(xyz + 3 * start, xyz + 3 * end) / s.sized_lengths[i]);
    }
  }
  const std::size_t count = ratios.size();
  if (count < static_cast<std::size_t>(s.least_bones))
  {
    return;
  }
  std::sort(ratios.begin(), ratios.end());
  const double middle = (ratios[(count - 1) / 2] + ratios[count / 2]) / 2;
  const double stature = std::min(std::max(middle * s.adult_stature, s.stature_limits.first), s.stature_limits.second);
  const double weight = std::min(sizes.stature_weight + 1, s.most_frames);
  // of the first frame, an adult's is the other half
  sizes.stature += (stature - sizes.stature) * (weight > 1 ? 1 / weight : 0.5);
  sizes.stature_weight = weight;
}

/** Take a frame into the sizes of one person. */
void addFrame(const double* xyz, const bool* good, const MeasureSettings& s, std::vector<double>& scratch,
              PersonSizes sizes)
{
  addStature(xyz, good, s, scratch, sizes);
  std::vector<double>& total = scratch;
  total.assign(2 * s.kind_count, 0.0);
  double* count = total.data() + s.kind_count;
  const auto add = [&](std::int64_t kind, double length) {
    const double prior = s.adult_lengths[kind] * (sizes.stature / s.adult_stature), weight = sizes.bone_weights[kind];
    const double expected = (s.prior_frames * prior + weight * sizes.bones[kind]) / (s.prior_frames + weight);
    if (std::abs(length / expected - 1) < s.most_change)
    {
      total[kind] += length;
      count[kind] += 1;
    }
  };
  for (int i = 0; i < s.pair_count; ++i)
  {
    const std::int64_t start = s.pairs[2 * i], end = s.pairs[2 * i + 1];
    if (good[start] && good[end])
    {
      add(s.kinds[i], distanceBetween(xyz + 3 * start, xyz + 3 * end));
    }
  }
  if (good[s.neck] && good[s.hips[0]] && good[s.hips[1]])
  {
    const double *one = xyz + 3 * s.hips[0], *other = xyz + 3 * s.hips[1];
    const double hips[3] = { (one[0] + other[0]) / 2, (one[1] + other[1]) / 2, (one[2] + other[2]) / 2 };
    add(s.kinds[s.pair_count], distanceBetween(xyz + 3 * s.neck, hips));
  }
  for (int kind = 0; kind < s.kind_count; ++kind)
  {
    const double weight = sizes.bone_weights[kind] + count[kind];
    const double change = total[kind] / std::max(count[kind], 1.0) - sizes.bones[kind];
    sizes.bones[kind] += change * (count[kind] / std::max(weight, 1.0));
    sizes.bone_weights[kind] = std::min(weight, s.most_frames);
  }
}

py::tuple withFrame(const std::array<Doubles, 4>& sizes, const Doubles& xyz, const Flags& good,
                    const Integers& sized_pairs, const Doubles& sized_lengths, int least_bones, double adult_stature,
                    const std::pair<double, double>& stature_limits, const Doubles& adult_lengths, std::int64_t neck,
                    const Integers& hips, const Integers& pairs, const Integers& kinds, double prior_frames,
                    double most_frames, double most_change)
{
  const py::ssize_t people = sizeOf(xyz, "xyz", 3, 0), joints = xyz.shape(1);
  const py::ssize_t sized = partCount(sized_pairs, joints), pair_count = partCount(pairs, joints);
  const py::ssize_t kind_count = sizeOf(adult_lengths, "adult_lengths", 1, 0);
  checkWithin(&neck, 1, joints, "neck");
  checkWithin(checked(hips, "hips", { 2 }), 2, joints, "hips");
  checkWithin(checked(kinds, "kinds", { pair_count + 1 }), pair_count + 1, kind_count, "kinds");
  const MeasureSettings settings{ sized_pairs.data(), checked(sized_lengths, "sized_lengths", { sized }),
                                  static_cast<int>(sized), least_bones, adult_stature, stature_limits,
                                  adult_lengths.data(), static_cast<int>(kind_count), neck, hips.data(), pairs.data(),
                                  kinds.data(), static_cast<int>(pair_count), prior_frames, most_frames, most_change };
  const double* at = checked(xyz, "xyz", { people, joints, 3 });
  const bool* use = checked(good, "good", { people, joints });
  py::array_t<double> stature(people), stature_weight(people);
  py::array_t<double> bones({ people, kind_count }), bone_weights({ people, kind_count });
  std::copy_n(checked(sizes[0], "stature", { people }), people, stature.mutable_data());
  std::copy_n(checked(sizes[1], "stature_weight", { people }), people, stature_weight.mutable_data());
  std::copy_n(checked(sizes[2], "bones", { people, kind_count }), bones.size(), bones.mutable_data());
  std::copy_n(checked(sizes[3], "bone_weights", { people, kind_count }), bones.size(), bone_weights.mutable_data());
  std::vector<double> scratch;
  for (py::ssize_t p = 0; p < people; ++p)
  {
    addFrame(at + p * joints * 3, use + p * joints, settings, scratch,
             { stature.mutable_data()[p], stature_weight.mutable_data()[p], bones.mutable_data() + p * kind_count,
               bone_weights.mutable_data() + p * kind_count });
  }
  return py::make_tuple(stature, stature_weight, bones, bone_weights);
}
}  // namespace

void bindBodyMeasures(py::module& module)
{
  module.def("with_frame", &withFrame, "Twin of body_measures.with_frame.", py::arg("sizes"), py::arg("xyz"),
             py::arg("good"), py::arg("sized_pairs"), py::arg("sized_lengths"), py::arg("least_bones"),
             py::arg("adult_stature"), py::arg("stature_limits"), py::arg("adult_lengths"), py::arg("neck"),
             py::arg("hips"), py::arg("pairs"), py::arg("kinds"), py::arg("prior_frames"), py::arg("most_frames"),
             py::arg("most_change"));
}
}  // namespace skeleton_extract_3d
