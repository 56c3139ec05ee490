#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

namespace openpose_ros_nodelets
{

/// Joints in the order of COCO_18_JOINTS in openpose_ros_msgs/joints.h.
enum Joint : std::size_t
{
  NOSE, NECK, RIGHT_SHOULDER, RIGHT_ELBOW, RIGHT_WRIST, LEFT_SHOULDER, LEFT_ELBOW, LEFT_WRIST, RIGHT_HIP, RIGHT_KNEE,
  RIGHT_ANKLE, LEFT_HIP, LEFT_KNEE, LEFT_ANKLE, RIGHT_EYE, LEFT_EYE, RIGHT_EAR, LEFT_EAR, JOINTS
};

/// What is known of a person in a frame.
struct Skeleton
{
  Skeleton();

  std::array<Eigen::Vector3f, JOINTS> position;  ///< [m] in the frame of the cloud; NaN: missing
  std::array<float, JOINTS> uncertainty;         ///< [m] standard deviation of an inferred joint, 0: measured
};

/// A part of a body: what lies within `core` of the line between two joints is of this person, and what lies within
/// `core` + `margin` may be.
struct Bone
{
  Eigen::Vector3f start, end;           ///< [m]
  float core, margin;                   ///< [m]
  float start_penalty, end_penalty;     ///< added to the distance, as the joints are uncertain [m]
  Eigen::AlignedBox3f box;              ///< of what is within reach
};

/// The parts of one person.
struct Body
{
  std::vector<Bone> bones;              ///< empty where too few joints are known
  std::vector<Eigen::Vector3f> joints;  ///< that were measured [m]
  Eigen::AlignedBox3f box;              ///< of all that is within reach [m]
};

/// Put the parts of an adult around a skeleton, scaled with the length of its bones. The margins are multiplied by
/// `looseness`, for wide clothes.
Body shapeBody(const Skeleton& skeleton, float looseness);

}  // namespace openpose_ros_nodelets
