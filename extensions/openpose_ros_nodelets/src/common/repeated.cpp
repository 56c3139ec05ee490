#include "common/repeated.h"

#include <chrono>
#include <exception>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <xmlrpcpp/XmlRpcException.h>

namespace openpose_ros_nodelets
{
namespace
{

constexpr std::chrono::seconds PERIOD{ 1 };
constexpr double LOG_PERIOD = 60.0;  // of the same error [s]

}  // namespace

Repeated::Repeated(std::function<void()> work) : work_(std::move(work)), thread_(&Repeated::run, this)
{
}

Repeated::~Repeated()
{
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void Repeated::run()
{
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ended_.wait_for(lock, PERIOD, [this] { return ends_; }) && ros::ok())
  {
    lock.unlock();  // the master may not answer
    try
    {
      work_();
    }
    catch (const std::exception& error)
    {
      ROS_WARN_THROTTLE(LOG_PERIOD, "a watching thread met an error and goes on: %s", error.what());
    }
    catch (const XmlRpc::XmlRpcException& error)
    {
      ROS_WARN_THROTTLE(LOG_PERIOD, "the ROS master answered with nonsense: %s", error.getMessage().c_str());
    }
    lock.lock();
  }
}

}  // namespace openpose_ros_nodelets
