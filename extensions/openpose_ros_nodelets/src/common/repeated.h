#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace openpose_ros_nodelets
{

/// Calls a function once a second, in wall time, in a thread of its own, until it is destroyed or ROS shuts down. What
/// the function throws is logged: it would end the nodelet manager with all its nodelets.
class Repeated
{
public:
  explicit Repeated(std::function<void()> work);
  ~Repeated();

private:
  void run();

  std::function<void()> work_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace openpose_ros_nodelets
