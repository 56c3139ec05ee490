#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "cloud_message.h"

namespace openpose_ros_nodelets
{

/// Joints in the order of COCO_18_JOINTS in openpose_ros_msgs/joints.h.
enum Joint : std::size_t
{
  NOSE, NECK, RIGHT_SHOULDER, RIGHT_ELBOW, RIGHT_WRIST, LEFT_SHOULDER, LEFT_ELBOW, LEFT_WRIST, RIGHT_HIP, RIGHT_KNEE,
  RIGHT_ANKLE, LEFT_HIP, LEFT_KNEE, LEFT_ANKLE, RIGHT_EYE, LEFT_EYE, RIGHT_EAR, LEFT_EAR, JOINTS
};

/// What is known of a point of a body in a frame.
struct BodyPoint
{
  /// [m] in the frame of the cloud; NaN: missing
  Eigen::Vector3f position = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  float uncertainty = 0.0f;  ///< [m] standard deviation of an inferred joint, 0: measured

  bool known() const
  {
    return position.allFinite();
  }
};

using Skeleton = std::array<BodyPoint, JOINTS>;

/// A part of a body: what lies within `core` of the line between two joints is of this person, and what lies within
/// `core` + `margin` may be.
struct Bone
{
  Eigen::Vector3f start, end;        ///< [m]
  float core, margin;                ///< [m]
  float start_penalty, end_penalty;  ///< added to the distance, as the joints are uncertain [m]
  Eigen::AlignedBox3f box;           ///< of what is within reach
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

using Planes = std::vector<Eigen::Hyperplane<float, 3>>;

/// Find the surfaces that a person stands, sits or lies on or leans against: planes of the scene near a measured joint
/// with all measured joints on one side.
///
/// `scene`: points around the person that are not of the person [m]. `known`: planes of the people before, taken where
/// they fit; new ones are added. `thickness`: half of that of a plane [m].
Planes findSupports(const Body& body, const std::vector<Eigen::Vector3f>& scene, float thickness, Planes& known);

struct LabelSettings
{
  float looseness = 1.0f;       ///< factor of the width of clothes and hair around a body
  float cluster_step = 0.02f;   ///< neighbours in the image this near are of one surface [m per m from the origin]
  float floor_margin = 0.025f;  ///< points this near to what people stand, sit or lie on are of the scene [m]
};

/// Tells which points of a cloud are of which person. Keeps memory from cloud to cloud, but nothing else.
///
/// A point may be of a person when it lies within reach of a bone, and not on the floor; it is the nearest person's.
/// Of these points, those are taken whose surface, followed from neighbour to neighbour in the image, comes as near to
/// a bone as skin does.
class PeopleLabeller
{
public:
  explicit PeopleLabeller(const LabelSettings& settings) : settings_(settings)
  {
  }

  /// Return a label for each point, row by row: 0 for the scene, 1 for the first person and so on. Valid until the
  /// next call.
  const std::vector<std::uint32_t>& label(const OrganizedCloud& cloud, const std::vector<Skeleton>& people);

private:
  struct Crop;
  struct Count
  {
    std::uint32_t points = 0, cores = 0;
  };

  std::vector<Crop> crop(const OrganizedCloud& cloud, const std::vector<Body>& bodies) const;
  /// Take the points within reach of a body that are nearest to it, without those of its supports.
  void choose(const OrganizedCloud& cloud, std::uint32_t label, const Body& body, const Crop& crop,
              const Planes& supports);
  /// Join the taken points of a person that are of one surface.
  void connect(const OrganizedCloud& cloud);
  /// Give back what no core touches.
  void dropFar();
  /// Take the points at the edges of people that are of no surface.
  void takeEdges(const OrganizedCloud& cloud);
  std::uint32_t root(std::uint32_t index);

  LabelSettings settings_;
  std::vector<std::uint32_t> labels_;
  std::vector<std::uint32_t> candidates_;  ///< indices of the taken points
  std::vector<float> scores_;              ///< of the taken points: below 0 in a core, up to 1 within reach
  std::vector<std::uint32_t> parents_;     ///< of the taken points: a forest, one tree for each surface
  std::vector<Count> counts_;              ///< of the surfaces, at the roots
};

}  // namespace openpose_ros_nodelets
