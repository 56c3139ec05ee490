#include "inputs/input_watch.h"

#include <chrono>
#include <map>

#include <ros/master.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include "inputs/silent_topic.h"

namespace openpose_ros_nodelets
{
namespace
{

using XmlRpc::XmlRpcValue;

// An input without a message for this long is silent, in wall time [s].
constexpr double PATIENCE = 5.0;
// Period of asking the master again while an input is silent; of telling it again in the log [s].
constexpr double REFRESH_PERIOD = 5.0, LOG_PERIOD = 60.0;

/// Call the master without waiting for one; return whether it answered.
bool call(const std::string& method, XmlRpcValue& value)
{
  XmlRpcValue request, response;
  request[0] = ros::this_node::getName();
  return ros::master::execute(method, request, response, value, false);
}

/// Ask for all topics that are published; return whether the master answered.
bool publishedTopics(std::map<std::string, PublishedTopic>& topics)
{
  XmlRpcValue state, types;
  if (!call("getSystemState", state) || !call("getTopicTypes", types))
    return false;
  XmlRpcValue& publishers = state[0];
  for (int i = 0; i < publishers.size(); ++i)
    for (int j = 0; j < publishers[i][1].size(); ++j)
      topics[publishers[i][0]].nodes.push_back(publishers[i][1][j]);
  for (int i = 0; i < types.size(); ++i)
    if (const auto topic = topics.find(types[i][0]); topic != topics.end())
      topic->second.kind = std::string(types[i][1]);
  return true;
}

}  // namespace

InputWatch::InputWatch(const std::string& name) : name_(name), thread_([this] { look(); })
{
}

double InputWatch::now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void InputWatch::add(const ros::Subscriber& subscriber, const std::string& kind, const Time& arrival)
{
  std::lock_guard<std::mutex> lock(mutex_);
  inputs_.push_back(std::make_shared<Input>(Input{ subscriber, kind, arrival, 0, "" }));
}

void InputWatch::clear()
{
  std::lock_guard<std::mutex> lock(mutex_);
  inputs_.clear();
}

void InputWatch::look()
{
  if (ros::Time::now() != clock_)
  {
    clock_ = ros::Time::now();
    clock_since_ = now();
  }
  std::vector<std::shared_ptr<Input>> silent;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const std::shared_ptr<Input>& input : inputs_)
      if (now() - *input->arrival >= PATIENCE)
        silent.push_back(input);
      else
        input->fault.clear();
  }
  const bool is_due = now() - asked_ >= REFRESH_PERIOD;
  for (const std::shared_ptr<Input>& input : silent)
  {
    if (!is_due && !input->fault.empty())
      continue;
    asked_ = now();
    const std::string fault = "no message on " + input->subscriber.getTopic() + ": " + whySilentNow(*input);
    if (input->told == 0 || now() - input->told >= LOG_PERIOD)
    {
      ROS_WARN_NAMED(name_, "%s: %s", name_.c_str(), fault.c_str());
      input->told = now();
    }
    std::lock_guard<std::mutex> lock(mutex_);
    input->fault = fault;
  }
}

std::string InputWatch::whySilentNow(const Input& input) const
{
  std::string clock;
  if (ros::Time::isSimTime() && now() - clock_since_ >= PATIENCE)
    clock = whyClockStands(clock_.toSec()) + "; ";
  std::map<std::string, PublishedTopic> topics;
  if (!publishedTopics(topics))
    return clock + "the ROS master " + ros::master::getURI() + " does not answer";
  return clock + whySilent(input.subscriber.getTopic(), input.kind, topics, input.subscriber.getNumPublishers() > 0,
                           ros::this_node::getName());
}

std::string InputWatch::faults()
{
  std::lock_guard<std::mutex> lock(mutex_);
  std::string text;
  for (const std::shared_ptr<Input>& input : inputs_)
    if (!input->fault.empty())
      text += (text.empty() ? "" : "; ") + input->fault;
  return text;
}

}  // namespace openpose_ros_nodelets
