// A program that runs one nodelet: OPENPOSE_ROS_NODELET is its name, as in nodelets.xml and in config/.
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <string>

#include <nodelet/loader.h>
#include <nodelet/nodelet.h>
#include <pluginlib/class_loader.hpp>
#include <ros/ros.h>

#include "openpose_ros_nodelets/common/master_watch.h"

namespace
{

const std::string NODELET = OPENPOSE_ROS_NODELET;
const std::string CLASS = "openpose_ros_nodelets/" + NODELET;

/// Print what the nodelet does, how to start it, and its parameters; needs no master.
void showHelp()
{
  pluginlib::ClassLoader<nodelet::Nodelet> classes("nodelet", "nodelet::Nodelet");
  const std::string manifest = classes.getPluginManifestPath(CLASS);
  std::ifstream parameters(manifest.substr(0, manifest.rfind('/')) + "/config/" + NODELET + ".yaml");
  std::cout << classes.getClassDescription(CLASS) << "\n\nusage: rosrun openpose_ros_nodelets " << NODELET
            << "_node [_PARAMETER:=VALUE] [TOPIC:=TOPIC]\n\n" << parameters.rdbuf();
}

/// Answer an argument that is not of ROS; return the exit status.
int answer(const char* argument)
{
  if (std::strcmp(argument, "--help") == 0 || std::strcmp(argument, "-help") == 0 || std::strcmp(argument, "-h") == 0)
  {
    showHelp();
    return 0;
  }
  std::cerr << NODELET << "_node: argument '" << argument
            << "' is not allowed: parameters are set as _NAME:=VALUE; --help lists them\n";
  return 1;
}

/// Wait for a signal where roslaunch would start the node again: it would end for the same reason, or, as a new master
/// knows none of its parameters, work with the default ones.
void restIfRespawned()
{
  ros::shutdown();
  if (std::getenv("OPENPOSE_ROS_RESPAWNS"))
    pause();
}

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, NODELET);  // takes ROS' own arguments out
  if (argc > 1)
    return answer(argv[1]);
  ros::NodeHandle handle;  // keeps the node up when the nodelet could not be made
  nodelet::Loader loader;
  bool loaded = false;
  try
  {
    loaded = loader.load(ros::this_node::getName(), CLASS, ros::names::getRemappings(), {});
  }
  catch (const std::exception&)
  {
    // the nodelet has said why
  }
  if (!loaded)
  {
    ROS_FATAL("nodelet %s could not be started", NODELET.c_str());
    restIfRespawned();
    return 1;
  }
  ros::spin();
  if (!openpose_ros_nodelets::MasterWatch::isReplaced())
    return 0;
  restIfRespawned();
  return 1;
}
