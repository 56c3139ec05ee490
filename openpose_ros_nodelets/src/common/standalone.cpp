// A program that runs one nodelet: OPENPOSE_ROS_NODELET is its name, as in nodelets.xml and in config/.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include <nodelet/loader.h>
#include <ros/ros.h>

namespace
{

const std::string NODELET = OPENPOSE_ROS_NODELET;

/// Tell how to start the program; return its exit status, which is 0 for --help.
int showUsage(const char* argument)
{
  std::printf("usage: rosrun openpose_ros_nodelets %s_node [_PARAMETER:=VALUE] [TOPIC:=TOPIC]\n"
              "Parameters and what they do: config/%s.yaml of the package openpose_ros_nodelets.\n",
              NODELET.c_str(), NODELET.c_str());
  if (std::strcmp(argument, "--help") == 0 || std::strcmp(argument, "-h") == 0)
    return 0;
  std::fprintf(stderr, "unknown argument: %s\n", argument);
  return 2;
}

}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, NODELET);  // takes ROS' own arguments out
  if (argc > 1)
    return showUsage(argv[1]);
  ros::NodeHandle handle;  // keeps the node up when the nodelet could not be made
  nodelet::Loader loader;
  bool loaded = false;
  try
  {
    loaded = loader.load(ros::this_node::getName(), "openpose_ros_nodelets/" + NODELET, ros::names::getRemappings(), {});
  }
  catch (const std::exception&)
  {
    // the nodelet has said why
  }
  if (!loaded)
  {
    ROS_FATAL("nodelet %s could not be started", NODELET.c_str());
    ros::shutdown();
    if (std::getenv("OPENPOSE_ROS_RESPAWNS"))  // started again, it would end for the same reason, without end
      pause();
    return 1;
  }
  ros::spin();
  return 0;
}
