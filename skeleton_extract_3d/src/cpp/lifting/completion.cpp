/** Joints without a keypoint of detected people: where body and motion put them. */
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
constexpr int LEFT_AND_RIGHT = 2;
constexpr double SIDES_OF_PAIR[LEFT_AND_RIGHT] = { 1.0, -1.0 };

/** Time since the frame before, and greatest time without a keypoint [s]. */
struct Times
{
  double elapsed, timeout;
};

/** Trunk of a person: unit vectors to the left and down, and stature in statures of an adult. */
struct Trunk
{
  Direction left, down;
  double scale;
};

/** The joints of one person while they are placed one after another, from the trunk outwards. */
class PlacedJoints
{
public:
  double *position, *velocity, *sigma;  ///< [m], [m/s], [m]
  bool* placed;
  const bool* had;       ///< joints that had a place in an earlier frame
  const double* unseen;  ///< time without a keypoint [s]

  Direction place(Index joint) const
  {
    return at(position + 3 * joint);
  }

  /** Let a joint that is not placed move with a velocity [m/s], not as it did. */
  void moveWith(const Direction& speed, Index joint, double elapsed)
  {
    store(place(joint) + (speed - at(velocity + 3 * joint)) * elapsed, position + 3 * joint);
    store(speed, velocity + 3 * joint);
  }

  /** Place a joint that is not yet, where it had a place before or its rest is possible. */
  void fill(const Constants& method, const Times& times, Index joint, const std::optional<Direction>& rest,
            std::optional<Index> parent)
  {
    if (placed[joint] || !(had[joint] || rest) || !(unseen[joint] <= times.timeout))
    {
      return;
    }
    const Constants::Completion& s = method.completion;
    if (parent)
    {
      moveWith(at(velocity + 3 * *parent), joint, times.elapsed);
    }
    if (rest)
    {
      const double share = 1 - std::exp(-times.elapsed / s.rest_time);
      store(had[joint] ? place(joint) + (*rest - place(joint)) * share : *rest, position + 3 * joint);
    }
    const double most = s.rest_sigmas[joint];
    const double own = had[joint] ? std::min(s.sigma_at_once + s.sigma_growth * unseen[joint], most) : most;
    const double of_parent = parent ? sigma[*parent] : s.rest_sigmas[method.joints.neck];
    sigma[joint] = std::sqrt(own * own + of_parent * of_parent);
    placed[joint] = true;
  }
};

/** Return how the placed joints of the trunk move, mean [m/s]; nothing without any. */
std::optional<Direction> motionOfTrunk(const Constants& method, const PlacedJoints& pose)
{
  Direction total{ 0.0, 0.0, 0.0 };
  int count = 0;
  for (const std::vector<Index>& pair : { method.joints.shoulders, method.joints.hips })
  {
    for (const Index joint : pair)
    {
      if (pose.placed[joint])
      {
        total = total + at(pose.velocity + 3 * joint);
        ++count;
      }
    }
  }
  return count > 0 ? std::make_optional(total * (1.0 / count)) : std::nullopt;
}

/** Return the middle of a pair of joints, by both or one of them; nothing without any. */
std::optional<Direction> middleOf(const PlacedJoints& pose, const std::vector<Index>& pair, const Direction& half,
                                  bool by_both)
{
  const bool left = pose.placed[pair[0]], right = pose.placed[pair[1]];
  if (left && right && by_both)
  {
    return (pose.place(pair[0]) + pose.place(pair[1])) * 0.5;
  }
  if (left)
  {
    return pose.place(pair[0]) - half;
  }
  return right ? std::make_optional(pose.place(pair[1]) + half) : std::nullopt;
}

/** Return the neck under the known joints of the head; nothing without any. */
std::optional<Direction> neckUnderHead(const Constants& method, const PlacedJoints& pose, const Trunk& trunk)
{
  const Direction forward = cross(trunk.left, trunk.down * -1.0);
  Direction total{ 0.0, 0.0, 0.0 };
  int count = 0;
  for (int i = 0; i < HEAD_JOINTS; ++i)
  {
    const Index joint = method.joints.head[i];
    if (pose.placed[joint])
    {
      const Direction point = at(method.body.head_points.data() + 3 * i);
      const Direction offset = trunk.left * point.x + trunk.down * point.y + forward * point.z;
      total = total + (pose.place(joint) - offset * trunk.scale);
      ++count;
    }
  }
  if (count == 0)
  {
    return std::nullopt;
  }
  return total * (1.0 / count) + trunk.down * (trunk.scale * method.body.neck_to_head);
}

