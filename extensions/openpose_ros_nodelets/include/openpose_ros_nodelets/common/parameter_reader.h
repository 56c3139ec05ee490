#pragma once

#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/node_handle.h>

namespace openpose_ros_nodelets
{

/// A parameter of the user is not allowed; the text names key, value and what is allowed.
class ParameterError : public std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// Reads private parameters, each with its default and what is allowed, and refuses unknown ones.
class ParameterReader
{
public:
  explicit ParameterReader(const ros::NodeHandle& private_handle);

  /// Return a number; integers are taken as well. Throws ParameterError.
  double number(const std::string& key, double fallback, double least, double greatest);

  /// Return as many numbers as the default has. Throws ParameterError.
  std::vector<double> numbers(const std::string& key, const std::vector<double>& fallback);

  /// Throws ParameterError.
  int integer(const std::string& key, int fallback, int least = std::numeric_limits<int>::min(),
              int greatest = std::numeric_limits<int>::max());

  /// Throws ParameterError.
  bool flag(const std::string& key, bool fallback);

  /// Return a text, one of `choices` unless these are empty; of keys that end in "frame" without a leading slash.
  /// Throws ParameterError.
  std::string text(const std::string& key, const std::string& fallback, const std::vector<std::string>& choices = {});

  /// Throw ParameterError for a key in the private namespace that was not read until now. Call it last.
  void refuseUnknown();

private:
  /// Note that a key is known; return whether it is set.
  bool has(const std::string& key);

  ros::NodeHandle handle_;
  std::set<std::string> known_;
};

}  // namespace openpose_ros_nodelets
