#pragma once

#include <future>
#include <memory>
#include <string>
#include <thread>

namespace openpose_ros_nodelets
{

/// Shuts this process down when the ROS master has another /run_id than before: roscpp registers once, and what roslaunch
/// had set is gone with the master. Asks once a second, in wall time. The counterpart of
/// openpose_ros_pkg/ros/master/watch.py.
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
  void run();
  void check();

  bool is_reachable_ = true;
  std::string run_id_;  ///< empty: not set yet
  std::promise<void> end_;
  std::thread thread_;  ///< as the master may not answer
};

}  // namespace openpose_ros_nodelets
