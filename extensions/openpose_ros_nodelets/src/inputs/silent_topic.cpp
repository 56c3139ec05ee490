#include "inputs/silent_topic.h"

#include <algorithm>
#include <cctype>
#include <cstdio>

namespace openpose_ros_nodelets
{
namespace
{

// Topics of the same type and nodes that are named; of the others the number is told.
constexpr std::size_t NAMED_TOPICS = 8, NAMED_NODES = 3;
// Part of the names of this project's results, which take the place of no camera.
const std::string RESULTS = "/openpose_ros/";

std::string listed(const std::vector<std::string>& names, std::size_t most)
{
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), most); ++i)
    text += (i ? ", " : "") + names[i];
  return names.size() > most ? text + " and " + std::to_string(names.size() - most) + " more" : text;
}

bool isResult(const std::string& topic)
{
  return topic.find(RESULTS) != std::string::npos;
}

std::string whyNothingComes(const PublishedTopic& there, const std::string& kind, bool is_connected)
{
  std::vector<std::string> nodes = there.nodes;
  std::sort(nodes.begin(), nodes.end());
  const std::string by = " by " + listed(nodes, NAMED_NODES);
  if (there.kind != kind)
    return "published as " + there.kind + by + ", but read as " + kind;
  if (!is_connected)
    return "published" + by + ", but there is no connection: does the node still run, and do ROS_IP or ROS_HOSTNAME "
                              "name its machine?";
  return "published" + by + ", which sends nothing";
}

}  // namespace

std::string whySilent(const std::string& topic, const std::string& kind,
                      const std::map<std::string, PublishedTopic>& published, bool is_connected,
                      const std::string& node)
{
  const auto there = published.find(topic);
  const std::string why =
      there == published.end() ? "no node publishes it" : whyNothingComes(there->second, kind, is_connected);
  std::vector<std::string> others;
  for (const auto& [name, other] : published)
    if (other.kind == kind && name != topic && other.nodes != std::vector<std::string>{ node } &&
        (isResult(topic) || !isResult(name)))
      others.push_back(name);
  std::string text = why + (others.empty() ? "; no other topic of type " + kind + " is published" :
                                             "; other topics of type " + kind + ": " + listed(others, NAMED_TOPICS));
  // others choose the names: no character controls a terminal
  std::replace_if(
      text.begin(), text.end(), [](unsigned char each) { return !std::isprint(each); }, '?');
  return text;
}

std::string whyClockStands(double seconds)
{
  if (seconds == 0)
    return "use_sim_time is true, but nothing comes on /clock: play with rosbag play --clock, or rosparam set "
           "use_sim_time false and start the nodes again";
  char text[100];
  std::snprintf(text, sizeof(text), "simulated time stands still at %.3f s: what publishes /clock is paused or has ended",
                seconds);
  return text;
}

}  // namespace openpose_ros_nodelets
