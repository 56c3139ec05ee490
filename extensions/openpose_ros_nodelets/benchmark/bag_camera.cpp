// A camera driver for benchmarks: publishes the messages of a bag again and again, forth and back.
// Parameters: ~bag (file with the topics below /kinect2/qhd), ~rate [Hz], ~topics (those to publish, separated by
// spaces; default: all four), ~frame_id (empty: that of the bag), ~once (default false: wait until each topic has a
// subscriber, and play the bag once). The stamp [ns] of each frame that has subscribers goes to the standard output.
#include <algorithm>
#include <functional>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <boost/make_shared.hpp>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

namespace
{

using Publish = std::function<void(const ros::Time&)>;

struct Stream
{
  std::size_t size;
  std::function<bool()> is_heard;
  /// Makes the message of a frame, which takes the time in which a driver fills a new one; the result publishes it.
  std::function<Publish(std::size_t)> prepare;
};

template <typename Message>
Stream streamOf(ros::NodeHandle& handle, const rosbag::Bag& bag, const std::string& topic, const std::string& frame_id)
{
  std::vector<boost::shared_ptr<Message>> frames;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic)))
  {
    frames.push_back(instance.instantiate<Message>());
    if (!frame_id.empty())
      frames.back()->header.frame_id = frame_id;
  }
  const ros::Publisher publisher = handle.advertise<Message>(topic, 1);
  return { frames.size(), [publisher] { return publisher.getNumSubscribers() > 0; }, [=](std::size_t frame) -> Publish {
            const auto message = boost::make_shared<Message>(*frames[frame]);
            return [=](const ros::Time& stamp) {
              message->header.stamp = stamp;
              publisher.publish(boost::shared_ptr<const Message>(message));
            };
          } };
}

std::vector<Stream> openStreams(ros::NodeHandle& handle, const ros::NodeHandle& parameters)
{
  const rosbag::Bag bag(parameters.param<std::string>("bag", ""));
  const auto frame_id = parameters.param<std::string>("frame_id", "");
  std::istringstream topics(
      parameters.param<std::string>("topics", "image_color camera_info image_depth_rect points"));
  std::vector<Stream> streams;
  for (std::string name; topics >> name;)
  {
    const std::string topic = "/kinect2/qhd/" + name;
    if (name == "points")
      streams.push_back(streamOf<sensor_msgs::PointCloud2>(handle, bag, topic, frame_id));
    else if (name == "camera_info")
      streams.push_back(streamOf<sensor_msgs::CameraInfo>(handle, bag, topic, frame_id));
    else
      streams.push_back(streamOf<sensor_msgs::Image>(handle, bag, topic, frame_id));
  }
  return streams;
}

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, "camera");
  ros::NodeHandle handle, private_handle("~");
  const std::vector<Stream> streams = openStreams(handle, private_handle);
  const std::size_t count = streams.empty() ? 0 : streams.front().size;
  if (count < 2 || std::any_of(streams.begin(), streams.end(), [&](const Stream& one) { return one.size != count; }))
  {
    ROS_FATAL("the bag needs equally many messages on each topic, at least 2");
    return 1;
  }

  const bool once = private_handle.param("once", false);
  while (once && ros::ok() &&
         !std::all_of(streams.begin(), streams.end(), [](const Stream& one) { return one.is_heard(); }))
    ros::WallDuration(0.01).sleep();
  ros::Rate rate(private_handle.param("rate", 15.0));
  for (std::size_t number = 0; ros::ok() && !(once && number == count); ++number)
  {
    const std::size_t place = number % (2 * count - 2);
    std::vector<Publish> prepared;
    for (const Stream& stream : streams)
      if (stream.is_heard())
        prepared.push_back(stream.prepare(place < count ? place : 2 * count - 2 - place));
    rate.sleep();
    const ros::Time stamp = ros::Time::now();
    for (const Publish& publish : prepared)
      publish(stamp);
    if (!prepared.empty())
      std::cout << stamp.toNSec() << std::endl;
  }
  ros::waitForShutdown();  // the last messages are still being sent
  return 0;
}
