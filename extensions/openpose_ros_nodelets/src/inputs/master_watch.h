#pragma once

#include <memory>
#include <string>

#include "common/repeated.h"

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

private:
  void check();

  bool is_reachable_ = true;
  int pid_ = 0;         ///< of the master; 0: not known yet
  std::string run_id_;  ///< /run_id on it; empty: not set yet
  Repeated thread_;     ///< calls `check`
};

}  // namespace openpose_ros_nodelets
