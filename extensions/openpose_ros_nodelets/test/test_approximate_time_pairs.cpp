// Pairs the stamps of two streams by message_filters' policy ApproximateTime, without a ROS master.
//
// Each line of the input is a message in the order of arrival, "STREAM STAMP": 0 or 1, and nanoseconds. A recording
// begins with a line "begin QUEUE_SIZE MAX_INTERVAL"; MAX_INTERVAL: greatest difference of the stamps of a pair [s],
// 0: any. Each line of the output is a pair, "STAMP STAMP", or "begin" for the next recording.

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include <boost/make_shared.hpp>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <ros/time.h>
#include <sensor_msgs/Image.h>

using sensor_msgs::Image;
using Policy = message_filters::sync_policies::ApproximateTime<Image, Image>;
using Synchronizer = message_filters::Synchronizer<Policy>;

void print(const sensor_msgs::ImageConstPtr& first, const sensor_msgs::ImageConstPtr& second)
{
  std::cout << first->header.stamp.toNSec() << ' ' << second->header.stamp.toNSec() << '\n';
}

std::unique_ptr<Synchronizer> makeSynchronizer(uint32_t queue_size, double max_interval)
{
  Policy policy(queue_size);
  if (max_interval > 0)
  {
    policy.setMaxIntervalDuration(ros::Duration(max_interval));
  }
  std::unique_ptr<Synchronizer> synchronizer(new Synchronizer(static_cast<const Policy&>(policy)));
  synchronizer->registerCallback(&print);
  return synchronizer;
}

int main()
{
  ros::Time::init();
  std::unique_ptr<Synchronizer> synchronizer;
  std::string word;
  while (std::cin >> word)
  {
    if (word == "begin")
    {
      uint32_t queue_size = 0;
      double max_interval = 0;
      std::cin >> queue_size >> max_interval;
      synchronizer = makeSynchronizer(queue_size, max_interval);
      std::cout << "begin\n";
      continue;
    }
    uint64_t stamp = 0;
    if (!synchronizer || (word != "0" && word != "1") || !(std::cin >> stamp))
    {
      std::cerr << "neither a message nor a beginning: '" << word << "'\n";
      return EXIT_FAILURE;
    }
    const auto message = boost::make_shared<Image>();
    message->header.stamp.fromNSec(stamp);
    const ros::MessageEvent<Image const> event(message);
    if (word == "0")
    {
      synchronizer->add<0>(event);
    }
    else
    {
      synchronizer->add<1>(event);
    }
  }
  return EXIT_SUCCESS;
}
