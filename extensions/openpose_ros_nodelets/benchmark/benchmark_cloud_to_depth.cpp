// Processor time of cloud_to_depth for a 960 x 540 XYZRGB cloud, as YAML: the depth image in a new message, and the fit
// of the camera.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <vector>

#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "cloud_to_depth/cloud_camera.h"
#include "cloud_to_depth/depth_image.h"

namespace
{

using openpose_ros_nodelets::OrganizedCloud;

constexpr int WIDTH = 960, HEIGHT = 540, ROUNDS = 200;
constexpr int CLOUDS = 8;  ///< more than the processor's cache holds

sensor_msgs::PointCloud2 slantedSurface()
{
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(WIDTH * HEIGHT);
  cloud.width = WIDTH;
  cloud.height = HEIGHT;
  cloud.row_step = WIDTH * cloud.point_step;
  sensor_msgs::PointCloud2Iterator<float> point(cloud, "x");
  for (int row = 0; row < HEIGHT; ++row)
    for (int column = 0; column < WIDTH; ++column, ++point)
    {
      point[2] = 1.0f + 0.001f * column + 0.002f * row;
      point[0] = (column - 480.0f) / 540.0f * point[2];
      point[1] = (row - 270.0f) / 540.0f * point[2];
    }
  return cloud;
}

double processorMilliseconds()
{
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * time.tv_sec + 1e-6 * time.tv_nsec;
}

/// Print best, median and 95th percentile of what a step takes on clouds that are in the cache, and on those that are not.
template <typename Function>
void tell(const char* name, const std::vector<sensor_msgs::PointCloud2>& clouds, Function step)
{
  for (const std::size_t used : { std::size_t(1), clouds.size() })
  {
    std::vector<double> times;
    for (int round = 0; round < ROUNDS; ++round)
    {
      const double began = processorMilliseconds();
      step(OrganizedCloud(clouds[round % used]));
      times.push_back(processorMilliseconds() - began);
    }
    std::sort(times.begin(), times.end());
    std::printf("%s, %s [ms]: {best: %.3f, median: %.3f, p95: %.3f}\n", name,
                used == 1 ? "same cloud" : "other clouds in turn", times[0], times[ROUNDS / 2], times[ROUNDS * 95 / 100]);
  }
}

}  // namespace

int main()
{
  const std::vector<sensor_msgs::PointCloud2> clouds(CLOUDS, slantedSurface());
  std::vector<std::uint8_t> copy(clouds[0].data.size());
  std::size_t made = 0;
  tell("depth 16UC1", clouds, [&](const OrganizedCloud& cloud) {
    made += openpose_ros_nodelets::depthImage<std::uint16_t>(cloud)->data.size();
  });
  tell("depth 32FC1", clouds, [&](const OrganizedCloud& cloud) {
    made += openpose_ros_nodelets::depthImage<float>(cloud)->data.size();
  });
  tell("camera fit", clouds, [&](const OrganizedCloud& cloud) {
    made += openpose_ros_nodelets::fittedCamera(cloud).width > 0;
  });
  tell("copy of the cloud, for comparison", clouds, [&](const OrganizedCloud& cloud) {
    std::memcpy(copy.data(), cloud.rowOfZ(0), copy.size() - 32);
    made += copy[123];
  });
  return made > 0 ? 0 : 1;
}
