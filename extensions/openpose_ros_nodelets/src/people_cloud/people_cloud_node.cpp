// The nodelet people_cloud as a program.
#include <cstring>
#include <iostream>

#include <nodelet/loader.h>
#include <ros/ros.h>

int main(int argc, char** argv)
{
  ros::init(argc, argv, "people_cloud");  // takes ROS' own arguments out
  if (argc > 1)
  {
    std::cout << "Organized cloud and people to the cloud with a label per point, and the cloud without people.\n\n"
                 "usage: rosrun openpose_ros_nodelets people_cloud_node [_PARAMETER:=VALUE] [TOPIC:=TOPIC]\n\n"
                 "Parameters: see config/people_cloud.yaml of this package.\n";
    return std::strcmp(argv[1], "--help") != 0 && std::strcmp(argv[1], "-h") != 0;
  }
  ros::NodeHandle handle;  // keeps the node up when the nodelet could not be made
  nodelet::Loader loader;
  if (!loader.load(ros::this_node::getName(), "openpose_ros_nodelets/people_cloud", ros::names::getRemappings(), {}))
    return 1;
  ros::spin();
  return 0;
}
