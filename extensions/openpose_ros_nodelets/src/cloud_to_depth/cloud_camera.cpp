#include "openpose_ros_nodelets/cloud_to_depth/cloud_camera.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <vector>

#include <sensor_msgs/distortion_models.h>
#include <openpose_ros_pkg/pinhole_fit.h>

namespace openpose_ros_nodelets
{
namespace
{

/// Return the valid ones of the points in the middle of each cell of a grid.
std::vector<openpose_ros_pkg::SeenPoint> pointsOfGrid(const OrganizedCloud& cloud, std::size_t columns,
                                                         std::size_t rows)
{
  std::vector<openpose_ros_pkg::SeenPoint> points;
  for (std::size_t i = 0; i < rows; ++i)
  {
    const std::size_t row = (2 * i + 1) * cloud.height() / (2 * rows);
    for (std::size_t j = 0; j < columns; ++j)
    {
      const std::size_t column = (2 * j + 1) * cloud.width() / (2 * columns);
      const double x = cloud.x(column, row), y = cloud.y(column, row), z = cloud.z(column, row);
      if (openpose_ros_pkg::isSeen(x, y, z))
        points.push_back({ x, y, z, static_cast<double>(column), static_cast<double>(row) });
    }
  }
  return points;
}

}  // namespace

std::pair<std::uint32_t, std::uint32_t> imageSize(const sensor_msgs::CameraInfo& info)
{
  // 0 stands for the whole sensor and for no binning
  return { (info.roi.width ? info.roi.width : info.width) / std::max(info.binning_x, 1U),
           (info.roi.height ? info.roi.height : info.height) / std::max(info.binning_y, 1U) };
}

sensor_msgs::CameraInfo fittedCamera(const OrganizedCloud& cloud)
{
  const openpose_ros_pkg::PinholeFitConstants method;
  const auto points = pointsOfGrid(cloud, method.columns, method.rows);
  const auto fit = openpose_ros_pkg::fittedPinhole(points, method);
  std::ostringstream text;
  if (!fit)
  {
    text << "no camera can be fitted to the cloud: " << points.size() << " of " << method.columns * method.rows
         << " points that were read are valid, expected at least " << method.least_points
         << " in several rows and columns";
    throw BadInputError(text.str());
  }
  if (!(fit->fx > 0.0 && fit->fy > 0.0 && fit->error <= method.tolerance))
  {
    text << "the points of the cloud are not those of a pinhole camera in its optical frame (x right, y down, z "
            "forward): focal lengths that fit best "
         << fit->fx << " and " << fit->fy << " px, they miss their pixels by " << fit->error << " px, expected up to "
         << method.tolerance;
    throw BadInputError(text.str());
  }
  sensor_msgs::CameraInfo info;
  info.width = cloud.width();
  info.height = cloud.height();
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0.0);
  info.K = { fit->fx, 0.0, fit->cx, 0.0, fit->fy, fit->cy, 0.0, 0.0, 1.0 };
  info.R = { 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 };
  info.P = { fit->fx, 0.0, fit->cx, 0.0, 0.0, fit->fy, fit->cy, 0.0, 0.0, 0.0, 1.0, 0.0 };
  return info;
}

}  // namespace openpose_ros_nodelets
