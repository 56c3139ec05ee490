#include "openpose_ros_nodelets/common/master_watch.h"

#include <atomic>
#include <chrono>
#include <mutex>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/param.h>
#include <ros/this_node.h>

namespace openpose_ros_nodelets
{
namespace
{

constexpr std::chrono::seconds PERIOD{ 1 };
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
  end_.set_value();
  thread_.join();
}

void MasterWatch::run()
{
  const std::future<void> end = end_.get_future();
  while (end.wait_for(PERIOD) == std::future_status::timeout && ros::ok())
  {
    try  // what leaves a thread ends the nodelet manager with all its nodelets
    {
      check();
    }
    catch (...)
    {
      ROS_WARN_THROTTLE(60.0, "the ROS master could not be asked");
    }
  }
}

void MasterWatch::check()
{
  const bool was_reachable = is_reachable_;
  is_reachable_ = ros::master::check();
  ROS_ERROR_COND(was_reachable && !is_reachable_, "the ROS master %s does not answer", ros::master::getURI().c_str());
  std::string id;
  if (!is_reachable_ || !ros::param::get("/run_id", id))
    return;
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
