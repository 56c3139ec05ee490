#include "people_labeller.h"

#include <algorithm>
#include <limits>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_plane.h>

namespace openpose_ros_nodelets
{
namespace
{

using Plane = Eigen::Hyperplane<float, 3>;

constexpr std::size_t MOST_PLANES = 2;     // floor and a wall, or floor and a seat
constexpr std::size_t MOST_POINTS = 400;   // RANSAC's time goes with them
constexpr std::size_t LEAST_INLIERS = 30;
constexpr float LEAST_SHARE = 0.2f;        // of the points, that a plane must hold
constexpr int ITERATIONS = 60;             // 0.999 sure to hit a plane that holds half of the points
constexpr float LEAST_AREA = 0.005f;       // spanned by a sample of three points [m^2]
constexpr float REACH = 0.35f;             // a support is this near to a joint [m]
constexpr float BEHIND = 0.03f;            // joints may be this far behind it, by their error [m]

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// PCL's plane, without an error on the console for each sample that lies on a line.
class PlaneModel : public pcl::SampleConsensusModelPlane<pcl::PointXYZ>
{
public:
  using pcl::SampleConsensusModelPlane<pcl::PointXYZ>::SampleConsensusModelPlane;

private:
  bool isSampleGood(const std::vector<int>& samples) const override
  {
    const auto point = [&](int number) { return (*input_)[samples[number]].getVector3fMap(); };
    return (point(1) - point(0)).cross(point(2) - point(0)).squaredNorm() > LEAST_AREA * LEAST_AREA;
  }
};

bool supports(const Body& body, Plane& plane)
{
  float nearest = std::numeric_limits<float>::max(), least = nearest, greatest = -nearest;
  for (const Eigen::Vector3f& joint : body.joints)
  {
    const float distance = plane.signedDistance(joint);
    nearest = std::min(nearest, std::abs(distance));
    least = std::min(least, distance);
    greatest = std::max(greatest, distance);
  }
  return nearest < REACH && (least > -BEHIND || greatest < BEHIND);
}

// Take the points of a plane out of the cloud if it holds enough of them; return whether it does.
bool takeInliers(const Plane& plane, float thickness, Cloud& cloud)
{
  const auto is_on_plane = [&](const pcl::PointXYZ& point) {
    return plane.absDistance(point.getVector3fMap()) < thickness;
  };
  const std::size_t number = std::count_if(cloud.begin(), cloud.end(), is_on_plane);
  if (number < LEAST_INLIERS || number < LEAST_SHARE * cloud.size())
    return false;
  cloud.points.erase(std::remove_if(cloud.points.begin(), cloud.points.end(), is_on_plane), cloud.points.end());
  cloud.width = cloud.points.size();
  return true;
}

bool fitPlane(const Cloud::Ptr& cloud, float thickness, Plane& plane)
{
  const pcl::SampleConsensusModel<pcl::PointXYZ>::Ptr model(new PlaneModel(cloud));
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, thickness);
  ransac.setMaxIterations(ITERATIONS);
  if (!ransac.computeModel())
    return false;
  std::vector<int> inliers;
  Eigen::VectorXf coefficients, refined;
  ransac.getInliers(inliers);
  ransac.getModelCoefficients(coefficients);
  model->optimizeModelCoefficients(inliers, coefficients, refined);
  plane.coeffs() = refined;
  return true;
}

}  // namespace

Planes findSupports(const Body& body, const std::vector<Eigen::Vector3f>& scene, float thickness, Planes& known)
{
  const Cloud::Ptr cloud(new Cloud);
  const std::size_t step = scene.size() / MOST_POINTS + 1;
  for (std::size_t index = 0; index < scene.size(); index += step)
    cloud->push_back(pcl::PointXYZ(scene[index].x(), scene[index].y(), scene[index].z()));
  Planes found;
  for (Plane& plane : known)
    if (supports(body, plane) && takeInliers(plane, thickness, *cloud))
      found.push_back(plane);
  for (std::size_t trial = found.size(); trial < MOST_PLANES && cloud->size() >= LEAST_INLIERS; ++trial)
  {
    Plane plane;
    if (!fitPlane(cloud, thickness, plane) || !takeInliers(plane, thickness, *cloud))
      break;
    if (!supports(body, plane))
      continue;
    found.push_back(plane);
    known.push_back(plane);
  }
  return found;
}

}  // namespace openpose_ros_nodelets
