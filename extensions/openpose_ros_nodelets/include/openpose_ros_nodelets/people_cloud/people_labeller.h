#pragma once

#include <cstdint>
#include <vector>

#include "openpose_ros_nodelets/common/organized_cloud.h"
#include "openpose_ros_nodelets/people_cloud/body_shape.h"
#include "openpose_ros_nodelets/people_cloud/support_planes.h"

namespace openpose_ros_nodelets
{

struct LabelSettings
{
  float looseness = 1.0f;        ///< factor of the width of clothes and hair around a body
  float cluster_step = 0.02f;    ///< neighbours in the image this near are of one surface [m per m from the origin]
  float floor_margin = 0.025f;   ///< points this near to what people stand, sit or lie on are of the scene [m]
};

/// Tells which points of a cloud are of which person. Keeps memory from cloud to cloud, but nothing else.
///
/// A point may be of a person when it lies within reach of a bone, and not on the floor; it is the nearest person's.
/// Of these points, those are taken whose surface, followed from neighbour to neighbour in the image, comes as near to
/// a bone as skin does.
class PeopleLabeller
{
public:
  explicit PeopleLabeller(const LabelSettings& settings);

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
  std::vector<std::uint32_t> candidates_;   ///< indices of the taken points
  std::vector<float> scores_;               ///< of the taken points: below 0 in a core, up to 1 within reach
  std::vector<std::uint32_t> parents_;      ///< of the taken points: a forest, one tree for each surface
  std::vector<Count> counts_;               ///< of the surfaces, at the roots
};

}  // namespace openpose_ros_nodelets
