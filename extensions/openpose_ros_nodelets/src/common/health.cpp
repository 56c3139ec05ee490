#include "openpose_ros_nodelets/common/health.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <utility>

namespace openpose_ros_nodelets
{
namespace
{

// One warning of a kind in this time; the others are counted. A warning keeps the status at WARN as long [s].
constexpr double WARNING_PERIOD = 5.0;
constexpr double REPORT_PERIOD = 1.0;  // [s]
constexpr std::size_t LONGEST_TEXT = 1000;  // of a warning [bytes]

/// Return what is shown of a text, which may quote what others sent: its beginning, with '?' for each byte that is not
/// printable ASCII, as it may control a terminal or be half a character.
std::string shown(const std::string& text)
{
  std::string result = text.substr(0, LONGEST_TEXT);
  std::replace_if(
      result.begin(), result.end(), [](unsigned char each) { return !std::isprint(each); }, '?');
  return result;
}

}  // namespace

Health::Health(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle, const std::string& name,
               Text why_resting, Text lasting_fault)
  : why_resting_(std::move(why_resting))
  , lasting_fault_(std::move(lasting_fault))
  , last_report_(ros::WallTime::now())
  , name_(name)
  , updater_(handle, private_handle, name)
{
  updater_.setHardwareID("none");
  updater_.add(name.substr(name.find_first_not_of('/')), this, &Health::report);
  // wall time, so that diagnostics do not stop with the simulated clock
  timer_ = ros::NodeHandle(handle).createWallTimer(ros::WallDuration(REPORT_PERIOD),
                                                   [this](const ros::WallTimerEvent&) { update(); });
}

void Health::update()
{
  // what left this function would end the nodelet manager with all its nodelets
  try
  {
    updater_.force_update();
  }
  catch (const std::exception& error)
  {
    warn("report failed", error.what());
  }
  catch (...)
  {
    warn("report failed", "an exception of an unknown type");
  }
}

void Health::count(const std::string& event)
{
  std::lock_guard<std::mutex> lock(mutex_);
  ++counts_[event];
}

void Health::frameDone(const ros::Time& stamp)
{
  std::lock_guard<std::mutex> lock(mutex_);
  ++counts_["frames"];
  latencies_.push_back((ros::Time::now() - stamp).toSec());
}

void Health::warn(const std::string& event, const std::string& text)
{
  const ros::WallTime now = ros::WallTime::now();
  const std::string said = event + ": " + shown(text);
  std::size_t number;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    number = ++counts_[event];
    last_warning_ = said;
    last_warning_time_ = now;
    ros::WallTime& warned = warned_[event];
    if ((now - warned).toSec() < WARNING_PERIOD)
      return;
    warned = now;
  }
  ROS_WARN_NAMED(name_, "%s: %s (number %zu of this kind)", name_.c_str(), said.c_str(), number);
}

void Health::show(const std::string& key, Text value)
{
  std::lock_guard<std::mutex> lock(mutex_);
  values_.emplace_back(key, std::move(value));
}

void Health::report(diagnostic_updater::DiagnosticStatusWrapper& status)
{
  std::lock_guard<std::mutex> lock(mutex_);
  const ros::WallTime now = ros::WallTime::now();
  const double rate = latencies_.size() / std::max((now - last_report_).toSec(), 1e-3);
  if ((now - last_warning_time_).toSec() <= WARNING_PERIOD)
    status.summary(diagnostic_msgs::DiagnosticStatus::WARN, last_warning_);
  else if (const std::string rest = why_resting_(); !rest.empty())
    status.summary(diagnostic_msgs::DiagnosticStatus::OK, rest);
  else
    status.summaryf(diagnostic_msgs::DiagnosticStatus::OK, "%.1f Hz", rate);
  if (const std::string fault = lasting_fault_(); !fault.empty())
    status.mergeSummary(diagnostic_msgs::DiagnosticStatus::WARN, shown(fault));
  status.addf("rate [Hz]", "%.1f", rate);
  if (!latencies_.empty())
  {
    std::nth_element(latencies_.begin(), latencies_.begin() + latencies_.size() / 2, latencies_.end());
    status.addf("latency, median [s]", "%.4f", latencies_[latencies_.size() / 2]);
  }
  for (const auto& [event, number] : counts_)
    status.add(event, number);
  for (const auto& [key, value] : values_)
    status.add(key, value());
  latencies_.clear();
  last_report_ = now;
}

}  // namespace openpose_ros_nodelets
