#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "openpose_ros_nodelets/people_cloud/body_shape.h"

namespace openpose_ros_nodelets
{

using Planes = std::vector<Eigen::Hyperplane<float, 3>>;

/// Find the surfaces that a person stands, sits or lies on or leans against: planes of the scene near a measured joint
/// with all measured joints on one side.
///
/// `scene`: points around the person that are not of the person [m]. `known`: planes of the people before, taken where
/// they fit; new ones are added. `thickness`: half of that of a plane [m].
Planes findSupports(const Body& body, const std::vector<Eigen::Vector3f>& scene, float thickness, Planes& known);

}  // namespace openpose_ros_nodelets
