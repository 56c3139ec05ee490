#include "people_labeller.h"

#include <algorithm>

namespace openpose_ros_nodelets
{
namespace
{

// Points of the body that follow from joints.
enum Derived : std::size_t
{
  MID_HIP = JOINTS,
  HEAD,
  RIGHT_HAND,
  LEFT_HAND,
  POINTS
};

struct BoneShape
{
  std::size_t start, end;
  float core, margin;  // of an adult [m]
};

// Joints lie 3 to 12 cm under the skin of a dressed adult, see under_skin in skeleton_extract_3d/body/body.py. The core
// is about that deep; the margin holds flesh, clothes and hair.
constexpr BoneShape SHAPES[] = {
  { NECK, MID_HIP, 0.11f, 0.14f },
  { RIGHT_SHOULDER, LEFT_SHOULDER, 0.08f, 0.12f },
  { RIGHT_HIP, LEFT_HIP, 0.11f, 0.14f },
  { RIGHT_SHOULDER, RIGHT_HIP, 0.09f, 0.14f },
  { LEFT_SHOULDER, LEFT_HIP, 0.09f, 0.14f },
  { NECK, HEAD, 0.07f, 0.13f },
  { HEAD, HEAD, 0.10f, 0.16f },
  { RIGHT_SHOULDER, RIGHT_ELBOW, 0.06f, 0.10f },
  { LEFT_SHOULDER, LEFT_ELBOW, 0.06f, 0.10f },
  { RIGHT_ELBOW, RIGHT_WRIST, 0.05f, 0.09f },
  { LEFT_ELBOW, LEFT_WRIST, 0.05f, 0.09f },
  { RIGHT_WRIST, RIGHT_HAND, 0.05f, 0.10f },
  { LEFT_WRIST, LEFT_HAND, 0.05f, 0.10f },
  { RIGHT_HIP, RIGHT_KNEE, 0.09f, 0.13f },
  { LEFT_HIP, LEFT_KNEE, 0.09f, 0.13f },
  { RIGHT_KNEE, RIGHT_ANKLE, 0.06f, 0.12f },
  { LEFT_KNEE, LEFT_ANKLE, 0.06f, 0.12f },
  { RIGHT_ANKLE, RIGHT_ANKLE, 0.08f, 0.20f },
  { LEFT_ANKLE, LEFT_ANKLE, 0.08f, 0.20f },
};

struct BoneLength
{
  Joint start, end;
  float length;  // of an adult of 1.70 m [m]: sized_bones in skeleton_extract_3d/body/body.py
};

constexpr BoneLength LENGTHS[] = {
  { NECK, RIGHT_HIP, 0.510f },         { NECK, LEFT_HIP, 0.510f },
  { RIGHT_SHOULDER, RIGHT_HIP, 0.506f }, { LEFT_SHOULDER, LEFT_HIP, 0.506f },
  { RIGHT_HIP, RIGHT_KNEE, 0.394f },   { LEFT_HIP, LEFT_KNEE, 0.394f },
  { RIGHT_KNEE, RIGHT_ANKLE, 0.400f }, { LEFT_KNEE, LEFT_ANKLE, 0.400f },
  { RIGHT_SHOULDER, RIGHT_ELBOW, 0.269f }, { LEFT_SHOULDER, LEFT_ELBOW, 0.269f },
};
// From a small child to a tall adult, relative to 1.70 m.
constexpr float LEAST_SCALE = 0.45f, GREATEST_SCALE = 1.25f;
// An inferred joint reaches less far, by this share of its standard deviation.
constexpr float DOUBT = 0.5f;
constexpr float HAND = 0.15f;           // from the wrist to the finger tips, less the radius there [m]
constexpr float NECK_TO_HEAD = 0.201f;  // to the middle of the ears [m]

using Points = std::array<BodyPoint, POINTS>;

float bodyScale(const Points& points)
{
  float sum = 0.0f, adult = 0.0f;
  for (const bool inferred : { false, true })
  {
    for (const BoneLength& bone : LENGTHS)
    {
      const BodyPoint &start = points[bone.start], &end = points[bone.end];
      if (!start.known() || !end.known() || (std::max(start.uncertainty, end.uncertainty) > 0.0f) != inferred)
        continue;
      sum += (end.position - start.position).norm();
      adult += bone.length;
    }
    if (adult > 0.0f)
      break;
  }
  return adult > 0.0f ? std::min(std::max(sum / adult, LEAST_SCALE), GREATEST_SCALE) : 1.0f;
}

BodyPoint middle(const BodyPoint& first, const BodyPoint& second)
{
  return { 0.5f * (first.position + second.position), std::max(first.uncertainty, second.uncertainty) };
}

// The point `length` beyond `second`, on the line from `first`.
BodyPoint beyond(const BodyPoint& first, const BodyPoint& second, float length)
{
  return { second.position + length * (second.position - first.position).normalized(), second.uncertainty };
}

BodyPoint head(const Points& points, float scale)
{
  for (const auto& [right, left] : { std::pair{ RIGHT_EAR, LEFT_EAR }, std::pair{ RIGHT_EYE, LEFT_EYE } })
  {
    const BodyPoint both = middle(points[right], points[left]);
    if (both.known())
      return both;
  }
  for (const Joint joint : { RIGHT_EAR, LEFT_EAR, NOSE, RIGHT_EYE, LEFT_EYE })
    if (points[joint].known())
      return points[joint];
  return beyond(points[MID_HIP], points[NECK], scale * NECK_TO_HEAD);
}

}  // namespace

Body shapeBody(const Skeleton& skeleton, float looseness)
{
  Points points;
  Body body;
  std::copy(skeleton.begin(), skeleton.end(), points.begin());
  for (const BodyPoint& joint : skeleton)
    if (joint.known() && joint.uncertainty == 0.0f)
      body.joints.push_back(joint.position);
  const float scale = bodyScale(points);
  points[MID_HIP] = middle(points[RIGHT_HIP], points[LEFT_HIP]);
  points[HEAD] = head(points, scale);
  points[RIGHT_HAND] = beyond(points[RIGHT_ELBOW], points[RIGHT_WRIST], scale * HAND);
  points[LEFT_HAND] = beyond(points[LEFT_ELBOW], points[LEFT_WRIST], scale * HAND);
  for (const BoneShape& shape : SHAPES)
  {
    const BodyPoint &start = points[shape.start], &end = points[shape.end];
    if (!start.known() || !end.known())
      continue;
    const float core = scale * shape.core, margin = scale * looseness * shape.margin;
    Bone bone{ start.position, end.position, core, margin, DOUBT * start.uncertainty, DOUBT * end.uncertainty, {} };
    for (const BodyPoint* point : { &start, &end })
      for (const float reach : { -core - margin, core + margin })
        bone.box.extend((point->position.array() + reach).matrix());
    body.box.extend(bone.box);
    body.bones.push_back(bone);
  }
  return body;
}

}  // namespace openpose_ros_nodelets
