#include "common/master_watch.h"

#include <atomic>
#include <chrono>
#include <exception>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcException.h>
#include <xmlrpcpp/XmlRpcValue.h>

namespace openpose_ros_nodelets
{
namespace
{

constexpr std::chrono::seconds PERIOD{ 1 };
constexpr double LOG_PERIOD = 60.0;  // of the same error [s]
std::atomic<bool> is_replaced{ false };

}  // namespace

std::shared_ptr<MasterWatch> MasterWatch::ofProcess()
{
  static std::mutex mutex;
  static std::weak_ptr<MasterWatch> existing;
  std::lock_guard<std::mutex> lock(mutex);
  std::shared_ptr<MasterWatch> watch = existing.lock();
  if (!watch)
    existing = watch = std::make_shared<MasterWatch>();
  return watch;
}

bool MasterWatch::isReplaced()
{
  return is_replaced;
}

MasterWatch::MasterWatch() : thread_(&MasterWatch::run, this)
{
}

MasterWatch::~MasterWatch()
{
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void MasterWatch::run()
{
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ended_.wait_for(lock, PERIOD, [this] { return ends_; }) && ros::ok())
  {
    lock.unlock();
    try  // what leaves a thread ends the nodelet manager with all its nodelets
    {
      check();
    }
    catch (const std::exception& error)
    {
      ROS_WARN_THROTTLE(LOG_PERIOD, "the ROS master could not be asked: %s", error.what());
    }
    catch (const XmlRpc::XmlRpcException& error)
    {
      ROS_WARN_THROTTLE(LOG_PERIOD, "the ROS master answered with nonsense: %s", error.getMessage().c_str());
    }
    lock.lock();
  }
}

void MasterWatch::check()
{
  XmlRpc::XmlRpcValue request, response, run_id;
  const bool was_reachable = is_reachable_;
  is_reachable_ = ros::master::check();
  ROS_ERROR_COND(was_reachable && !is_reachable_, "the ROS master %s does not answer", ros::master::getURI().c_str());
  request[0] = ros::this_node::getName();
  request[1] = "/run_id";
  if (!is_reachable_ || !ros::master::execute("getParam", request, response, run_id, false))
    return;
  const std::string id = run_id;
  if (!run_id_.empty() && id != run_id_)
  {
    is_replaced = true;
    ROS_FATAL("%s: the ROS master was started again: the parameters that roslaunch had set are gone with the one before, "
              "so the launch has to be started again",
              ros::this_node::getName().c_str());
    ros::requestShutdown();
  }
  run_id_ = id;
}

}  // namespace openpose_ros_nodelets
