#pragma once

#include <map>
#include <string>
#include <vector>

namespace openpose_ros_nodelets
{

/// What the ROS master knows of a topic that is published: its type, and the nodes that publish it.
struct PublishedTopic
{
  std::string kind;
  std::vector<std::string> nodes;
};

/// Return why `node` may get no message on a topic that it reads as type `kind`, and what is published instead. The
/// counterpart of openpose_ros_pkg/stream/silent_topic.py.
///
/// `published`: all topics that are published, by their names. `is_connected`: to a publisher of the topic.
std::string whySilent(const std::string& topic, const std::string& kind,
                      const std::map<std::string, PublishedTopic>& published, bool is_connected,
                      const std::string& node);

/// Return what may be wrong with a simulated time that stays the same [s]; 0: none has come.
std::string whyClockStands(double seconds);

}  // namespace openpose_ros_nodelets
