// A program that runs one nodelet: OPENPOSE_ROS_NODELET is its type, OPENPOSE_ROS_NODE the default name of the node.
#include <exception>

#include <nodelet/loader.h>
#include <ros/ros.h>

int main(int argc, char** argv)
{
  ros::init(argc, argv, OPENPOSE_ROS_NODE);
  ros::NodeHandle handle;  // keeps the node up when the nodelet could not be made
  nodelet::Loader loader;
  nodelet::V_string arguments;
  for (int index = 1; index < argc; ++index)
    arguments.emplace_back(argv[index]);
  bool loaded = false;
  try
  {
    loaded = loader.load(ros::this_node::getName(), OPENPOSE_ROS_NODELET, ros::names::getRemappings(), arguments);
  }
  catch (const std::exception&)
  {
    // the nodelet has said why
  }
  if (!loaded)
  {
    ROS_FATAL("%s could not be started", OPENPOSE_ROS_NODELET);
    return 1;
  }
  ros::spin();
  return 0;
}
