#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>

namespace openpose_ros_nodelets
{

/// Counts what a nodelet does and its faults: warnings in the log, at most one of a kind in five seconds, and
/// /diagnostics once a second. The counterpart of openpose_ros_pkg/ros/health.py.
class Health
{
public:
  using Text = std::function<std::string()>;

  /// `name`: of the nodelet, for the log. `why_resting`: why there are no frames; empty: there should be some.
  /// `lasting_fault`: keeps the status at WARN while it returns a text.
  Health(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle, const std::string& name,
         Text why_resting, Text lasting_fault);

  /// Count something that is no fault.
  void count(const std::string& event);

  /// Count a finished frame and its latency, from the stamp of the camera to now.
  void frameDone(const ros::Time& stamp);

  /// Count a fault and log it, throttled by its kind. Events are a fixed set; the text may quote what others sent.
  void warn(const std::string& event, const std::string& text);

  /// Add a value to every report. Call it before the nodelet spins.
  void show(const std::string& key, Text value);

private:
  void update();
  void report(diagnostic_updater::DiagnosticStatusWrapper& status);

  std::mutex mutex_;
  std::map<std::string, std::size_t> counts_;
  std::map<std::string, ros::WallTime> warned_;
  std::vector<std::pair<std::string, Text>> values_;
  std::vector<double> latencies_;  ///< of the frames since the report before this one [s]
  const Text why_resting_, lasting_fault_;
  std::string last_warning_;
  ros::WallTime last_warning_time_, last_report_;
  std::string name_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

}  // namespace openpose_ros_nodelets
