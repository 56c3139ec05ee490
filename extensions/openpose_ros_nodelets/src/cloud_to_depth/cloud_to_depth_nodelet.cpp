#include <mutex>
#include <string>

#include <boost/make_shared.hpp>
#include <image_transport/image_transport.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include "openpose_ros_nodelets/cloud_to_depth/cloud_camera.h"
#include "openpose_ros_nodelets/cloud_to_depth/depth_image.h"
#include "openpose_ros_nodelets/common/stream_nodelet.h"

namespace openpose_ros_nodelets
{

/// Organized cloud -> depth image and camera info of the same view, with the cloud's stamp and frame.
class CloudToDepth : public StreamNodelet
{
private:
  void configure(ParameterReader& parameters) override
  {
    make_image_ = parameters.text("encoding", "16UC1", { "16UC1", "32FC1" }) == "16UC1" ?
                             &depthImage<std::uint16_t> : &depthImage<float>;
    camera_ = parameters.text("camera", "auto", { "auto", "topic", "fit" });
    const auto update_image = [this](const image_transport::SingleSubscriberPublisher&) { update(); };
    const auto update_info = [this](const ros::SingleSubscriberPublisher&) { update(); };
    publisher_ = image_transport::ImageTransport(*nh_).advertiseCamera(
        "depth_registered/image_rect", 1, update_image, update_image, update_info, update_info);
  }

  bool isHeard() const override
  {
    return publisher_.getNumSubscribers() > 0;
  }

  void shutdown() override
  {
    publisher_.shutdown();
  }

  void subscribe() override
  {
    if (camera_ == "topic" && !info_)
      info_subscriber_ = listen<sensor_msgs::CameraInfo>(
          "camera_info", 1, [this](const auto& info) { storeInfo(info); }, true);
    else if (camera_ != "fit")
      info_subscriber_ = nh_->subscribe("camera_info", 1, &CloudToDepth::storeInfo, this);
    cloud_subscriber_ = listen<sensor_msgs::PointCloud2>("points", 1, [this](const auto& cloud) { convert(cloud); });
  }

  void unsubscribe() override
  {
    cloud_subscriber_.shutdown();
    info_subscriber_.shutdown();
  }

  void storeInfo(const sensor_msgs::CameraInfoConstPtr& info)
  {
    std::lock_guard<std::mutex> lock(mutex_);
    info_ = withoutSlash(info);
  }

  void convert(const sensor_msgs::PointCloud2ConstPtr& message)
  {
    convertFrame(message->header.stamp, [&] {
      const OrganizedCloud cloud(*message);
      requireDepth(cloud);
      const sensor_msgs::ImagePtr image = make_image_(cloud);
      const auto info = boost::make_shared<sensor_msgs::CameraInfo>(cameraOf(cloud, message->header.frame_id));
      image->header = info->header = message->header;
      publisher_.publish(image, info);
    });
  }

  /// Return the camera that was given, or the one that fits the points.
  sensor_msgs::CameraInfo cameraOf(const OrganizedCloud& cloud, const std::string& frame)
  {
    sensor_msgs::CameraInfoConstPtr info;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      info = info_;
    }
    if (!info && camera_ == "topic")
      throw BadInputError("no camera info has come on " + info_subscriber_.getTopic());
    if (!info)
      return fittedCamera(cloud);
    const auto [width, height] = imageSize(*info);
    if (width != cloud.width() || height != cloud.height() || info->header.frame_id != frame)
      throw BadInputError("cloud is " + std::to_string(cloud.width()) + " x " + std::to_string(cloud.height()) +
                          " in frame '" + frame + "', but the camera info is of " + std::to_string(width) +
                          " x " + std::to_string(height) + " in frame '" + info->header.frame_id + "'");
    return *info;
  }

  sensor_msgs::ImagePtr (*make_image_)(const OrganizedCloud&);
  std::string camera_;
  std::mutex mutex_;
  sensor_msgs::CameraInfoConstPtr info_;  ///< newest one
  image_transport::CameraPublisher publisher_;
  ros::Subscriber cloud_subscriber_, info_subscriber_;
};

}  // namespace openpose_ros_nodelets

PLUGINLIB_EXPORT_CLASS(openpose_ros_nodelets::CloudToDepth, nodelet::Nodelet)
