// A camera driver for benchmarks: a nodelet manager that publishes the messages of a bag again and again, forth and
// back, as if they came from a sensor. The nodelets that it loads get them by shared pointer, as from a real driver.
// Parameters: ~bag (file), ~rate [Hz], ~ns (namespace of the topics).
#include <memory>
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
  virtual void publish(const ros::Time& stamp) = 0;
};

template <typename Message>
class StreamOf : public Stream
{
public:
  StreamOf(ros::NodeHandle& handle, const rosbag::Bag& bag, const std::string& topic)
    : publisher_(handle.advertise<Message>(topic, 1))
  {
    for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic)))
      frames_.push_back(instance.instantiate<Message>());
  }
  std::size_t size() const override
  {
    return frames_.size();
  }
  void prepare(std::size_t frame) override
  {
    next_ = publisher_.getNumSubscribers() > 0 ? boost::make_shared<Message>(*frames_[frame]) : nullptr;
  }
  void publish(const ros::Time& stamp) override
  {
    if (!next_)
      return;
    next_->header.stamp = stamp;
    publisher_.publish(boost::shared_ptr<const Message>(next_));
    next_.reset();
  }

private:
  std::vector<boost::shared_ptr<Message>> frames_;
  boost::shared_ptr<Message> next_;
  ros::Publisher publisher_;
};

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, "camera");
  ros::NodeHandle handle, private_handle("~");
  nodelet::Loader manager;
  const auto ns = private_handle.param<std::string>("ns", "/kinect2/qhd");
  std::vector<std::unique_ptr<Stream>> streams;
  {
    const rosbag::Bag bag(private_handle.param<std::string>("bag", ""));
    streams.push_back(std::make_unique<StreamOf<sensor_msgs::Image>>(handle, bag, ns + "/image_color"));
    streams.push_back(std::make_unique<StreamOf<sensor_msgs::CameraInfo>>(handle, bag, ns + "/camera_info"));
    streams.push_back(std::make_unique<StreamOf<sensor_msgs::Image>>(handle, bag, ns + "/image_depth_rect"));
    streams.push_back(std::make_unique<StreamOf<sensor_msgs::PointCloud2>>(handle, bag, ns + "/points"));
  }
  const std::size_t count = streams.front()->size();
  for (const auto& stream : streams)
  {
    if (stream->size() != count || count < 2)
    {
      ROS_FATAL("the bag needs equally many images, camera infos, depth images and clouds, at least 2");
      return 1;
    }
  }

  ros::AsyncSpinner spinner(1);  // loads nodelets
  spinner.start();
  ros::Rate rate(private_handle.param("rate", 15.0));
  for (std::size_t number = 0; ros::ok(); ++number)
  {
    const std::size_t place = number % (2 * count - 2);
    for (const auto& stream : streams)
      stream->prepare(place < count ? place : 2 * count - 2 - place);
    rate.sleep();
    const ros::Time stamp = ros::Time::now();
    for (const auto& stream : streams)
      stream->publish(stamp);
  }
  return 0;
}
