#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace openpose_ros_nodelets
{

/// Shuts this process down when the ROS master is another one than at its start: roscpp registers once, and what roslaunch
/// had set is gone with the master. The counterpart of openpose_ros_pkg/ros/master/watch.py.
class MasterWatch
{
public:
  /// Return the one of this process; it checks as long as it is held.
  static std::shared_ptr<MasterWatch> ofProcess();

  /// Tell whether this process was shut down for that.
  static bool isReplaced();

  MasterWatch();
  ~MasterWatch();

private:
  void keepChecking();
  void check();

  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false, is_reachable_ = true;
  int pid_ = 0;         ///< of the master; 0: not known yet
  std::string run_id_;  ///< /run_id on it; empty: not set yet
  std::thread thread_;
};

}  // namespace openpose_ros_nodelets
