#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <openpose_ros_msgs/joints.h>
#include <ros/ros.h>

void print(const openpose_ros_msgs::PersonDetection_3dArray::ConstPtr& people)
{
  for (const auto& person : people->persons)
    for (const openpose_ros_msgs::Joint joint : openpose_ros_msgs::ALL_JOINTS)
    {
      const auto& part = openpose_ros_msgs::partOf(person, joint);
      if (openpose_ros_msgs::isKnown(part))
        ROS_INFO("person %u: %s at %.2f, %.2f, %.2f m, %s, sigma %.2f m", person.person_ID,
                 openpose_ros_msgs::nameOf(joint), part.x, part.y, part.z, openpose_ros_msgs::statusOf(part), part.sigma);
    }
}

int main(int argc, char** argv)
{
  ros::init(argc, argv, "reader");
  ros::NodeHandle handle;
  const ros::Subscriber subscriber = handle.subscribe("openpose_ros/skeleton_3d/detected_poses_3d", 1, print);
  ros::spin();
}
