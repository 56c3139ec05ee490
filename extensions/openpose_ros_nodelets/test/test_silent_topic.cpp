// Why no message comes on a topic, by what the ROS master knows; the same texts as openpose_ros_pkg gives.
#include <gtest/gtest.h>

#include "inputs/silent_topic.h"

namespace openpose_ros_nodelets
{
namespace
{

const std::string CLOUD = "sensor_msgs/PointCloud2", IMAGE = "sensor_msgs/Image", TOPIC = "/camera/points";

std::string why(const std::map<std::string, PublishedTopic>& published, bool is_connected = true)
{
  return whySilent(TOPIC, CLOUD, published, is_connected, "/floor");
}

TEST(SilentTopic, nothingOfItsTypeIsPublished)
{
  EXPECT_EQ(why({}), "no node publishes it; no other topic of type " + CLOUD + " is published");
  // neither an own topic nor a result of this project is a camera's
  EXPECT_EQ(why({ { "/image", { IMAGE, { "/driver" } } },
                  { "/own", { CLOUD, { "/floor" } } },
                  { "/openpose_ros/skeleton_3d/input_pointcloud", { CLOUD, { "/extractor" } } } }),
            why({}));
}

TEST(SilentTopic, topicsOfItsTypeAreNamed)
{
  std::map<std::string, PublishedTopic> published;
  for (int i = 0; i < 10; ++i)
    published["/points" + std::to_string(i)] = { CLOUD, { "/driver" } };
  EXPECT_EQ(why(published), "no node publishes it; other topics of type " + CLOUD +
                                ": /points0, /points1, /points2, /points3, /points4, /points5, /points6, /points7 and "
                                "2 more");
}

TEST(SilentTopic, whyAPublishedTopicIsSilent)
{
  const std::string others = "; no other topic of type " + CLOUD + " is published";
  EXPECT_EQ(why({ { TOPIC, { CLOUD, { "/b", "/a" } } } }), "published by /a, /b, which sends nothing" + others);
  EXPECT_EQ(why({ { TOPIC, { IMAGE, { "/a" } } } }, false),
            "published as " + IMAGE + " by /a, but read as " + CLOUD + others);
  EXPECT_EQ(why({ { TOPIC, { CLOUD, { "/a" } } } }, false).find("published by /a, but there is no connection"), 0U);
}

TEST(SilentTopic, whySimulatedTimeStandsStill)
{
  EXPECT_NE(whyClockStands(0).find("nothing comes on /clock"), std::string::npos);
  EXPECT_EQ(whyClockStands(12.5).find("simulated time stands still at 12.500 s"), 0U);
}

}  // namespace
}  // namespace openpose_ros_nodelets

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
