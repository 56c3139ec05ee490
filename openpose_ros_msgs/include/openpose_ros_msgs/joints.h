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

/** A body part of PersonDetection, PersonDetection_3d and PersonVelocity_3d, in their order. */
enum class Joint
{
  NOSE, NECK, RIGHT_SHOULDER, RIGHT_ELBOW, RIGHT_WRIST, LEFT_SHOULDER, LEFT_ELBOW, LEFT_WRIST, RIGHT_HIP, RIGHT_KNEE,
  RIGHT_ANKLE, LEFT_HIP, LEFT_KNEE, LEFT_ANKLE, RIGHT_EYE, LEFT_EYE, RIGHT_EAR, LEFT_EAR, CHEST, MID_HIP,
  LEFT_BIG_TOE, LEFT_SMALL_TOE, LEFT_HEEL, RIGHT_BIG_TOE, RIGHT_SMALL_TOE, RIGHT_HEEL, HEAD_TOP
};

constexpr Joint ALL_JOINTS[] = {
  Joint::NOSE, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE, Joint::LEFT_HIP,
  Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_EYE, Joint::LEFT_EYE, Joint::RIGHT_EAR, Joint::LEFT_EAR,
  Joint::CHEST, Joint::MID_HIP, Joint::LEFT_BIG_TOE, Joint::LEFT_SMALL_TOE, Joint::LEFT_HEEL, Joint::RIGHT_BIG_TOE,
  Joint::RIGHT_SMALL_TOE, Joint::RIGHT_HEEL, Joint::HEAD_TOP
};

