#include "common/stream_nodelet.h"

#include <algorithm>
#include <stdexcept>

namespace openpose_ros_nodelets
{

void StreamNodelet::onInit()
{
  nodelet_topic_tools::NodeletLazy::onInit();
  timer_ever_subscribed_.stop();  // being lazy is no reason for a warning
  input_watch_ = std::make_unique<InputWatch>(getName());
  health_ = std::make_unique<Health>(*nh_, *pnh_, getName());
  health_->showLasting([this] { return input_watch_->faults(); });
  health_->show("enabled", [this] { return enabled_ ? "true" : "false"; });
  health_->explainRest([this]() -> std::string {
    if (isWanted())
      return "";
    return enabled_ ? "idle: nobody listens" : "disabled";
  });
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
    input_watch_.reset();
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
    input_watch_->clear();
  }
  connection_status_ = wanted ? nodelet_topic_tools::SUBSCRIBED : nodelet_topic_tools::NOT_SUBSCRIBED;
}

}  // namespace openpose_ros_nodelets
