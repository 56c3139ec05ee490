#include "constants.h"

#include <string>

namespace skeleton_extract_3d
{
namespace
{
/** Reads the fields of one dataclass. */
class Reader
{
public:
  explicit Reader(const py::object& step) : step_(step)
  {
  }

  template <typename T>
  const Reader& operator()(const char* name, T& field) const
  {
    field = step_.attr(name).cast<T>();
    return *this;
  }

  /** Read an array that must have a number of values; 0: any. */
  template <typename T>
  const Reader& operator()(const char* name, std::vector<T>& field, std::size_t count) const
  {
    const Array<T> values = step_.attr(name).cast<Array<T>>();
    if (count > 0 && static_cast<std::size_t>(values.size()) != count)
    {
      throw std::invalid_argument(std::string(name) + " must have " + std::to_string(count) + " values, got " +
                                  std::to_string(values.size()));
    }
    field.assign(values.data(), values.data() + values.size());
    return *this;
  }

  std::vector<Segment> segments(const char* joints, const char* sizes) const
  {
    std::vector<Index> pairs;
    std::vector<double> size;
    (*this)(joints, pairs, 0);
    checkWithin(pairs.data(), pairs.size(), JOINTS, joints);
    (*this)(sizes, size, pairs.size() / 2);
    std::vector<Segment> result;
    for (std::size_t i = 0; i < size.size(); ++i)
    {
      result.push_back({ pairs[2 * i], pairs[2 * i + 1], size[i] });
    }
    return result;
  }

private:
  py::object step_;
};
}  // namespace

Constants::Constants(const py::object& method)
{
  const Reader read_body(method.attr("body"));
  read_body("adult_stature", body.adult_stature)("stature_limits", body.stature_limits);
  read_body("bone_lengths", body.bone_lengths, BONE_KINDS)("surface_offsets", body.surface_offsets, JOINTS);
  read_body("head_points", body.head_points, 3 * HEAD_JOINTS)("head_axes", body.head_axes, 3);
  read_body("head_ahead", body.head_ahead);
  read_body("upper_directions", body.upper_directions, 2 * LIMBS);
  read_body("upper_direction_spreads", body.upper_direction_spreads, 2 * LIMBS);
  read_body("lower_directions", body.lower_directions, 2 * LIMBS);
  read_body("lower_direction_spreads", body.lower_direction_spreads, 2 * LIMBS);
  body.sized = read_body.segments("sized_pairs", "sized_lengths");
  body.parts = read_body.segments("part_joints", "part_radii");

  const Reader joints(py::module::import("skeleton_extract_3d.body.body"));
  joints("HEAD", body.head, HEAD_JOINTS)("HIPS", body.hips, 2)("SIDES", body.sides, LIMBS)("NECK", body.neck);
  joints("MEASURED_BONES", body.bones, 0)("MEASURED_KINDS", body.bone_kinds, body.bones.size() / 2 + 1);
  joints("SATISFIED_BONES", lengths.order, 0);
  for (const auto* indices : { &body.head, &body.hips, &body.bones })
  {
    checkWithin(indices->data(), indices->size(), JOINTS, "joints");
  }
  checkWithin(&body.neck, 1, JOINTS, "NECK");
  checkWithin(body.bone_kinds.data(), body.bone_kinds.size(), BONE_KINDS, "MEASURED_KINDS");
  for (std::size_t i = 0; i + 2 < lengths.order.size(); i += 3)
  {
    checkWithin(lengths.order.data() + i, 2, JOINTS, "SATISFIED_BONES");
    checkWithin(lengths.order.data() + i + 2, 1, BONE_KINDS, "SATISFIED_BONES");
  }

  Reader(method.attr("windows"))("weights", windows.weights, SAMPLES);
  const Reader read_trunk(method.attr("trunk"));
  read_trunk("nearest", trunk.nearest)("step", trunk.step)("front", trunk.front)("behind", trunk.behind);
  read_trunk("floor", trunk.floor)("full_score", trunk.full_score)("joint_weights", trunk.joint_weights, JOINTS);
  read_trunk("low", trunk.low, 0)("high", trunk.high, trunk.low.size());
  checkWithin(trunk.low.data(), trunk.low.size(), trunk.low.size() + 1, "low");
  checkWithin(trunk.high.data(), trunk.high.size(), trunk.high.size() + 1, "high");
  const Reader read_costs(method.attr("costs"));
  read_costs("steps", costs.steps)("half", costs.half)("step", costs.step)("hidden", costs.hidden);
  read_costs("hidden_depth", costs.hidden_depth)("under", costs.under)("anything", costs.anything);
  read_costs("hidden_score", costs.hidden_score)("hidden_slope", costs.hidden_slope);
  read_costs("hidden_most", costs.hidden_most)("hidden_covered", costs.hidden_covered);
  read_costs("kernel_shifts", costs.kernel_shifts, 0)("kernel_shares", costs.kernel_shares, costs.kernel_shifts.size());
  Reader(method.attr("occluders"))("least_square", occluders.least_square);
  const Reader read_inference(method.attr("inference"));
  read_inference("mode", inference.mode)("nearest", inference.nearest)("pair_error", inference.pair_error);
  read_inference("level", inference.level)("least_length", inference.least_length);
  read_inference("length_limit", inference.length_limit)("direction_limit", inference.direction_limit);
  read_inference("turn_limit", inference.turn_limit)("turn_spread", inference.turn_spread, PAIRS);
  const Reader read_head(method.attr("head"));
  read_head("error", head.error)("cosine_spread", head.cosine_spread)("sine_spread", head.sine_spread);
  const Reader read_sizes(method.attr("sizes"));
  read_sizes("least_bones", sizes.least_bones)("prior_frames", sizes.prior_frames);
  read_sizes("most_frames", sizes.most_frames)("most_change", sizes.most_change);
  Reader(method.attr("camera_fit"))("least_points", camera_fit.least_points)("least_square", camera_fit.least_square);
  const py::object track = method.attr("track");
  Reader(track.attr("bone_constraints"))("change", lengths.change)("most_violation", lengths.most_violation);
  Reader(track.attr("joint_filter"))("trusted_deviations", filter.trusted_deviations);
}
}  // namespace skeleton_extract_3d
