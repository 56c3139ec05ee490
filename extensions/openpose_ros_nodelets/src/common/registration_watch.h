#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <xmlrpcpp/XmlRpcValue.h>

namespace openpose_ros_nodelets
{

/// Registers all topics and services of this process anew when the ROS master was restarted, and sets private parameters
/// again that it lost; roscpp itself registers once. The counterpart of openpose_ros_pkg/ros/master/registration.py.
class RegistrationWatch
{
public:
  /// Return the one of this process; it looks as long as somebody holds it.
  static std::shared_ptr<RegistrationWatch> ofProcess();

  RegistrationWatch();
  ~RegistrationWatch();

  /// Keep the private parameters of a nodelet or node.
  void keepParameters(const std::string& name);

private:
  void keepLooking();
  void lookSafely();
  void look();
  /// Note what is registered.
  void remember();
  void registerAll();

  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false;
  bool is_reachable_ = true;
  std::map<std::string, XmlRpc::XmlRpcValue> parameters_;
  std::vector<std::string> services_;
  std::thread thread_;
};

}  // namespace openpose_ros_nodelets