/** Return the name of the message's field. */
inline const char* nameOf(Joint joint)
{
  static constexpr const char* NAMES[] = {
    "nose", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow", "left_wrist",
    "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "right_eye", "left_eye",
    "right_ear", "left_ear", "chest", "mid_hip", "left_big_toe", "left_small_toe", "left_heel", "right_big_toe",
    "right_small_toe", "right_heel", "head_top"
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
      &Person::nose, &Person::neck, &Person::right_shoulder, &Person::right_elbow, &Person::right_wrist,
      &Person::left_shoulder, &Person::left_elbow, &Person::left_wrist, &Person::right_hip, &Person::right_knee,
      &Person::right_ankle, &Person::left_hip, &Person::left_knee, &Person::left_ankle, &Person::right_eye,
      &Person::left_eye, &Person::right_ear, &Person::left_ear, &Person::chest, &Person::mid_hip,
      &Person::left_big_toe, &Person::left_small_toe, &Person::left_heel, &Person::right_big_toe,
      &Person::right_small_toe, &Person::right_heel, &Person::head_top
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

constexpr Joint COCO_18_JOINTS[] = {
  Joint::NOSE, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE, Joint::LEFT_HIP,
  Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_EYE, Joint::LEFT_EYE, Joint::RIGHT_EAR, Joint::LEFT_EAR
};
constexpr Limb COCO_18_LIMBS[] = {
  { Joint::NECK, Joint::RIGHT_SHOULDER }, { Joint::NECK, Joint::LEFT_SHOULDER },
  { Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST },
  { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, { Joint::LEFT_ELBOW, Joint::LEFT_WRIST },
  { Joint::NECK, Joint::RIGHT_HIP }, { Joint::RIGHT_HIP, Joint::RIGHT_KNEE },
  { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE }, { Joint::NECK, Joint::LEFT_HIP }, { Joint::LEFT_HIP, Joint::LEFT_KNEE },
  { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }, { Joint::NECK, Joint::NOSE }, { Joint::NOSE, Joint::RIGHT_EYE },
  { Joint::RIGHT_EYE, Joint::RIGHT_EAR }, { Joint::NOSE, Joint::LEFT_EYE }, { Joint::LEFT_EYE, Joint::LEFT_EAR }
};

constexpr Joint BODY_25_JOINTS[] = {
  Joint::NOSE, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::MID_HIP, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE,
  Joint::LEFT_HIP, Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_EYE, Joint::LEFT_EYE, Joint::RIGHT_EAR,
  Joint::LEFT_EAR, Joint::LEFT_BIG_TOE, Joint::LEFT_SMALL_TOE, Joint::LEFT_HEEL, Joint::RIGHT_BIG_TOE,
  Joint::RIGHT_SMALL_TOE, Joint::RIGHT_HEEL
};
constexpr Limb BODY_25_LIMBS[] = {
  { Joint::NECK, Joint::MID_HIP }, { Joint::NECK, Joint::RIGHT_SHOULDER }, { Joint::NECK, Joint::LEFT_SHOULDER },
  { Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST },
  { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, { Joint::LEFT_ELBOW, Joint::LEFT_WRIST },
  { Joint::MID_HIP, Joint::RIGHT_HIP }, { Joint::RIGHT_HIP, Joint::RIGHT_KNEE },
  { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE }, { Joint::MID_HIP, Joint::LEFT_HIP },
  { Joint::LEFT_HIP, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }, { Joint::NECK, Joint::NOSE },
  { Joint::NOSE, Joint::RIGHT_EYE }, { Joint::RIGHT_EYE, Joint::RIGHT_EAR }, { Joint::NOSE, Joint::LEFT_EYE },
  { Joint::LEFT_EYE, Joint::LEFT_EAR }, { Joint::LEFT_ANKLE, Joint::LEFT_BIG_TOE },
  { Joint::LEFT_BIG_TOE, Joint::LEFT_SMALL_TOE }, { Joint::LEFT_ANKLE, Joint::LEFT_HEEL },
  { Joint::RIGHT_ANKLE, Joint::RIGHT_BIG_TOE }, { Joint::RIGHT_BIG_TOE, Joint::RIGHT_SMALL_TOE },
  { Joint::RIGHT_ANKLE, Joint::RIGHT_HEEL }
};

constexpr Joint MPI_15_JOINTS[] = {
  Joint::HEAD_TOP, Joint::NECK, Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST, Joint::LEFT_SHOULDER,
  Joint::LEFT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_HIP, Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE, Joint::LEFT_HIP,
  Joint::LEFT_KNEE, Joint::LEFT_ANKLE, Joint::CHEST
};
constexpr Limb MPI_15_LIMBS[] = {
  { Joint::HEAD_TOP, Joint::NECK }, { Joint::NECK, Joint::RIGHT_SHOULDER },
  { Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST },
  { Joint::NECK, Joint::LEFT_SHOULDER }, { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW },
  { Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::NECK, Joint::CHEST }, { Joint::CHEST, Joint::RIGHT_HIP },
  { Joint::RIGHT_HIP, Joint::RIGHT_KNEE }, { Joint::RIGHT_KNEE, Joint::RIGHT_ANKLE },
  { Joint::CHEST, Joint::LEFT_HIP }, { Joint::LEFT_HIP, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_ANKLE }
};

constexpr Joint COCO_17_JOINTS[] = {
  Joint::NOSE, Joint::LEFT_EYE, Joint::RIGHT_EYE, Joint::LEFT_EAR, Joint::RIGHT_EAR, Joint::LEFT_SHOULDER,
  Joint::RIGHT_SHOULDER, Joint::LEFT_ELBOW, Joint::RIGHT_ELBOW, Joint::LEFT_WRIST, Joint::RIGHT_WRIST,
  Joint::LEFT_HIP, Joint::RIGHT_HIP, Joint::LEFT_KNEE, Joint::RIGHT_KNEE, Joint::LEFT_ANKLE, Joint::RIGHT_ANKLE
};
constexpr Limb COCO_17_LIMBS[] = {
  { Joint::LEFT_ANKLE, Joint::LEFT_KNEE }, { Joint::LEFT_KNEE, Joint::LEFT_HIP },
  { Joint::RIGHT_ANKLE, Joint::RIGHT_KNEE }, { Joint::RIGHT_KNEE, Joint::RIGHT_HIP },
  { Joint::LEFT_HIP, Joint::RIGHT_HIP }, { Joint::LEFT_SHOULDER, Joint::LEFT_HIP },
  { Joint::RIGHT_SHOULDER, Joint::RIGHT_HIP }, { Joint::LEFT_SHOULDER, Joint::RIGHT_SHOULDER },
  { Joint::LEFT_SHOULDER, Joint::LEFT_ELBOW }, { Joint::RIGHT_SHOULDER, Joint::RIGHT_ELBOW },
  { Joint::LEFT_ELBOW, Joint::LEFT_WRIST }, { Joint::RIGHT_ELBOW, Joint::RIGHT_WRIST },
  { Joint::LEFT_EYE, Joint::RIGHT_EYE }, { Joint::NOSE, Joint::LEFT_EYE }, { Joint::NOSE, Joint::RIGHT_EYE },
  { Joint::LEFT_EYE, Joint::LEFT_EAR }, { Joint::RIGHT_EYE, Joint::RIGHT_EAR },
  { Joint::LEFT_EAR, Joint::LEFT_SHOULDER }, { Joint::RIGHT_EAR, Joint::RIGHT_SHOULDER }
};

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
  if (pose_model == "COCO_18")
    return detail::skeleton(COCO_18_JOINTS, COCO_18_LIMBS);
  if (pose_model == "BODY_25")
    return detail::skeleton(BODY_25_JOINTS, BODY_25_LIMBS);
  if (pose_model == "MPI_15")
    return detail::skeleton(MPI_15_JOINTS, MPI_15_LIMBS);
  if (pose_model == "COCO_17")
    return detail::skeleton(COCO_17_JOINTS, COCO_17_LIMBS);
  return Skeleton();
}

}  // namespace openpose_ros_msgs
