#pragma once

#include <atomic>
#include <memory>

#include <nodelet_topic_tools/nodelet_lazy.h>
#include <std_srvs/SetBool.h>

#include "common/health.h"
#include "inputs/master_watch.h"
#include "common/parameter_reader.h"
#include "inputs/input_watch.h"

namespace openpose_ros_nodelets
{

/// A nodelet between topics: subscribes to its inputs only while there are subscribers (~lazy) and while it is enabled
/// (service ~enable), counts its faults, and refuses parameters that it does not know.
///
/// A nodelet derives from it, reads its parameters in `configure`, advertises with `NodeletLazy::advertise`, and
/// subscribes (with `listen`) and unsubscribes in the functions of these names. One that publishes in another way calls `update` when
/// subscribers come and go, counts them in `isHeard`, and ends its publishers in `shutdown`.
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
  ros::Subscriber listen(const std::string& topic, int queue_size, const InputWatch::Callback<Message>& callback,
                         bool once = false)
  {
    return input_watch_->subscribe<Message>(*nh_, topic, queue_size, callback, once);
  }

  Health& health()
  {
    return *health_;
  }

private:
  void onInit() override;
  void connectionCallback(const ros::SingleSubscriberPublisher& publisher) override;
  bool enable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool isWanted() const;

  std::atomic<bool> enabled_{ true };
  std::unique_ptr<InputWatch> input_watch_;
  std::unique_ptr<Health> health_;  ///< shows what the watch tells
  std::shared_ptr<MasterWatch> master_watch_;
  ros::ServiceServer enable_service_;
};

}  // namespace openpose_ros_nodelets
