#include "openpose_ros_nodelets/common/stream_nodelet.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <stdexcept>

#include <ros/master.h>
#include <tf2/exceptions.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"

namespace openpose_ros_nodelets
{
namespace
{

// An input without a message for this long is silent, in wall time; the log says so again after the latter [s].
constexpr double PATIENCE = 5.0, LOG_PERIOD = 60.0;
// Part of the names of this project's results, which take the place of no camera.
const std::string RESULTS = "/openpose_ros/";

/// Return why no message of a kind comes, and which other topics of that kind there are.
std::string whySilent(const ros::Subscriber& input, const std::string& kind,
                      const ros::master::V_TopicInfo& published)
{
  std::string why = "no node publishes it", others;
  for (const ros::master::TopicInfo& topic : published)
  {
    if (topic.name == input.getTopic())
      why = topic.datatype == kind ? "published by a node that can not be reached: check ROS_IP and ROS_HOSTNAME" :
                                     "published as " + topic.datatype + ", but read as " + kind;
    else if (topic.datatype == kind && topic.name.find(RESULTS) == std::string::npos)
      others += (others.empty() ? "" : ", ") + topic.name;
  }
  if (input.getNumPublishers() > 0)
    why = "published by " + std::to_string(input.getNumPublishers()) + " nodes, which send nothing";
  return why + (others.empty() ? "; no other topic of type " + kind + " is published" :
                                 "; other topics of type " + kind + ": " + others);
}

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
  std::vector<Input> silent;
  {
    std::lock_guard<std::mutex> lock(inputs_mutex_);
    std::copy_if(inputs_.begin(), inputs_.end(), std::back_inserter(silent),
                 [](const Input& input) { return now() - *input.arrival >= PATIENCE; });
  }
  if (silent.empty())
    return "";
  const bool tell = now() - told_ >= LOG_PERIOD;
  if (tell)
    ros::master::getTopics(published_);  // asks the master
  std::string text;
  for (const Input& input : silent)
    text += (text.empty() ? "" : "; ") + ("no message on " + input.subscriber.getTopic() + ": ") +
            whySilent(input.subscriber, input.kind, published_);
  if (tell)
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
