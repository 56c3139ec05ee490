#include "common/registration_watch.h"

#include <chrono>
#include <exception>

#include <ros/connection_manager.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/param.h>
#include <ros/publication.h>
#include <ros/ros.h>
#include <ros/service_manager.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpcClient.h>
#include <xmlrpcpp/XmlRpcException.h>

namespace openpose_ros_nodelets
{
namespace
{

using XmlRpc::XmlRpcValue;

// Period of looking, in wall time.
constexpr std::chrono::seconds PERIOD{ 1 };

/// Return a call's arguments: the name of this node, then these.
template <typename... Arguments>
XmlRpcValue request(const Arguments&... arguments)
{
  XmlRpcValue values;
  int i = 0;
  values[i++] = ros::this_node::getName();
  ((values[i++] = XmlRpcValue(arguments)), ...);
  return values;
}

/// Call the master without waiting for one; return whether it did what it was asked for.
bool call(const std::string& method, const XmlRpcValue& arguments, XmlRpcValue& response, XmlRpcValue& value)
{
  return ros::master::execute(method, arguments, response, value, false);
}

std::string serviceUri()
{
  return "rosrpc://" + ros::network::getHost() + ":" + std::to_string(ros::ConnectionManager::instance()->getTCPPort());
}

/// Tell this node who publishes on a topic, as the master does.
void updatePublishers(const std::string& topic, const XmlRpcValue& publishers)
{
  const ros::XMLRPCManagerPtr& manager = ros::XMLRPCManager::instance();
  std::string host;
  std::uint32_t port;
  if (!ros::network::splitURI(manager->getServerURI(), host, port))
    return;
  XmlRpc::XmlRpcClient* client = manager->getXMLRPCClient(host, int(port), "/");
  XmlRpcValue result;
  client->execute("publisherUpdate", request(topic, publishers), result);
  manager->releaseXMLRPCClient(client);
}

}  // namespace

std::shared_ptr<RegistrationWatch> RegistrationWatch::ofProcess()
{
  static std::mutex mutex;
  static std::weak_ptr<RegistrationWatch> existing;
  std::lock_guard<std::mutex> lock(mutex);
  std::shared_ptr<RegistrationWatch> watch = existing.lock();
  if (!watch)
    existing = watch = std::make_shared<RegistrationWatch>();
  return watch;
}

RegistrationWatch::RegistrationWatch() : thread_(&RegistrationWatch::keepLooking, this)
{
}

RegistrationWatch::~RegistrationWatch()
{
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void RegistrationWatch::keepParameters(const std::string& name)
{
  XmlRpcValue values;
  ros::param::get(name, values);
  std::lock_guard<std::mutex> lock(mutex_);
  parameters_[name] = values;
}

void RegistrationWatch::keepLooking()
{
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ended_.wait_for(lock, PERIOD, [this] { return ends_; }))
    if (ros::ok())
      lookSafely();
}

void RegistrationWatch::lookSafely()
{
  // what left a thread would end the nodelet manager with all its nodelets
  try
  {
    look();
  }
  catch (const XmlRpc::XmlRpcException& error)
  {
    ROS_WARN_THROTTLE(5.0, "the ROS master answered with nonsense: %s", error.getMessage().c_str());
  }
  catch (const std::exception& error)
  {
    ROS_WARN_THROTTLE(5.0, "looking whether this node is registered failed: %s", error.what());
  }
}

void RegistrationWatch::look()
{
  XmlRpcValue response, uri;
  // every node has this service, and the master forgets all of a node at once
  const bool found = call("lookupService", request(ros::this_node::getName() + "/get_loggers"), response, uri);
  if (!found && response.getType() != XmlRpcValue::TypeArray)
  {
    if (is_reachable_)
      ROS_ERROR("the ROS master %s does not answer", ros::master::getURI().c_str());
    is_reachable_ = false;
    return;
  }
  is_reachable_ = true;
  if (found && std::string(uri) == serviceUri())
    return remember();
  if (!ros::ok())
    return;
  registerAll();
  ROS_WARN("registered anew: the ROS master was restarted or has forgotten this node");
}

void RegistrationWatch::remember()
{
  XmlRpcValue response, state;
  if (!call("getSystemState", request(), response, state))
    return;
  services_.clear();
  XmlRpcValue& all = state[2];
  for (int i = 0; i < all.size(); ++i)
    for (int j = 0; j < all[i][1].size(); ++j)
      if (std::string(all[i][1][j]) == ros::this_node::getName())
        services_.push_back(all[i][0]);
}

void RegistrationWatch::registerAll()
{
  const std::string me = ros::XMLRPCManager::instance()->getServerURI();
  XmlRpcValue response, value;
  std::vector<std::string> topics;
  ros::TopicManager::instance()->getAdvertisedTopics(topics);
  for (const std::string& topic : topics)
    if (const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic))
      call("registerPublisher", request(topic, publication->getDataType(), me), response, value);
  topics.clear();
  ros::TopicManager::instance()->getSubscribedTopics(topics);
  for (const std::string& topic : topics)
    // who publishes but has not registered anew stays connected until another one does
    if (call("registerSubscriber", request(topic, std::string("*"), me), response, value) && value.size() > 0)
      updatePublishers(topic, value);
  for (const std::string& service : services_)
    if (ros::ServiceManager::instance()->lookupServicePublication(service))
      call("registerService", request(service, serviceUri(), me), response, value);
  for (const auto& [name, values] : parameters_)
    if (values.getType() == XmlRpcValue::TypeStruct && !ros::param::has(name))
      ros::param::set(name, values);
}

}  // namespace openpose_ros_nodelets
