/**
 * Constants of the compiled steps. They are read once from MethodConstants (skeleton_extract_3d/constants.py), whose
 * classes say what each one means and where it comes from; names are the same here.
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

/** Two joints, and a length or half a breadth [m]. */
struct Segment
{
  Index start, end;
  double size;
};

struct Constants
{
  explicit Constants(const py::object& method);

  struct Body
  {
    double adult_stature;
    std::array<double, 2> stature_limits;
    std::vector<double> bone_lengths, surface_offsets, head_points, head_axes;
    double head_ahead;
    /** Mean and deviation of where the four limbs point, outwards and forwards. */
    std::vector<double> upper_directions, upper_direction_spreads, lower_directions, lower_direction_spreads;
    std::vector<Segment> sized, parts;
    std::vector<Index> head, hips, sides;
    Index neck;
    std::vector<Index> bones, bone_kinds;  ///< pairs of joints; the last kind is the trunk's
  } body;

  struct Windows
  {
    std::vector<double> weights;
  } windows;

  struct Trunk
  {
    double nearest, step, front, behind, floor, full_score;
    std::vector<Index> low, high;
    std::vector<double> joint_weights;
  } trunk;

  struct Costs
  {
    int steps, half;
    double step, hidden, hidden_depth, under, anything, hidden_score, hidden_slope, hidden_most, hidden_covered;
    std::vector<Index> kernel_shifts;
    std::vector<double> kernel_shares;
  } costs;

  struct Occluders
  {
    double least_square;
  } occluders;

  struct Inference
  {
    int mode;
    double nearest, pair_error, level, least_length;
    float length_limit, direction_limit, turn_limit;
    std::vector<double> turn_spread;
  } inference;

  struct Head
  {
    double error, cosine_spread, sine_spread;
  } head;

  struct Sizes
  {
    std::size_t least_bones;
    double prior_frames, most_frames, most_change;
  } sizes;

  struct CameraFit
  {
    std::size_t least_points;
    double least_square;
  } camera_fit;

  struct Lengths
  {
    double change, most_violation;
    std::vector<Index> order;  ///< start, end and kind of each bone
  } lengths;

  struct Filter
  {
    double trusted_deviations;
  } filter;
};
}  // namespace skeleton_extract_3d
