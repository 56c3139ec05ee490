#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace openpose_ros_nodelets
{

using Points = pcl::PointCloud<pcl::PointXYZ>;

/// What counts as a floor.
struct FloorSettings
{
  double least_height = 0.2;  ///< of the camera above the floor [m]
  double most_height = 3.0;   ///< [m]
  double range = 8.0;         ///< points further from the camera are not used [m]
  double thickness = 0.025;   ///< points within this distance of the plane are the floor's [m]
  double least_area = 0.4;    ///< of the floor that is seen [m^2]
  double most_below = 0.03;   ///< greatest share of points below the floor, in points of the floor and below it
  double most_tilt_sigma = 0.007;  ///< greatest standard deviation of the normal's direction [rad]: 0.4 deg
};

/// A plane n x + d = 0 with |n| = 1, n up: d is the height of the camera above it.
struct Floor
{
  Eigen::Vector3f normal;
  float height;         ///< d [m]
  float share;          ///< of the points, that lie on the floor
  float area;           ///< that is seen [m^2], at most: one cell of the grid for each of its points
  float height_sigma;   ///< standard deviation of the height by the points' spread about the plane [m]
  float tilt_sigma;     ///< and of the direction of the normal [rad]
};

/// A floor, or why there is none.
struct FloorSearch
{
  std::optional<Floor> floor;
  std::string fault;  ///< empty if there is one; else one of a few fixed texts, as each is counted
};

/// Find the floor in points of one view: the largest plane across `up` which (nearly) nothing lies below.
///
/// `points`: in an optical frame or another one whose origin is the camera; finite [m]. `up`: about opposite to
/// gravity, unit length. `tolerance`: greatest angle between `up` and the normal [rad].
FloorSearch findFloor(const Points::ConstPtr& points, const Eigen::Vector3f& up, double tolerance,
                      const FloorSettings& settings);

/// Return the greater of the angle between two normals [rad].
float angleBetween(const Eigen::Vector3f& normal, const Eigen::Vector3f& other);

}  // namespace openpose_ros_nodelets
