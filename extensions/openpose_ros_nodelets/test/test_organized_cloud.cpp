// Clouds are read where their fields say, and refused where they can not be used.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"

using openpose_ros_nodelets::BadInputError;
using openpose_ros_nodelets::OrganizedCloud;

namespace
{

/// Return a cloud of 4 x 3 points whose coordinates tell column, row and their sum.
sensor_msgs::PointCloud2 makeCloud()
{
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(12);
  cloud.width = 4;
  cloud.height = 3;
  cloud.row_step = 4 * cloud.point_step;
  sensor_msgs::PointCloud2Iterator<float> point(cloud, "x");
  for (int i = 0; i < 12; ++i, ++point)
  {
    point[0] = i % 4;
    point[1] = i / 4;
    point[2] = i % 4 + i / 4;
  }
  return cloud;
}

/// Return why a cloud with this depth everywhere is no depth; empty: it is.
std::string doubtOf(float depth)
{
  sensor_msgs::PointCloud2 message = makeCloud();
  for (sensor_msgs::PointCloud2Iterator<float> z(message, "z"); z != z.end(); ++z)
    *z = depth;
  try
  {
    openpose_ros_nodelets::requireDepth(OrganizedCloud(message));
  }
  catch (const BadInputError& error)
  {
    return error.what();
  }
  return "";
}

std::string refusalOf(const sensor_msgs::PointCloud2& cloud)
{
  try
  {
    OrganizedCloud{ cloud };
  }
  catch (const BadInputError& error)
  {
    return error.what();
  }
  return "";
}

}  // namespace

TEST(DepthCheck, TakesMetresAlone)
{
  EXPECT_EQ(doubtOf(0.3f), "");
  EXPECT_EQ(doubtOf(12.0f), "");
  for (const float missing : { 0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(),
                               std::numeric_limits<float>::infinity() })
    EXPECT_NE(doubtOf(missing).find("no valid point"), std::string::npos) << missing;
  EXPECT_EQ(doubtOf(3000.0f), "cloud has a median depth of 3000 m, expected 0.05 to 60 m: is it in millimetres?");
  for (const float other : { 1e30f, 1e-3f, 1e-42f })
    EXPECT_NE(doubtOf(other).find("median depth"), std::string::npos) << other;
}

TEST(OrganizedCloud, ReadsCoordinatesWhereTheFieldsAre)
{
  sensor_msgs::PointCloud2 message = makeCloud();
  std::swap(message.fields[0].name, message.fields[1].name);
  const OrganizedCloud cloud(message);
  EXPECT_EQ(cloud.width(), 4u);
  EXPECT_EQ(cloud.height(), 3u);
  EXPECT_EQ(cloud.x(3, 1), 1.0f);
  EXPECT_EQ(cloud.y(3, 1), 3.0f);
  EXPECT_EQ(cloud.z(3, 1), 4.0f);
}

TEST(OrganizedCloud, RefusesWhatItCanNotRead)
{
  using Change = std::function<void(sensor_msgs::PointCloud2&)>;
  const std::vector<std::pair<Change, std::string>> bad = {
    { [](auto& cloud) { cloud = sensor_msgs::PointCloud2(); }, "no field 'x'" },
    { [](auto& cloud) { cloud.width = 12, cloud.height = 1, cloud.row_step = 384; }, "not organized: it has 12 x 1 points" },
    { [](auto& cloud) { cloud.fields.resize(2); }, "no field 'z'" },
    { [](auto& cloud) { cloud.fields[0].datatype = 8; }, "field 'x' of datatype 8, expected FLOAT32 (7)" },
    { [](auto& cloud) { cloud.fields[1].offset = 30; }, "field 'y' at byte 30 of points of 32 bytes" },
    { [](auto& cloud) { cloud.is_bigendian = true; }, "big-endian" },
    { [](auto& cloud) { cloud.row_step = 127; }, "rows of 127 bytes, expected at least 128 for 4 x 3" },
    { [](auto& cloud) { cloud.data.pop_back(); }, "truncated: 383 bytes, expected 384 for 4 x 3" },
    { [](auto& cloud) { cloud.point_step = cloud.row_step = 0; }, "field 'x' at byte 0 of points of 0 bytes" },
    { [](auto& cloud) { cloud.fields[2].offset = 0xfffffffe; }, "field 'z' at byte 4294967294" },
  };
  EXPECT_EQ(refusalOf(makeCloud()), "");
  for (const auto& [change, text] : bad)
  {
    sensor_msgs::PointCloud2 cloud = makeCloud();
    change(cloud);
    EXPECT_NE(refusalOf(cloud).find(text), std::string::npos) << text << "; it says: " << refusalOf(cloud);
  }
}

TEST(OrganizedCloud, NeedsNoPaddingAfterTheLastRow)
{
  sensor_msgs::PointCloud2 cloud = makeCloud();
  cloud.row_step = 120 + 8;
  cloud.point_step = 30;
  cloud.data.resize(2 * 128 + 120);
  EXPECT_EQ(refusalOf(cloud), "");
}

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
