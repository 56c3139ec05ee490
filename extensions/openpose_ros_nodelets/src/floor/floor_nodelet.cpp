#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <geometry_msgs/TransformStamped.h>
#include <pcl_msgs/ModelCoefficients.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/transform_broadcaster.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"
#include "openpose_ros_nodelets/common/stream_nodelet.h"
#include "openpose_ros_nodelets/common/transforms.h"
#include "openpose_ros_nodelets/floor/floor_finder.h"
#include "openpose_ros_nodelets/floor/floor_tracker.h"

namespace openpose_ros_nodelets
{
namespace
{

constexpr double DEGREE = M_PI / 180;
/// Until frames that others publish are heard after the start [s], as of the rig of openpose_ros_fusion.
constexpr double SETTLING = 2;

/// Return about `most` points of a cloud, evenly over its rows and columns, without those that are missing.
Points::Ptr sampled(const CloudPoints& cloud, std::size_t most)
{
  const double excess = double(cloud.width()) * cloud.height() / most;
  const std::size_t step = std::max(1.0, std::ceil(cloud.height() > 1 ? std::sqrt(excess) : excess));
  Points::Ptr points(new Points);
  points->reserve(most);
  for (std::size_t row = 0; row < cloud.height(); row += step)
    for (std::size_t column = 0; column < cloud.width(); column += step)
    {
      const Eigen::Vector3f point(cloud.x(column, row), cloud.y(column, row), cloud.z(column, row));
      if (point.allFinite() && !point.isZero())
        points->push_back(pcl::PointXYZ(point.x(), point.y(), point.z()));
    }
  return points;
}

/// Return the frame on the floor: origin below the camera, z up, x along the camera's view.
geometry_msgs::Transform floorFrame(const Floor& floor)
{
  const Eigen::Vector3f up = floor.normal;
  Eigen::Vector3f forward = Eigen::Vector3f::UnitZ() - up.z() * up;
  if (forward.norm() < 0.1F)  // a camera that looks straight down or up: the upper border of its image is in front
    forward = -Eigen::Vector3f::UnitY() + up.y() * up;
  forward.normalize();
  Eigen::Matrix3f axes;
  axes << forward, up.cross(forward), up;
  const Eigen::Quaternionf rotation(axes);
  geometry_msgs::Transform transform;
  transform.translation.x = -floor.height * up.x();
  transform.translation.y = -floor.height * up.y();
  transform.translation.z = -floor.height * up.z();
  transform.rotation.x = rotation.x();
  transform.rotation.y = rotation.y();
  transform.rotation.z = rotation.z();
  transform.rotation.w = rotation.w();
  return transform;
}

}  // namespace

/// Finds the floor in a cloud and publishes it as a plane and, if wanted, as a frame of tf.
class FloorNodelet : public StreamNodelet
{
private:
  void configure(ParameterReader& parameters) override
  {
    period_ = 1 / parameters.number("rate", 5, 0.1, 1000);
    most_points_ = parameters.integer("points", 12000, 500, 10000000);
    const std::vector<double> up = parameters.numbers("up", { 0, -1, 0 });
    up_ = Eigen::Vector3d(up[0], up[1], up[2]).normalized().cast<float>();
    if (!(up_.norm() > 0.9F))
      throw ParameterError("parameter 'up' = [0, 0, 0] is not allowed: a direction");
    tolerance_ = DEGREE * parameters.number("tolerance", 40, 1, 89);
    gravity_frame_ = parameters.text("gravity_frame", "");
    gravity_tolerance_ = DEGREE * parameters.number("gravity_tolerance", 10, 1, 89);
    settings_.least_height = parameters.number("least_height", settings_.least_height, 0, 100);
    settings_.most_height = parameters.number("most_height", settings_.most_height, 0, 100);
    settings_.range = parameters.number("range", settings_.range, 0.5, 100);
    settings_.thickness = parameters.number("thickness", settings_.thickness, 0.001, 1);
    settings_.least_area = parameters.number("least_area", settings_.least_area, 0.01, 100);
    settings_.most_below = parameters.number("most_below", settings_.most_below, 0, 1);
    settings_.most_tilt_sigma = DEGREE * parameters.number("most_tilt_sigma", 0.4, 0.01, 90);
    tracker_ = std::make_unique<FloorTracker>(parameters.number("smoothing_time", 0.5, 0, 60));
    publish_tf_ = parameters.flag("publish_tf", false);
    floor_frame_ = parameters.text("floor_frame", "world");
    if (!gravity_frame_.empty())
      transforms_ = std::make_unique<Transforms>(*nh_);
    if (publish_tf_)
    {
      broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
      others_ = std::make_unique<Transforms>(*nh_);
      settled_ = ros::WallTime::now() + ros::WallDuration(SETTLING);
      lazy_ = false;  // tf does not tell its subscribers
    }
    show();
    publisher_ = advertise<pcl_msgs::ModelCoefficients>(*pnh_, "plane", 1);
  }

