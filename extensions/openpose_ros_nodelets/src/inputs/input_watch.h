#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "common/repeated.h"

namespace openpose_ros_nodelets
{

/// Logs which inputs of a nodelet are silent and why, seldom, and keeps its status at WARN while they are. The
/// counterpart of openpose_ros_pkg/ros/input_watch.py.
class InputWatch
{
public:
  template <typename Message>
  using Callback = std::function<void(const boost::shared_ptr<Message const>&)>;

  /// `name`: of the nodelet, for the log.
  explicit InputWatch(const std::string& name);

  /// Subscribe to an input without whose messages the nodelet gives no results. `once`: one message suffices.
  template <typename Message>
  ros::Subscriber subscribe(ros::NodeHandle& handle, const std::string& topic, int queue_size,
                            const Callback<Message>& callback, bool once = false)
  {
    const auto arrival = std::make_shared<std::atomic<double>>(now());
    const boost::function<void(const boost::shared_ptr<Message const>&)> noting =
        [arrival, callback, once](const boost::shared_ptr<Message const>& message) {
          *arrival = once ? std::numeric_limits<double>::infinity() : now();
          callback(message);
        };
    const ros::Subscriber subscriber = handle.subscribe<Message>(topic, queue_size, noting);
    add(subscriber, ros::message_traits::datatype<Message>(), arrival);
    return subscriber;
  }

  /// Wait for no message any more; to be called when the nodelet unsubscribes.
  void clear();

  /// Return which inputs are silent, and why; empty: none.
  std::string faults();

private:
  using Time = std::shared_ptr<std::atomic<double>>;

  struct Input
  {
    ros::Subscriber subscriber;
    std::string kind;
    Time arrival;       ///< of the newest message; before the first, of the subscription [s]
    double told;        ///< when the log said that it is silent; 0: it never did [s]
    std::string fault;  ///< why it is silent; empty: it is not
  };

  static double now();  ///< [s], of a clock that is never set
  void add(const ros::Subscriber& subscriber, const std::string& kind, const Time& arrival);
  void look();
  std::string whySilentNow(const Input& input) const;

  const std::string name_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<Input>> inputs_;
  ros::Time clock_;         ///< as last seen
  double clock_since_ = 0;  ///< since when it is that [s]
  double asked_ = 0;        ///< when the master was asked [s]
  Repeated thread_;         ///< calls `look`
};

}  // namespace openpose_ros_nodelets
