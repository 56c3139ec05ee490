#include "common/stream_nodelet.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include <tf2/exceptions.h>

#include "common/organized_cloud.h"

namespace openpose_ros_nodelets
{
namespace
{

// An input without a message for this long is silent, in wall time; the log says so again after the latter [s].
constexpr double PATIENCE = 5.0, LOG_PERIOD = 60.0;

}  // namespace

void StreamNodelet::onInit()
{
  nodelet_topic_tools::NodeletLazy::onInit();
  timer_ever_subscribed_.stop();  // being lazy is no reason for a warning
  const auto why_resting = [this] {
    return std::string(isWanted() ? "" : enabled_ ? "idle: no subscriber" : "disabled");
  };
  health_ = std::make_unique<Health>(*nh_, *pnh_, getName(), why_resting, [this] { return silentInputs(); });
  health_->show("enabled", [this] { return enabled_ ? "true" : "false"; });
  ParameterReader parameters(*pnh_);
  try
  {
    configure(parameters);
    parameters.refuseUnknown();
  }
  catch (const ParameterError& error)
  {
    NODELET_FATAL("%s: %s", getName().c_str(), error.what());
    // The loader frees the callback queues, then the nodelet and its library, and catches the exception thereafter: end
    // now what uses a queue, and throw a type that stays.
    shutdown();
    health_.reset();
    throw std::runtime_error(error.what());
  }
  enable_service_ = pnh_->advertiseService("enable", &StreamNodelet::enable, this);
  master_watch_ = MasterWatch::ofProcess();
  update();
}

void StreamNodelet::connectionCallback(const ros::SingleSubscriberPublisher&)
{
  update();
}

bool StreamNodelet::enable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response)
{
  {
    boost::mutex::scoped_lock lock(connection_mutex_);
    enabled_ = request.data;
  }
  update();
  response.success = true;
  response.message = request.data ? "enabled" : "disabled";
  return true;
}

bool StreamNodelet::isHeard() const
{
  return std::any_of(publishers_.begin(), publishers_.end(),
                     [](const ros::Publisher& publisher) { return publisher.getNumSubscribers() > 0; });
}

void StreamNodelet::shutdown()
{
  for (ros::Publisher& publisher : publishers_)
    publisher.shutdown();
}

void StreamNodelet::convertFrame(const ros::Time& stamp, const std::function<void()>& convert)
{
  try
  {
    convert();
    health_->frameDone(stamp);
  }
  catch (const BadInputError& error)
  {
    health_->warn("bad clouds", error.what());
  }
  catch (const tf2::TransformException& error)
  {
    health_->warn("no transform", error.what());
  }
}

double StreamNodelet::now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string StreamNodelet::silentInputs()
{
  std::lock_guard<std::mutex> lock(inputs_mutex_);
  std::string text;
  for (const Input& input : inputs_)
  {
    if (now() - *input.arrival < PATIENCE)
      continue;
    const uint32_t publishers = input.subscriber.getNumPublishers();
    text += (text.empty() ? "" : "; ") + ("no message on " + input.subscriber.getTopic() + ": ") +
            (publishers == 0 ? "no node publishes it as " + input.kind + ", or none that can be reached" :
                               "published by " + std::to_string(publishers) + " nodes, which send nothing");
  }
  if (!text.empty() && now() - told_ >= LOG_PERIOD)
  {
    ROS_WARN_NAMED(getName(), "%s: %s", getName().c_str(), text.c_str());
    told_ = now();
  }
  return text;
}

bool StreamNodelet::isWanted() const
{
  return enabled_ && (!lazy_ || isHeard());
}

void StreamNodelet::update()
{
  boost::mutex::scoped_lock lock(connection_mutex_);
  const bool wanted = isWanted();
  if (wanted == (connection_status_ == nodelet_topic_tools::SUBSCRIBED))
    return;
  if (wanted)
    subscribe();
  else
  {
    unsubscribe();
    std::lock_guard<std::mutex> inputs_lock(inputs_mutex_);
    inputs_.clear();
  }
  connection_status_ = wanted ? nodelet_topic_tools::SUBSCRIBED : nodelet_topic_tools::NOT_SUBSCRIBED;
}

}  // namespace openpose_ros_nodelets
