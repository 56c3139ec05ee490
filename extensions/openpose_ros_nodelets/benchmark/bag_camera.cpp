// A camera driver for benchmarks: a nodelet manager that publishes the messages of a bag again and again, forth and
// back, as if they came from a sensor. The nodelets that it loads get them by shared pointer, as from a real driver.
// Parameters: ~bag (file), ~rate [Hz], ~ns (namespace of the topics), ~topics (those to publish, separated by spaces;
// default: all four), ~frame_id (empty: that of the bag), ~once (default false: wait until each topic has a subscriber,
// and play the bag once). The stamp [ns] of each frame that has subscribers goes to the standard output.
#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <boost/make_shared.hpp>
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

namespace
{

class Stream
{
public:
  virtual ~Stream() = default;
  virtual std::size_t size() const = 0;
  /// Make the message of a frame, which takes the time in which a driver fills a new one.
  virtual void prepare(std::size_t frame) = 0;
  /// Tell whether it was prepared, and so published.
  virtual bool publish(const ros::Time& stamp) = 0;
  virtual bool isHeard() const = 0;
};

template <typename Message>
class StreamOf : public Stream
{
public:
  StreamOf(ros::NodeHandle& handle, const rosbag::Bag& bag, const std::string& topic, const std::string& frame_id)
    : publisher_(handle.advertise<Message>(topic, 1))
  {
    for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic)))
    {
      frames_.push_back(instance.instantiate<Message>());
      if (!frame_id.empty())
        frames_.back()->header.frame_id = frame_id;
    }
  }
  std::size_t size() const override
  {
    return frames_.size();
  }
  void prepare(std::size_t frame) override
  {
    next_ = publisher_.getNumSubscribers() > 0 ? boost::make_shared<Message>(*frames_[frame]) : nullptr;
  }
  bool publish(const ros::Time& stamp) override
  {
    if (!next_)
      return false;
    next_->header.stamp = stamp;
    publisher_.publish(boost::shared_ptr<const Message>(next_));
    next_.reset();
    return true;
  }
  bool isHeard() const override
  {
    return publisher_.getNumSubscribers() > 0;
  }

private:
  std::vector<boost::shared_ptr<Message>> frames_;
  boost::shared_ptr<Message> next_;
  ros::Publisher publisher_;
};

std::vector<std::unique_ptr<Stream>> openStreams(ros::NodeHandle& handle, const ros::NodeHandle& parameters)
{
  const rosbag::Bag bag(parameters.param<std::string>("bag", ""));
  const auto ns = parameters.param<std::string>("ns", "/kinect2/qhd") + "/";
  const auto frame_id = parameters.param<std::string>("frame_id", "");
  std::istringstream topics(
      parameters.param<std::string>("topics", "image_color camera_info image_depth_rect points"));
  std::vector<std::unique_ptr<Stream>> streams;
  for (std::string topic; topics >> topic;)
  {
    if (topic == "points")
      streams.push_back(std::make_unique<StreamOf<sensor_msgs::PointCloud2>>(handle, bag, ns + topic, frame_id));
    else if (topic == "camera_info")
      streams.push_back(std::make_unique<StreamOf<sensor_msgs::CameraInfo>>(handle, bag, ns + topic, frame_id));
    else
      streams.push_back(std::make_unique<StreamOf<sensor_msgs::Image>>(handle, bag, ns + topic, frame_id));
  }
  return streams;
}

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, "camera");
  ros::NodeHandle handle, private_handle("~");
  nodelet::Loader manager;
  const std::vector<std::unique_ptr<Stream>> streams = openStreams(handle, private_handle);
  const std::size_t count = streams.empty() ? 0 : streams.front()->size();
  for (const auto& stream : streams)
  {
    if (stream->size() != count || count < 2)
    {
      ROS_FATAL("the bag needs equally many messages on each topic, at least 2");
      return 1;
    }
  }

  ros::AsyncSpinner spinner(1);  // loads nodelets
  spinner.start();
  const bool once = private_handle.param("once", false);
  const auto is_heard = [](const std::unique_ptr<Stream>& stream) { return stream->isHeard(); };
  while (once && ros::ok() && !std::all_of(streams.begin(), streams.end(), is_heard))
    ros::WallDuration(0.01).sleep();
  ros::Rate rate(private_handle.param("rate", 15.0));
  for (std::size_t number = 0; ros::ok() && !(once && number == count); ++number)
  {
    const std::size_t place = number % (2 * count - 2);
    for (const auto& stream : streams)
      stream->prepare(place < count ? place : 2 * count - 2 - place);
    rate.sleep();
    const ros::Time stamp = ros::Time::now();
    bool published = false;
    for (const auto& stream : streams)
      published |= stream->publish(stamp);
    if (published)
      std::cout << stamp.toNSec() << std::endl;
  }
  ros::waitForShutdown();  // the last messages are still being sent
  return 0;
}