  /// Show the newest floor in /diagnostics.
  void show()
  {
    const auto add = [this](const std::string& key, float Floor::*member, double unit) {
      health().show(key, [this, member, unit] {
        std::lock_guard<std::mutex> lock(mutex_);
        return newest_ ? std::to_string((*newest_).*member / unit) : "none";
      });
    };
    add("height [m]", &Floor::height, 1);
    add("height, standard deviation [m]", &Floor::height_sigma, 1);
    add("tilt, standard deviation [deg]", &Floor::tilt_sigma, DEGREE);
    add("share of points on the floor", &Floor::share, 1);
    add("area that is seen [m^2]", &Floor::area, 1);
    health().show("computing [ms]", [this] {
      std::lock_guard<std::mutex> lock(mutex_);
      return std::to_string(milliseconds_);
    });
  }

  void subscribe() override
  {
    subscriber_ = listen<sensor_msgs::PointCloud2>("points", 1, [this](const auto& cloud) { take(cloud); });
  }

  void unsubscribe() override
  {
    subscriber_.shutdown();
  }

  void take(const sensor_msgs::PointCloud2ConstPtr& cloud)
  {
    const ros::Time stamp = cloud->header.stamp;
    if (stamp.isZero())
      return health().warn("bad clouds", "it has no stamp");
    // a tenth of a period early is in time, as stamps jitter
    if (stamp < computed_ || (stamp - computed_).toSec() > 0.9 * period_)
    {
      if (stamp < computed_)
        frame_ = std::nullopt;
      computed_ = stamp;
      compute(*cloud);
    }
    if (publish_tf_ && frame_)
      sendFrame(cloud->header);
  }

  /// Publish the frame of the floor on tf, unless another node does: a frame has one parent.
  void sendFrame(const std_msgs::Header& header)
  {
    if (others_ && ros::WallTime::now() < settled_)
      return;
    if (others_ && others_->exists(floor_frame_))
      return health().warn("frame exists", "tf has a frame '" + floor_frame_ + "', so that of the floor is not published: "
                                           "set floor_frame to another name, or publish_tf to false");
    others_.reset();
    geometry_msgs::TransformStamped transform;
    transform.header = header;
    transform.child_frame_id = floor_frame_;
    transform.transform = *frame_;
    broadcaster_->sendTransform(transform);
  }

  void compute(const sensor_msgs::PointCloud2& cloud)
  {
    const ros::WallTime began = ros::WallTime::now();
    std::optional<Floor> floor;
    convertFrame(cloud.header.stamp, [&] {
      const FloorSearch search = findFloor(sampled(CloudPoints(cloud), most_points_), upwards(cloud.header),
                                           gravity_frame_.empty() ? tolerance_ : gravity_tolerance_, settings_);
      if (!search.floor && publish_tf_)
        health().warn("floor not seen", search.fault);  // readers of tf, such as RViz, wait for the frame
      else if (!search.floor)
        health().count("floor not seen: " + search.fault);
      floor = tracker_->update(search.floor, cloud.header.stamp.toSec());
      health().count(floor ? "floor" : "no floor");
    });
    {
      std::lock_guard<std::mutex> lock(mutex_);
      newest_ = floor;
      milliseconds_ = 1e3 * (ros::WallTime::now() - began).toSec();
    }
    if (floor)
    {
      frame_ = floorFrame(*floor);
      publish(*floor, cloud.header);
    }
  }

  void publish(const Floor& floor, const std_msgs::Header& header)
  {
    const pcl_msgs::ModelCoefficientsPtr plane(new pcl_msgs::ModelCoefficients);
    plane->header = header;
    plane->values = { floor.normal.x(), floor.normal.y(), floor.normal.z(), floor.height };
    publisher_.publish(plane);
  }

  /// Return the direction upwards in the frame of a cloud, by the newest transform, as it need not be exact.
  ///
  /// Throws tf2::TransformException.
  Eigen::Vector3f upwards(const std_msgs::Header& header) const
  {
    if (gravity_frame_.empty())
      return up_;
    const auto& rotation = transforms_->newest(header.frame_id, gravity_frame_, header.stamp).transform.rotation;
    return Eigen::Quaterniond(rotation.w, rotation.x, rotation.y, rotation.z).cast<float>() * Eigen::Vector3f::UnitZ();
  }

  double period_, tolerance_, gravity_tolerance_;
  int most_points_;
  Eigen::Vector3f up_;
  std::string gravity_frame_, floor_frame_;
  bool publish_tf_;
  FloorSettings settings_;
  std::unique_ptr<FloorTracker> tracker_;
  std::unique_ptr<Transforms> transforms_;
  std::unique_ptr<Transforms> others_;  ///< what others publish, until the frame of the floor is published
  ros::WallTime settled_;               ///< when these are heard
  std::unique_ptr<tf2_ros::TransformBroadcaster> broadcaster_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  ros::Time computed_;
  std::mutex mutex_;  ///< guards what diagnostics show
  std::optional<Floor> newest_;
  std::optional<geometry_msgs::Transform> frame_;  ///< where the floor was last seen: people may hide it
  double milliseconds_ = 0;
};

}  // namespace openpose_ros_nodelets

PLUGINLIB_EXPORT_CLASS(openpose_ros_nodelets::FloorNodelet, nodelet::Nodelet)