/** Return the neck by shoulders, hips or head. */
std::optional<Direction> neckOf(const Constants& method, const PlacedJoints& pose, const Trunk& trunk)
{
  const Constants::Body& body = method.body;
  const std::vector<Index>&shoulders = method.joints.shoulders, &hips = method.joints.hips;
  const Direction half = trunk.left * (trunk.scale * body.shoulder_width / 2);
  if (pose.placed[shoulders[0]] || pose.placed[shoulders[1]])
  {
    return middleOf(pose, shoulders, half, true);
  }
  if (pose.placed[hips[0]] && pose.placed[hips[1]])
  {
    return *middleOf(pose, hips, half, true) - trunk.down * (trunk.scale * body.trunk_length);
  }
  return neckUnderHead(method, pose, trunk);
}

void completePerson(const Constants& method, const Times& times, const Trunk& trunk, PlacedJoints& pose)
{
  const Constants::Body& body = method.body;
  const Constants::Joints& joints = method.joints;
  const Index neck = joints.neck;
  const Direction half_hips = trunk.left * (trunk.scale * body.hip_width / 2);
  const Direction half_shoulders = trunk.left * (trunk.scale * body.shoulder_width / 2);
  const std::optional<Direction> of_hips = middleOf(pose, joints.hips, half_hips, false);
  const std::optional<Direction> motion = motionOfTrunk(method, pose);
  if (motion && !pose.placed[neck])
  {
    pose.moveWith(*motion, neck, times.elapsed);
  }
  pose.fill(method, times, neck, neckOf(method, pose, trunk), std::nullopt);
  const bool has_neck = pose.placed[neck];
  const Direction under_neck = pose.place(neck) + trunk.down * (trunk.scale * body.trunk_length);
  const auto rest = [has_neck](const Direction& place) { return has_neck ? std::make_optional(place) : std::nullopt; };
  for (int i = 0; i < LEFT_AND_RIGHT; ++i)
  {
    pose.fill(method, times, joints.shoulders[i], rest(pose.place(neck) + half_shoulders * SIDES_OF_PAIR[i]), neck);
    pose.fill(method, times, joints.hips[i], rest(of_hips.value_or(under_neck) + half_hips * SIDES_OF_PAIR[i]), neck);
  }
  for (int part = 0; part < 2; ++part)
  {
    const std::vector<Index>&starts = part == 0 ? joints.roots : joints.middles,
        &ends = part == 0 ? joints.middles : joints.ends,
        &kinds = part == 0 ? joints.upper_kinds : joints.lower_kinds;
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      const Direction hanging =
          pose.place(starts[limb]) + trunk.down * (body.bone_lengths[kinds[limb]] * trunk.scale);
      pose.fill(method, times, ends[limb], pose.placed[starts[limb]] ? std::make_optional(hanging) : std::nullopt,
                starts[limb]);
    }
  }
  for (const Index joint : joints.head)
  {
    // without another joint of the head, it stays where it was above the neck
    pose.fill(method, times, joint, std::nullopt, neck);
  }
}
}  // namespace

py::tuple complete(const Constants& method, const std::tuple<Doubles, Doubles, Doubles, Flags>& joints,
                   const std::tuple<Flags, Doubles>& before, const std::tuple<Doubles, Doubles, Doubles>& trunks,
                   double elapsed, double timeout)
{
  const py::ssize_t people = countOf(std::get<0>(joints));
  py::array_t<double> position = copyOf(std::get<0>(joints), "position", { people, JOINTS, 3 });
  py::array_t<double> velocity = copyOf(std::get<1>(joints), "velocity", { people, JOINTS, 3 });
  py::array_t<double> sigma = copyOf(std::get<2>(joints), "sigma", { people, JOINTS });
  py::array_t<bool> placed = copyOf(std::get<3>(joints), "placed", { people, JOINTS });
  const bool* had = checked(std::get<0>(before), "had", { people, JOINTS });
  const double* unseen = checked(std::get<1>(before), "unseen", { people, JOINTS });
  const double* left = checked(std::get<0>(trunks), "left", { people, 3 });
  const double* down = checked(std::get<1>(trunks), "down", { people, 3 });
  const double* scale = checked(std::get<2>(trunks), "scale", { people });
  for (py::ssize_t p = 0; p < people; ++p)
  {
    const py::ssize_t first = p * JOINTS;
    PlacedJoints pose{ position.mutable_data() + 3 * first,
               velocity.mutable_data() + 3 * first,
               sigma.mutable_data() + first,
               placed.mutable_data() + first,
               had + first,
               unseen + first };
    completePerson(method, { elapsed, timeout }, { at(left + 3 * p), at(down + 3 * p), scale[p] }, pose);
  }
  return py::make_tuple(position, velocity, sigma, placed);
}
}  // namespace skeleton_extract_3d
