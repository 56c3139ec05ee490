#include "inputs/master_watch.h"

#include <atomic>
#include <mutex>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

namespace openpose_ros_nodelets
{
namespace
{

using XmlRpc::XmlRpcValue;

std::atomic<bool> is_replaced{ false };

/// Call the master without waiting for one; return whether it answered, and its answer in `value`.
bool call(const std::string& method, const std::string& argument, XmlRpcValue& value)
{
  XmlRpcValue request, response;
  request[0] = ros::this_node::getName();
  if (!argument.empty())
    request[1] = argument;
  return ros::master::execute(method, request, response, value, false);
}

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

MasterWatch::MasterWatch() : thread_([this] { check(); })
{
}

void MasterWatch::check()
{
  XmlRpcValue pid, run_id;
  const bool was_reachable = is_reachable_;
  is_reachable_ = call("getPid", "", pid);
  if (!is_reachable_)
  {
    ROS_ERROR_COND(was_reachable, "the ROS master %s does not answer", ros::master::getURI().c_str());
    return;
  }
  const std::string id = call("getParam", "/run_id", run_id) ? std::string(run_id) : "";
  // in containers, both masters may have the same pid
  if (pid_ != 0 && (int(pid) != pid_ || (!id.empty() && !run_id_.empty() && id != run_id_)))
  {
    is_replaced = true;
    ROS_FATAL("%s: the ROS master was started again: the parameters that roslaunch had set are gone with the one before, "
              "so the launch has to be started again",
              ros::this_node::getName().c_str());
    ros::requestShutdown();
  }
  pid_ = pid;
  run_id_ = id;
}

}  // namespace openpose_ros_nodelets
