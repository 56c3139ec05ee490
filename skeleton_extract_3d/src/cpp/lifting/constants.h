/**
 * Constants of the compiled steps, read once from MethodConstants (skeleton_extract_3d/constants.py), which documents
 * them; names are the same here.
 */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "arrays.h"

namespace skeleton_extract_3d
{
constexpr int JOINTS = 18;   ///< of COCO_18
constexpr int SAMPLES = 25;  ///< of the window around a keypoint
constexpr int LIMBS = 4, PAIRS = 2;
constexpr int HEAD_JOINTS = 5;
constexpr int BONE_KINDS = 8;

using Index = std::int64_t;

/** Reads the fields of one dataclass, or names of a module. */
class Step
{
public:
  Step(const py::object& step) : step_(step)  // NOLINT(google-explicit-constructor): so steps need no constructors
  {
  }

protected:
  template <typename T = double>
  T get(const char* name) const
  {
    return step_.attr(name).cast<T>();
  }

  /** Read an array that must have a number of values. */
  template <typename T = double>
  std::vector<T> numbers(const char* name, std::size_t count) const
  {
    const auto values = get<Array<T>>(name);
    if (static_cast<std::size_t>(values.size()) != count)
    {
      throw std::invalid_argument(std::string(name) + " must have " + std::to_string(count) + " values, got " +
                                  std::to_string(values.size()));
    }
    return std::vector<T>(values.data(), values.data() + values.size());
  }

  /** Read an array of indices below an end. */
  std::vector<Index> indices(const char* name, Index end) const
  {
    const auto values = get<Integers>(name);
    checkWithin(values.data(), values.size(), end, name);
    return std::vector<Index>(values.data(), values.data() + values.size());
  }

private:
  py::object step_;
};

struct Constants : Step
{
  using Step::Step;

  struct Joints : Step
  {
    std::vector<Index> head = indices("HEAD", JOINTS);
    std::vector<Index> shoulders = indices("SHOULDERS", JOINTS), hips = indices("HIPS", JOINTS);
    std::vector<Index> roots = indices("ROOTS", JOINTS), middles = indices("MIDDLES", JOINTS);
    std::vector<Index> ends = indices("ENDS", JOINTS);
    std::vector<Index> upper_kinds = indices("UPPER_KINDS", BONE_KINDS);
    std::vector<Index> lower_kinds = indices("LOWER_KINDS", BONE_KINDS);
    Index neck = get<Index>("NECK");
    std::vector<double> sides = numbers("SIDES", LIMBS);
    std::vector<Index> measured_bones = indices("MEASURED_BONES", JOINTS);
    std::vector<Index> measured_kinds = indices("MEASURED_KINDS", BONE_KINDS);
    std::vector<Index> satisfied_bones = indices("SATISFIED_BONES", JOINTS);
  } joints{ py::module::import("skeleton_extract_3d.body.body") };

  struct Body : Step
  {
    double adult_stature = get("adult_stature"), head_ahead = get("head_ahead");
    double shoulder_width = get("shoulder_width"), hip_width = get("hip_width");
    double trunk_length = get("trunk_length"), neck_to_head = get("neck_to_head");
    std::vector<double> bone_lengths = numbers("bone_lengths", BONE_KINDS);
    std::vector<double> stature_limits = numbers("stature_limits", 2);
    std::vector<double> under_skin = numbers("under_skin", JOINTS);
    std::vector<double> thickness = numbers("thickness", JOINTS);
    std::vector<double> head_points = numbers("head_points", 3 * HEAD_JOINTS), head_axes = numbers("head_axes", 3);
    std::vector<double> upper_directions = numbers("upper_directions", 2 * LIMBS);
    std::vector<double> upper_direction_spreads = numbers("upper_direction_spreads", 2 * LIMBS);
    std::vector<double> lower_directions = numbers("lower_directions", 2 * LIMBS);
    std::vector<double> lower_direction_spreads = numbers("lower_direction_spreads", 2 * LIMBS);
    std::vector<Index> sized_pairs = indices("sized_pairs", JOINTS), part_joints = indices("part_joints", JOINTS);
    std::vector<double> sized_lengths = numbers("sized_lengths", sized_pairs.size() / 2);
    std::vector<double> part_radii = numbers("part_radii", part_joints.size() / 2);
    std::vector<bool> covering_parts = numbers<bool>("covering_parts", JOINTS * part_radii.size());
  } body{ get<py::object>("body") };

  struct Windows : Step
  {
    std::vector<double> weights = numbers("weights", SAMPLES);
  } windows{ get<py::object>("windows") };

  struct Trunk : Step
  {
    double nearest = get("nearest"), step = get("step");
    double front = get("front"), behind = get("behind");
    int count = static_cast<int>(get<Doubles>("depths").size());
    std::vector<Index> low = indices("low", count + 1), high = indices("high", count + 1);
  } trunk{ get<py::object>("trunk") };

  struct Costs : Step
  {
    int steps = get<int>("steps"), half = steps / 2;  ///< candidates, and the one at the depth of the trunk
    double step = get("step"), hidden = get("hidden"), under = get("under");
    double hidden_score = get("hidden_score"), hidden_slope = get("hidden_slope");
    double hidden_covered = get("hidden_covered"), anything = get("anything");
    std::vector<double> kernel_shares = get<std::vector<double>>("kernel_shares");
    float limit = get<float>("limit");
  } costs{ get<py::object>("costs") };

  struct Occluders : Step
  {
    double covering_share = get("covering_share");
  } occluders{ get<py::object>("occluders") };

  struct Measuring : Step
  {
    double agreement = get("agreement"), least_support = get("least_support");
    double shortest = get("shortest"), longest = get("longest");
    double folded = get("folded");
  } measuring{ get<py::object>("measuring") };

  struct Inference : Step
  {
    int mode = get<int>("mode");
    double keypoint_error = get("keypoint_error");
    float length_limit = get<float>("length_limit");
    std::vector<double> turn_spread = numbers("turn_spread", PAIRS);
  } inference{ get<py::object>("inference") };

  struct Head : Step
  {
    double error = get("error"), yaw_spread = get("yaw_spread");
  } head{ get<py::object>("head") };

  struct Sizes : Step
  {
    double least_score = get("least_score");
    std::size_t least_bones = get<std::size_t>("least_bones");
    double most_frames = get("most_frames");
  } sizes{ get<py::object>("sizes") };

  struct Registration : Step
  {
    std::size_t most_points = get<std::size_t>("most_points");
    int iterations = get<int>("iterations"), rigid_iterations = get<int>("rigid_iterations");
    double thickness = get("thickness"), agreement = get("agreement");
    double reach = get("reach"), rigid_reach = get("rigid_reach");
    double surface_error = get("surface_error"), edge_error = get("edge_error"), bone_error = get("bone_error");
    double outlier = get("outlier"), independent = get("independent");
  } registration{ get<py::object>("registration") };

  struct Completion : Step
  {
    double sigma_at_once = get("sigma_at_once"), sigma_growth = get("sigma_growth"), rest_time = get("rest_time");
    std::vector<double> rest_sigmas = numbers("rest_sigmas", JOINTS);
  } completion{ py::object(get<py::object>("track").attr("completion")) };

  struct Correction : Step
  {
    double trusted_deviations = get("trusted_deviations");
  } correction{ py::object(get<py::object>("track").attr("correction")) };
};
}  // namespace skeleton_extract_3d
