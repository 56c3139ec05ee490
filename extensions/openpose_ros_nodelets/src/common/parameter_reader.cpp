#include "openpose_ros_nodelets/common/parameter_reader.h"

#include <algorithm>
#include <sstream>

#include <boost/algorithm/string/predicate.hpp>
#include <ros/names.h>

namespace openpose_ros_nodelets
{
namespace
{

template <typename Range>
std::string joined(const Range& words)
{
  std::ostringstream text;
  for (const std::string& word : words)
    text << (text.tellp() > 0 ? ", " : "") << word;
  return text.str();
}

std::string shown(const ros::NodeHandle& handle, const std::string& key)
{
  XmlRpc::XmlRpcValue value;
  handle.getParam(key, value);
  std::ostringstream text;
  text << value;
  return text.str();
}

/// What to do about a wrong parameter that was not set on purpose: the server keeps those of nodes that have ended.
std::string howToDelete(const ros::NodeHandle& handle)
{
  return ". If it was not set on purpose, an earlier start left it: rosparam delete " + handle.getNamespace();
}

[[noreturn]] void refuse(const ros::NodeHandle& handle, const std::string& key, const std::string& allowed)
{
  throw ParameterError("parameter '" + key + "' = " + shown(handle, key) + " is not allowed: " + allowed +
                       howToDelete(handle));
}

template <typename Number>
std::string range(const std::string& type, Number least, Number greatest)
{
  std::ostringstream text;
  text << type << " in " << least << " .. " << greatest;
  return text.str();
}

}  // namespace

ParameterReader::ParameterReader(const ros::NodeHandle& private_handle)
  // read by nodelet_topic_tools::NodeletLazy
  : handle_(private_handle)
  , known_{ "lazy", "verbose_connection", "use_multithread_callback", "duration_to_warn_no_connection" }
{
}

bool ParameterReader::has(const std::string& key)
{
  known_.insert(key);
  return handle_.hasParam(key);
}

double ParameterReader::number(const std::string& key, double fallback, double least, double greatest)
{
  double value = fallback;
  if (has(key) && (!handle_.getParam(key, value) || !(value >= least && value <= greatest)))
    refuse(handle_, key, range("number", least, greatest));
  return value;
}

std::vector<double> ParameterReader::numbers(const std::string& key, const std::vector<double>& fallback)
{
  std::vector<double> values = fallback;
  if (has(key) && (!handle_.getParam(key, values) || values.size() != fallback.size()))
    refuse(handle_, key, "a list of " + std::to_string(fallback.size()) + " numbers");
  return values;
}

int ParameterReader::integer(const std::string& key, int fallback, int least, int greatest)
{
  XmlRpc::XmlRpcValue value;
  if (!has(key))
    return fallback;
  handle_.getParam(key, value);
  if (value.getType() != XmlRpc::XmlRpcValue::TypeInt || int(value) < least || int(value) > greatest)
    refuse(handle_, key, range("integer", least, greatest));
  return int(value);
}

bool ParameterReader::flag(const std::string& key, bool fallback)
{
  bool value = fallback;
  if (has(key) && !handle_.getParam(key, value))
    refuse(handle_, key, "true or false");
  return value;
}

std::string ParameterReader::text(const std::string& key, const std::string& fallback,
                                  const std::vector<std::string>& choices)
{
  std::string value = fallback;
  if (has(key) && !handle_.getParam(key, value))
    refuse(handle_, key, "text");
  if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end())
    refuse(handle_, key, "one of " + joined(choices));
  if (boost::algorithm::ends_with(key, "frame") && value.rfind('/', 0) == 0)
    value.erase(0, 1);
  return value;
}

void ParameterReader::refuseUnknown()
{
  std::vector<std::string> names;
  handle_.getParamNames(names);
  const std::string prefix = handle_.getNamespace() + "/";
  for (const std::string& name : names)
  {
    if (name.compare(0, prefix.size(), prefix) != 0)
      continue;
    std::string key = name.substr(prefix.size());
    key = key.substr(0, key.find('/'));
    if (known_.count(key) == 0)
      throw ParameterError("unknown parameter '" + key + "' = " + shown(handle_, key) +
                           "; allowed: " + joined(known_) + howToDelete(handle_));
  }
}

}  // namespace openpose_ros_nodelets
