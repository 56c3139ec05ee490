// Labels the points of frames of depth images and people, for development/benchmarks/people_cloud.py.
//
// Reads from standard input, once: width, height (uint32), fx, fy, cx, cy (float32) [px]; per frame: the depth
// (float32, height x width) [m], the number of people (uint32), and of each of their joints x, y, z and uncertainty
// (float32) [m]. Writes per frame the milliseconds of processor time of the fastest of five runs (float32) and the
// labels (uint32, height x width).
#include <cstring>
#include <ctime>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include "people_cloud/people_labeller.h"

using namespace openpose_ros_nodelets;

namespace
{

constexpr int RUNS = 5;

template <typename Value>
bool read(Value* values, std::size_t number)
{
  return bool(std::cin.read(reinterpret_cast<char*>(values), number * sizeof(Value)));
}

template <typename Value>
void write(const Value* values, std::size_t number)
{
  std::cout.write(reinterpret_cast<const char*>(values), number * sizeof(Value));
}

bool readPeople(std::vector<Skeleton>& people)
{
  std::uint32_t number;
  if (!read(&number, 1))
    return false;
  people.assign(number, Skeleton());
  for (Skeleton& person : people)
  {
    float joints[JOINTS][4];
    if (!read(&joints[0][0], JOINTS * 4))
      return false;
    for (std::size_t joint = 0; joint < JOINTS; ++joint)
    {
      person.position[joint] = Eigen::Map<const Eigen::Vector3f>(joints[joint]);
      person.uncertainty[joint] = joints[joint][3];
    }
  }
  return true;
}

// The message of a cloud, with points as PCL's PointXYZRGB lie in memory.
sensor_msgs::PointCloud2 cloudOf(const std::vector<float>& depth, std::size_t width, const float* camera)
{
  constexpr std::size_t POINT_STEP = 32;
  sensor_msgs::PointCloud2 cloud;
  cloud.width = width;
  cloud.height = depth.size() / width;
  cloud.point_step = POINT_STEP;
  cloud.row_step = POINT_STEP * width;
  cloud.fields.resize(3);
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    cloud.fields[axis].name = std::string(1, "xyz"[axis]);
    cloud.fields[axis].offset = axis * sizeof(float);
    cloud.fields[axis].datatype = sensor_msgs::PointField::FLOAT32;
  }
  cloud.data.resize(POINT_STEP * depth.size());
  for (std::size_t index = 0; index < depth.size(); ++index)
  {
    const float z = depth[index] > 0.0f ? depth[index] : std::numeric_limits<float>::quiet_NaN();
    const float x = z * (index % width - camera[2]) / camera[0], y = z * (index / width - camera[3]) / camera[1];
    const float point[] = { x, y, z };
    std::memcpy(&cloud.data[POINT_STEP * index], point, sizeof(point));
  }
  return cloud;
}

}  // namespace

int main()
{
  std::uint32_t size[2];
  float camera[4];
  if (!read(size, 2) || !read(camera, 4))
    return 1;
  std::vector<float> depth(std::size_t(size[0]) * size[1]);
  std::vector<Skeleton> people;
  PeopleLabeller labeller{ LabelSettings() };
  while (read(depth.data(), depth.size()) && readPeople(people))
  {
    const sensor_msgs::PointCloud2 cloud = cloudOf(depth, size[0], camera);
    float fastest = std::numeric_limits<float>::max();
    for (int run = 0; run < RUNS; ++run)
    {
      const std::clock_t began = std::clock();
      labeller.label(OrganizedCloud(cloud), people);
      fastest = std::min(fastest, 1e3f * (std::clock() - began) / CLOCKS_PER_SEC);
    }
    write(&fastest, 1);
    const std::vector<std::uint32_t>& labels = labeller.label(OrganizedCloud(cloud), people);
    write(labels.data(), labels.size());
    std::cout.flush();
  }
  return 0;
}
