#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <boost/make_shared.hpp>
#include <nodelet_topic_tools/nodelet_lazy.h>
#include <ros/master.h>
#include <std_srvs/SetBool.h>

#include "openpose_ros_nodelets/common/health.h"
#include "openpose_ros_nodelets/common/master_watch.h"
#include "openpose_ros_nodelets/common/parameter_reader.h"

namespace openpose_ros_nodelets
{

/// Return a message whose frame has no leading slash, which tf allowed and tf2 refuses.
template <typename Message>
boost::shared_ptr<Message const> withoutSlash(const boost::shared_ptr<Message const>& message)
{
  if (message->header.frame_id.rfind('/', 0) != 0)
    return message;
  const auto changed = boost::make_shared<Message>(*message);
  changed->header.frame_id.erase(0, 1);
  return changed;
}

/// A nodelet between topics: subscribes to its inputs only while there are subscribers (~lazy) and while it is enabled
/// (service ~enable), counts its faults, says which inputs are silent, and refuses parameters that it does not know.
///
/// A nodelet derives from it, reads its parameters in `configure`, advertises with `NodeletLazy::advertise`, and
/// subscribes (with `listen`) and unsubscribes in the functions of these names. One that publishes in another way calls
/// `update` when subscribers come and go, counts them in `isHeard`, and ends its publishers in `shutdown`.
class StreamNodelet : public nodelet_topic_tools::NodeletLazy
{
protected:
  /// Read all parameters, then advertise. Throws ParameterError for what the user has to mend.
  virtual void configure(ParameterReader& parameters) = 0;

  /// Tell whether there are subscribers to a result.
  virtual bool isHeard() const;

  /// End all publishers.
  virtual void shutdown();

  /// Subscribe to the inputs if the results are wanted, else unsubscribe.
  void update();

  /// Subscribe to an input without whose messages there are no results: it is told while it is silent. `once`: one
  /// message suffices.
  template <typename Message>
  ros::Subscriber listen(const std::string& topic, int queue_size,
                         const std::function<void(const boost::shared_ptr<Message const>&)>& callback,
                         bool once = false)
  {
    const auto arrival = std::make_shared<std::atomic<double>>(now());
    const boost::function<void(const boost::shared_ptr<Message const>&)> noting =
        [arrival, callback, once](const boost::shared_ptr<Message const>& message) {
          *arrival = once ? std::numeric_limits<double>::infinity() : now();
          callback(withoutSlash(message));
        };
    const ros::Subscriber subscriber = nh_->subscribe<Message>(topic, queue_size, noting);
    std::lock_guard<std::mutex> lock(inputs_mutex_);
    inputs_.push_back({ subscriber, ros::message_traits::datatype<Message>(), arrival });
    return subscriber;
  }

  /// Convert the message of a stamp, and count that, or why it can not be used.
  void convertFrame(const ros::Time& stamp, const std::function<void()>& convert);

  Health& health()
  {
    return *health_;
  }

private:
  struct Input
  {
    ros::Subscriber subscriber;
    std::string kind;
    std::shared_ptr<std::atomic<double>> arrival;  ///< of the newest message; before the first, of the subscription [s]
  };

  void onInit() override;
  void connectionCallback(const ros::SingleSubscriberPublisher& publisher) override;
  bool enable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool isWanted() const;
  /// Return which inputs are silent; empty: none.
  std::string silentInputs();
  static double now();  ///< [s], of a clock that is never set

  std::atomic<bool> enabled_{ true };
  std::mutex inputs_mutex_;
  std::vector<Input> inputs_;
  ros::master::V_TopicInfo published_;  ///< when the log said that inputs are silent
  double told_ = -std::numeric_limits<double>::infinity();  ///< the time of that [s]
  std::unique_ptr<Health> health_;
  std::shared_ptr<MasterWatch> master_watch_;
  ros::ServiceServer enable_service_;
};

}  // namespace openpose_ros_nodelets
