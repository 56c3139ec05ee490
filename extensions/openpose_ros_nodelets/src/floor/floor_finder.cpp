#include "openpose_ros_nodelets/floor/floor_finder.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <pcl/filters/voxel_grid.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

namespace openpose_ros_nodelets
{
namespace
{

// Points are thinned to one in each cube of this size, so that near surfaces do not outvote far ones [m].
constexpr float CELL = 0.06F;
// RANSAC ends when it is this likely that a better plane was met, or after this many samples.
constexpr double PROBABILITY = 0.999;
constexpr int MOST_SAMPLES = 1500;
// A point below a plane counts against it as this many on it count for it.
constexpr float WEIGHT_BELOW = 5.0F;
// Points are below a plane from this many times its thickness on, further away by noise: a share of the distance.
constexpr float BELOW = 2.5F, BELOW_PER_METRE = 0.01F;
// The plane is fitted this many times to the points that are on it.
constexpr int FITS = 3;
// The errors of points within this area are alike: uneven floors and lenses, skirtings, carpets [m^2].
constexpr double ALIKE = 0.25;

using Plane = Eigen::Vector4f;
using PerpendicularPlane = pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>;

struct Counts
{
  std::size_t on = 0, below = 0;
};

/// Planes across `up` with the camera above them; the best has the most points on it and the fewest below it.
class FloorModel : public PerpendicularPlane
{
public:
  FloorModel(const Points::ConstPtr& points, const Eigen::Vector3f& up, double tolerance, const FloorSettings& settings)
    : PerpendicularPlane(points), up_(up), settings_(settings)
  {
    setAxis(up);
    setEpsAngle(tolerance);
    margins_.reserve(points->size());
    for (const pcl::PointXYZ& point : *points)
      margins_.push_back(BELOW * settings.thickness + BELOW_PER_METRE * point.getVector3fMap().norm());
  }

  /// Return a plane with its normal up.
  Plane upwards(const Eigen::VectorXf& plane) const
  {
    return plane.head<3>().dot(up_) < 0 ? Plane(-plane) : Plane(plane);
  }

  Counts counts(const Plane& plane) const
  {
    Counts counts;
    const float a = plane[0], b = plane[1], c = plane[2], d = plane[3], thickness = settings_.thickness;
    const auto& points = input_->points;
    for (std::size_t index = 0; index < points.size(); ++index)
    {
      const float height = a * points[index].x + b * points[index].y + c * points[index].z + d;
      counts.on += std::abs(height) <= thickness;
      counts.below += height < -margins_[index];
    }
    return counts;
  }

  bool allows(const Plane& plane) const
  {
    return isModelValid(plane) && plane[3] >= settings_.least_height && plane[3] <= settings_.most_height;
  }

  /// Return by how many points a plane is a floor, at least 1 as PCL complains of samples that are 0; RANSAC seeks the
  /// greatest.
  std::size_t countWithinDistance(const Eigen::VectorXf& coefficients, const double) const override
  {
    const Plane plane = upwards(coefficients);
    if (!allows(plane))
      return 1;
    const Counts counted = counts(plane);
    return std::max(1.0F, counted.on - WEIGHT_BELOW * counted.below);
  }

private:
  Eigen::Vector3f up_;
  FloorSettings settings_;
  std::vector<float> margins_;
};

/// Return one point for each cell, of those within the range.
Points::Ptr thinned(const Points::ConstPtr& points, double range)
{
  Points::Ptr near(new Points), cells(new Points);
  near->reserve(points->size());
  for (const pcl::PointXYZ& point : *points)
    if (point.getVector3fMap().squaredNorm() <= range * range)
      near->push_back(point);
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(near);
  grid.setLeafSize(CELL, CELL, CELL);
  grid.filter(*cells);
  return cells;
}

/// Return a floor of a plane and the points on it, with its errors.
///
/// A plane z = q x + r y + s in axes of the floor below the camera has the covariance sigma^2 (A^T A)^-1, where the
/// rows of A are (x, y, 1) of points with independent errors.
Floor described(const Plane& plane, const Points& points, const std::vector<int>& inliers)
{
  const Eigen::Vector3f normal = plane.head<3>();
  const Eigen::Vector3f along = normal.unitOrthogonal(), across = normal.cross(along);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const auto index : inliers)
  {
    const Eigen::Vector3f point = points[index].getVector3fMap();
    const Eigen::Vector3d row(point.dot(along), point.dot(across), 1);
    information += row * row.transpose();
    squares += std::pow(point.dot(normal) + plane[3], 2);
  }
  const double number = inliers.size(), area = number * CELL * CELL;
  const double independent = std::max(area / ALIKE, 1.0);
  const Eigen::Matrix3d covariance = squares / independent * information.inverse();
  return { normal,
           plane[3],
           static_cast<float>(number / points.size()),
           static_cast<float>(area),
           static_cast<float>(std::sqrt(covariance(2, 2))),
           static_cast<float>(std::sqrt(covariance.topLeftCorner<2, 2>().trace())) };
}

/// Return why a plane is no floor; empty: it is one.
std::string fault(const Plane& plane, const FloorModel& model, const FloorSettings& settings)
{
  const Counts counted = model.counts(plane);
  if (!model.allows(plane) || counted.on * CELL * CELL < settings.least_area)
    return "no plane is large enough";
  if (counted.below > settings.most_below * (counted.on + counted.below))
    return "points lie below the largest plane";
  return "";
}

}  // namespace

float angleBetween(const Eigen::Vector3f& normal, const Eigen::Vector3f& other)
{
  return std::atan2(normal.cross(other).norm(), normal.dot(other));
}

FloorSearch findFloor(const Points::ConstPtr& points, const Eigen::Vector3f& up, double tolerance,
                      const FloorSettings& settings)
{
  const Points::Ptr cells = thinned(points, settings.range);
  if (cells->size() * CELL * CELL < settings.least_area)
    return { std::nullopt, "too few points" };
  FloorModel* const model = new FloorModel(cells, up, tolerance, settings);
  const pcl::SampleConsensusModel<pcl::PointXYZ>::Ptr owner(model);
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(owner, settings.thickness);
  ransac.setMaxIterations(MOST_SAMPLES);
  ransac.setProbability(PROBABILITY);
  Eigen::VectorXf best;
  if (ransac.computeModel())
    ransac.getModelCoefficients(best);
  std::vector<int> inliers;
  for (int fit = 0; fit < FITS && best.size() > 0; ++fit)
  {
    model->selectWithinDistance(best, settings.thickness, inliers);
    if (inliers.empty())
      break;
    Eigen::VectorXf refined;
    model->optimizeModelCoefficients(inliers, best, refined);
    best = refined;
  }
  if (inliers.empty())
    return { std::nullopt, "no plane is large enough" };
  const Plane plane = model->upwards(best);
  const std::string reason = fault(plane, *model, settings);
  if (!reason.empty())
    return { std::nullopt, reason };
  const Floor floor = described(plane, *cells, inliers);
  if (floor.tilt_sigma > settings.most_tilt_sigma)
    return { std::nullopt, "the floor that is seen is too narrow" };
  return { floor, "" };
}

}  // namespace openpose_ros_nodelets
