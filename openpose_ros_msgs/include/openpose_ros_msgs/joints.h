/**
 * Joints and limbs of the people in the messages of this package. Header-only, C++11.
 *
 *   for (openpose_ros_msgs::Joint joint : openpose_ros_msgs::ALL_JOINTS)
 *   {
 *     const auto& part = openpose_ros_msgs::partOf(person, joint);
 *     if (openpose_ros_msgs::isKnown(part))
 *       std::cout << openpose_ros_msgs::nameOf(joint) << " at " << part.x << ", " << part.y << std::endl;
 *   }
 *
 * Left and right are the person's own.
 */
#pragma once

#include <cstddef>
#include <string>

#include <openpose_ros_msgs/BodypartDetection.h>
#include <openpose_ros_msgs/BodypartDetection_3d.h>

namespace openpose_ros_msgs
{

// X(ENUMERATOR, field) for each body part of PersonDetection, PersonDetection_3d and PersonVelocity_3d, in their order
// generated: joints
#define OPENPOSE_ROS_MSGS_JOINTS(X) \
  X(NOSE, nose) X(NECK, neck) X(RIGHT_SHOULDER, right_shoulder) X(RIGHT_ELBOW, right_elbow) \
  X(RIGHT_WRIST, right_wrist) X(LEFT_SHOULDER, left_shoulder) X(LEFT_ELBOW, left_elbow) \
  X(LEFT_WRIST, left_wrist) X(RIGHT_HIP, right_hip) X(RIGHT_KNEE, right_knee) X(RIGHT_ANKLE, right_ankle) \
  X(LEFT_HIP, left_hip) X(LEFT_KNEE, left_knee) X(LEFT_ANKLE, left_ankle) X(RIGHT_EYE, right_eye) \
  X(LEFT_EYE, left_eye) X(RIGHT_EAR, right_ear) X(LEFT_EAR, left_ear) X(CHEST, chest) X(MID_HIP, mid_hip) \
  X(LEFT_BIG_TOE, left_big_toe) X(LEFT_SMALL_TOE, left_small_toe) X(LEFT_HEEL, left_heel) \
  X(RIGHT_BIG_TOE, right_big_toe) X(RIGHT_SMALL_TOE, right_small_toe) X(RIGHT_HEEL, right_heel) \
  X(HEAD_TOP, head_top)
// end of generated

/** A body part of PersonDetection, PersonDetection_3d and PersonVelocity_3d, in their order. */
enum class Joint
{
#define OPENPOSE_ROS_MSGS_ENUMERATOR(enumerator, field) enumerator,
  OPENPOSE_ROS_MSGS_JOINTS(OPENPOSE_ROS_MSGS_ENUMERATOR)
#undef OPENPOSE_ROS_MSGS_ENUMERATOR
};

constexpr Joint ALL_JOINTS[] = {
#define OPENPOSE_ROS_MSGS_JOINT(enumerator, field) Joint::enumerator,
  OPENPOSE_ROS_MSGS_JOINTS(OPENPOSE_ROS_MSGS_JOINT)
#undef OPENPOSE_ROS_MSGS_JOINT
};

/** Return the name of the message's field. */
inline const char* nameOf(Joint joint)
{
  static constexpr const char* NAMES[] = {
#define OPENPOSE_ROS_MSGS_NAME(enumerator, field) #field,
    OPENPOSE_ROS_MSGS_JOINTS(OPENPOSE_ROS_MSGS_NAME)
#undef OPENPOSE_ROS_MSGS_NAME
  };
  return NAMES[static_cast<std::size_t>(joint)];
}

namespace detail
{

template <typename Person>
struct Body
{
  using Part = decltype(Person::nose);

  static Part Person::*member(Joint joint)
  {
    static constexpr Part Person::*MEMBERS[] = {
#define OPENPOSE_ROS_MSGS_MEMBER(enumerator, field) &Person::field,
      OPENPOSE_ROS_MSGS_JOINTS(OPENPOSE_ROS_MSGS_MEMBER)
#undef OPENPOSE_ROS_MSGS_MEMBER
    };
    return MEMBERS[static_cast<std::size_t>(joint)];
  }
};

}  // namespace detail

/** Return a body part of a person: in the image, in space, or its velocity. */
template <typename Person>
const typename detail::Body<Person>::Part& partOf(const Person& person, Joint joint)
{
  return person.*detail::Body<Person>::member(joint);
}
template <typename Person>
typename detail::Body<Person>::Part& partOf(Person& person, Joint joint)
{
  return person.*detail::Body<Person>::member(joint);
}

/** Tell whether a part was detected in the image. */
inline bool isKnown(const BodypartDetection& part)
{
  return part.confidence > 0.0f;
}

/** Tell whether the position of a part is known, be it measured or inferred. */
inline bool isKnown(const BodypartDetection_3d& part)
{
  return part.status != BodypartDetection_3d::MISSING;
}

/** Return "missing", "measured" or "inferred". */
inline const char* statusOf(const BodypartDetection_3d& part)
{
  return part.status == BodypartDetection_3d::MEASURED ? "measured" :
         part.status == BodypartDetection_3d::INFERRED ? "inferred" :
                                                         "missing";
}

/** Two joints and the line between them. */
struct Limb
{
  Joint start, end;
};

// generated: skeletons
constexpr Joint COCO_18_JOINTS[] = {
  Joint::NOSE, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE, Joint::LEFT_HIP,
  Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_EYE, Joint::LEFT_EYE, Joint::RIGHT_EAR, Joint::LEFT_EAR
};
constexpr Limb COCO_18_LIMBS[] = {
  { Joint::NECK, Joint::RIGHT_SHOULDER }, { Joint::NECK, Joint::LEFT_SHOULDER }, { Joint::RIGHT_SHOULDER,
  Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST }, { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, {
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::NECK, Joint::RIGHT_HIP }, { Joint::RIGHT_HIP, Joint::RIGHT_KNEE },
  { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE }, { Joint::NECK, Joint::LEFT_HIP }, { Joint::LEFT_HIP, Joint::LEFT_KNEE },
  { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }, { Joint::NECK, Joint::NOSE }, { Joint::NOSE, Joint::RIGHT_EYE }, {
  Joint::RIGHT_EYE, Joint::RIGHT_EAR }, { Joint::NOSE, Joint::LEFT_EYE }, { Joint::LEFT_EYE, Joint::LEFT_EAR }
};
constexpr Joint BODY_25_JOINTS[] = {
  Joint::NOSE, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::MID_HIP, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE,
  Joint::LEFT_HIP, Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_EYE, Joint::LEFT_EYE, Joint::RIGHT_EAR,
  Joint::LEFT_EAR, Joint::LEFT_BIG_TOE, Joint::LEFT_SMALL_TOE, Joint::LEFT_HEEL, Joint::RIGHT_BIG_TOE,
  Joint::RIGHT_SMALL_TOE, Joint::RIGHT_HEEL
};
constexpr Limb BODY_25_LIMBS[] = {
  { Joint::NECK, Joint::MID_HIP }, { Joint::NECK, Joint::RIGHT_SHOULDER }, { Joint::NECK, Joint::LEFT_SHOULDER }, {
  Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST }, { Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW }, { Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::MID_HIP, Joint::RIGHT_HIP }, {
  Joint::RIGHT_HIP, Joint::RIGHT_KNEE }, { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE }, { Joint::MID_HIP, Joint::LEFT_HIP
  }, { Joint::LEFT_HIP, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }, { Joint::NECK, Joint::NOSE }, {
  Joint::NOSE, Joint::RIGHT_EYE }, { Joint::RIGHT_EYE, Joint::RIGHT_EAR }, { Joint::NOSE, Joint::LEFT_EYE }, {
  Joint::LEFT_EYE, Joint::LEFT_EAR }, { Joint::LEFT_ANKLE, Joint::LEFT_BIG_TOE }, { Joint::LEFT_BIG_TOE,
  Joint::LEFT_SMALL_TOE }, { Joint::LEFT_ANKLE, Joint::LEFT_HEEL }, { Joint::RIGHT_ANKLE, Joint::RIGHT_BIG_TOE }, {
  Joint::RIGHT_BIG_TOE, Joint::RIGHT_SMALL_TOE }, { Joint::RIGHT_ANKLE, Joint::RIGHT_HEEL }
};
constexpr Joint MPI_15_JOINTS[] = {
  Joint::HEAD_TOP, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE, Joint::LEFT_HIP,
  Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::CHEST
};
constexpr Limb MPI_15_LIMBS[] = {
  { Joint::HEAD_TOP, Joint::NECK }, { Joint::NECK, Joint::RIGHT_SHOULDER }, { Joint::RIGHT_SHOULDER,
  Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST }, { Joint::NECK, Joint::LEFT_SHOULDER }, {
  Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, { Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::NECK, Joint::CHEST },
  { Joint::CHEST, Joint::RIGHT_HIP }, { Joint::RIGHT_HIP, Joint::RIGHT_KNEE }, { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE
  }, { Joint::CHEST, Joint::LEFT_HIP }, { Joint::LEFT_HIP, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }
};
constexpr Joint COCO_17_JOINTS[] = {
  Joint::NOSE, Joint::LEFT_EYE, Joint::RIGHT_EYE, Joint::LEFT_EAR, Joint::RIGHT_EAR, Joint::LEFT_SHOULDER,
  Joint::RIGHT_SHOULDER, Joint::LEFT_ELBOW, Joint::RIGHT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_WRIST,
  Joint::LEFT_HIP, Joint::RIGHT_HIP, Joint::LEFT_KNEE, Joint::RIGHT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_ANKLE
};
constexpr Limb COCO_17_LIMBS[] = {
  { Joint::LEFT_ANKLE, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_HIP }, { Joint::RIGHT_ANKLE,
  Joint::RIGHT_KNEE }, { Joint::RIGHT_KNEE, Joint::RIGHT_HIP }, { Joint::LEFT_HIP, Joint::RIGHT_HIP }, {
  Joint::LEFT_SHOULDER, Joint::LEFT_HIP }, { Joint::RIGHT_SHOULDER, Joint::RIGHT_HIP }, { Joint::LEFT_SHOULDER,
  Joint::RIGHT_SHOULDER }, { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, { Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW },
  { Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST }, { Joint::LEFT_EYE,
  Joint::RIGHT_EYE }, { Joint::NOSE, Joint::LEFT_EYE }, { Joint::NOSE, Joint::RIGHT_EYE }, { Joint::LEFT_EYE,
  Joint::LEFT_EAR }, { Joint::RIGHT_EYE, Joint::RIGHT_EAR }, { Joint::LEFT_EAR, Joint::LEFT_SHOULDER }, {
  Joint::RIGHT_EAR, Joint::RIGHT_SHOULDER }
};
#define OPENPOSE_ROS_MSGS_SKELETONS(X) \
  X(COCO_18) X(BODY_25) X(MPI_15) X(COCO_17)
// end of generated

/** Elements that lie one after another, for range-based for. */
template <typename T>
struct Range
{
  const T *first, *last;

  const T* begin() const
  {
    return first;
  }
  const T* end() const
  {
    return last;
  }
  std::size_t size() const
  {
    return last - first;
  }
};

/** The joints that a network knows, and the limbs that are drawn. */
struct Skeleton
{
  Range<Joint> joints;
  Range<Limb> limbs;
};

namespace detail
{

template <std::size_t J, std::size_t L>
Skeleton skeleton(const Joint (&joints)[J], const Limb (&limbs)[L])
{
  return { { joints, joints + J }, { limbs, limbs + L } };
}

}  // namespace detail

/** Return the skeleton of a `pose_model` of the array messages; one without joints where the name is not known. */
inline Skeleton skeletonOf(const std::string& pose_model)
{
#define OPENPOSE_ROS_MSGS_SKELETON(name)                         \
  if (pose_model == #name)                                       \
    return detail::skeleton(name##_JOINTS, name##_LIMBS);
  OPENPOSE_ROS_MSGS_SKELETONS(OPENPOSE_ROS_MSGS_SKELETON)
#undef OPENPOSE_ROS_MSGS_SKELETON
  return Skeleton();
}

#undef OPENPOSE_ROS_MSGS_JOINTS
#undef OPENPOSE_ROS_MSGS_SKELETONS

}  // namespace openpose_ros_msgs
