// People made of capsules, before a wall and on a floor, as a depth camera sees them: which points are whose?
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "people_labeller.h"

using namespace openpose_ros_nodelets;

namespace
{

constexpr std::size_t WIDTH = 240, HEIGHT = 200;
constexpr float FOCAL_LENGTH = 180.0f;                // [px]
constexpr float FLOOR = 1.2f, WALL = 3.6f;            // y of the floor, z of the wall [m]
constexpr std::uint32_t SCENE = 0;

// The distance of a point from the surface of a thing.
using Surface = std::function<float(const Eigen::Vector3f&)>;

struct Thing
{
  std::uint32_t label;
  Surface surface;
};

Surface capsule(const Eigen::Vector3f& start, const Eigen::Vector3f& end, float radius)
{
  return [=](const Eigen::Vector3f& point) {
    const Eigen::Vector3f along = end - start;
    const float length = along.squaredNorm();
    const float share = length > 0.0f ? std::min(std::max((point - start).dot(along) / length, 0.0f), 1.0f) : 0.0f;
    return (point - start - share * along).norm() - radius;
  };
}

Surface box(const Eigen::Vector3f& least, const Eigen::Vector3f& greatest)
{
  return [=](const Eigen::Vector3f& point) {
    return (point - point.cwiseMax(least).cwiseMin(greatest)).norm() - 1e-3f;
  };
}

std::vector<Thing> room()
{
  return { { SCENE, [](const Eigen::Vector3f& point) { return FLOOR - point.y(); } },
           { SCENE, [](const Eigen::Vector3f& point) { return WALL - point.z(); } } };
}

// A person of 1.70 m that faces the camera, arms hanging; the middle of the ankles is at (x, z).
Skeleton standing(float x, float z)
{
  Skeleton person;
  const auto put = [&](Joint joint, float right, float height, float ahead = 0.0f) {
    person[joint].position = { x - right, FLOOR - height, z - ahead };
  };
  put(NOSE, 0.0f, 1.58f, 0.10f), put(NECK, 0.0f, 1.40f);
  put(RIGHT_EYE, 0.03f, 1.61f, 0.08f), put(LEFT_EYE, -0.03f, 1.61f, 0.08f);
  put(RIGHT_EAR, 0.07f, 1.59f), put(LEFT_EAR, -0.07f, 1.59f);
  put(RIGHT_SHOULDER, 0.165f, 1.40f), put(LEFT_SHOULDER, -0.165f, 1.40f);
  put(RIGHT_ELBOW, 0.24f, 1.14f), put(LEFT_ELBOW, -0.24f, 1.14f);
  put(RIGHT_WRIST, 0.27f, 0.90f), put(LEFT_WRIST, -0.27f, 0.90f);
  put(RIGHT_HIP, 0.095f, 0.90f), put(LEFT_HIP, -0.095f, 0.90f);
  put(RIGHT_KNEE, 0.11f, 0.50f), put(LEFT_KNEE, -0.11f, 0.50f);
  put(RIGHT_ANKLE, 0.12f, 0.10f), put(LEFT_ANKLE, -0.12f, 0.10f);
  return person;
}

// The skin and clothes of a person: thicker than the cores, and hands and feet beyond the last joints.
std::vector<Thing> bodyOf(const Skeleton& person, std::uint32_t label)
{
  std::vector<Thing> things;
  std::array<Eigen::Vector3f, JOINTS> at;
  std::transform(person.begin(), person.end(), at.begin(), [](const BodyPoint& joint) { return joint.position; });
  const auto add = [&](const Eigen::Vector3f& start, const Eigen::Vector3f& end, float radius) {
    things.push_back({ label, capsule(start, end, radius) });
  };
  const Eigen::Vector3f head = 0.5f * (at[RIGHT_EAR] + at[LEFT_EAR]), up(0.0f, -0.05f, 0.0f), toes(0.0f, 0.05f, -0.13f);
  add(head, head + up, 0.11f);
  add(at[NECK], head, 0.06f);
  add(at[RIGHT_SHOULDER], at[LEFT_SHOULDER], 0.08f);
  add(at[RIGHT_SHOULDER], at[RIGHT_HIP], 0.13f), add(at[LEFT_SHOULDER], at[LEFT_HIP], 0.13f);
  add(at[RIGHT_HIP], at[RIGHT_KNEE], 0.09f), add(at[LEFT_HIP], at[LEFT_KNEE], 0.09f);
  add(at[RIGHT_KNEE], at[RIGHT_ANKLE], 0.06f), add(at[LEFT_KNEE], at[LEFT_ANKLE], 0.06f);
  add(at[RIGHT_ANKLE], at[RIGHT_ANKLE] + toes, 0.045f), add(at[LEFT_ANKLE], at[LEFT_ANKLE] + toes, 0.045f);
  for (const auto& [shoulder, elbow, wrist] : { std::array{ RIGHT_SHOULDER, RIGHT_ELBOW, RIGHT_WRIST },
                                                std::array{ LEFT_SHOULDER, LEFT_ELBOW, LEFT_WRIST } })
  {
    add(at[shoulder], at[elbow], 0.05f), add(at[elbow], at[wrist], 0.045f);
    add(at[wrist], at[wrist] + 0.15f * (at[wrist] - at[elbow]).normalized(), 0.04f);
  }
  return things;
}

sensor_msgs::PointCloud2 emptyCloud(std::size_t point_step)
{
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = "camera";
  cloud.width = WIDTH;
  cloud.height = HEIGHT;
  cloud.point_step = point_step;
  cloud.row_step = point_step * WIDTH;
  cloud.is_dense = true;
  cloud.data.resize(cloud.row_step * HEIGHT);
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    cloud.fields.emplace_back();
    cloud.fields.back().name = std::string(1, "xyz"[axis]);
    cloud.fields.back().offset = axis * sizeof(float);
    cloud.fields.back().datatype = sensor_msgs::PointField::FLOAT32;
    cloud.fields.back().count = 1;
  }
  return cloud;
}

struct Scene
{
  sensor_msgs::PointCloud2 cloud;
  std::vector<std::uint32_t> truth;  // a label per point
};

// What a camera at the origin sees, by marching along each ray as far as no surface is.
Scene look(const std::vector<std::vector<Thing>>& groups)
{
  Scene scene{ emptyCloud(32), std::vector<std::uint32_t>(WIDTH * HEIGHT, SCENE) };
  for (std::size_t index = 0; index < scene.truth.size(); ++index)
  {
    const Eigen::Vector3f ray((index % WIDTH - 0.5f * WIDTH) / FOCAL_LENGTH,
                              (index / WIDTH - 0.5f * HEIGHT) / FOCAL_LENGTH, 1.0f);
    const float length = ray.norm();
    Eigen::Vector3f point = ray;
    for (float nearest = 1.0f; nearest > 1e-3f && point.z() < 5.0f; point += std::max(nearest, 5e-4f) / length * ray)
    {
      nearest = std::numeric_limits<float>::max();
      for (const std::vector<Thing>& things : groups)
        for (const Thing& thing : things)
        {
          const float distance = thing.surface(point);
          if (distance < nearest)
          {
            nearest = distance;
            scene.truth[index] = thing.label;
          }
        }
    }
    std::memcpy(&scene.cloud.data[32 * index], point.data(), 3 * sizeof(float));
  }
  return scene;
}

// Which share of the points of a person, or of the scene, has a label.
float share(const Scene& scene, const std::vector<std::uint32_t>& labels, std::uint32_t of, std::uint32_t label)
{
  float there = 0, labelled = 0;
  for (std::size_t index = 0; index < labels.size(); ++index)
  {
    there += scene.truth[index] == of;
    labelled += scene.truth[index] == of && labels[index] == label;
  }
  return labelled / there;
}

std::vector<std::uint32_t> labelsOf(const Scene& scene, const std::vector<Skeleton>& people)
{
  PeopleLabeller labeller{ LabelSettings() };
  return labeller.label(OrganizedCloud(scene.cloud), people);
}

// More than a share of the points of a person, and less than one of the scene, has the person's label.
void expectLabels(const std::vector<std::vector<Thing>>& things, const Skeleton& person, float least, float most)
{
  std::vector<std::vector<Thing>> groups = things;
  groups.push_back(bodyOf(person, 1));
  const Scene scene = look(groups);
  const std::vector<std::uint32_t> labels = labelsOf(scene, { person });
  EXPECT_GT(share(scene, labels, 1, 1), least);
  EXPECT_LT(share(scene, labels, SCENE, 1), most);
}

TEST(PeopleLabeller, NoPerson)
{
  const Scene scene = look({ room() });
  const std::vector<std::uint32_t> nothing(WIDTH * HEIGHT, SCENE);
  EXPECT_EQ(labelsOf(scene, {}), nothing);
  EXPECT_EQ(labelsOf(scene, { Skeleton() }), nothing);           // no joint is known
  EXPECT_EQ(labelsOf(scene, { standing(0.0f, 9.0f) }), nothing);  // behind the wall
}

TEST(PeopleLabeller, FloorAndWallRemain)
{
  expectLabels({ room() }, standing(0.0f, 2.5f), 0.97f, 0.003f);
  expectLabels({ room() }, standing(0.3f, WALL - 0.14f), 0.95f, 0.01f);  // the back touches the wall
}

TEST(PeopleLabeller, PeopleWhoTouchKeepTheirPoints)
{
  Skeleton left = standing(-0.40f, 2.4f), right = standing(0.40f, 2.5f);
  left[LEFT_WRIST].position = { -0.02f, 0.15f, 2.3f };  // a handshake
  right[RIGHT_WRIST].position = { 0.08f, 0.15f, 2.3f };
  const Scene scene = look({ room(), bodyOf(left, 1), bodyOf(right, 2) });
  const std::vector<std::uint32_t> labels = labelsOf(scene, { left, right });
  for (const std::uint32_t person : { 1, 2 })
  {
    EXPECT_GT(share(scene, labels, person, person), 0.96f);
    EXPECT_LT(share(scene, labels, person, 3 - person), 0.02f);
  }
}

TEST(PeopleLabeller, WhatHidesTheLegsRemains)
{
  Skeleton person = standing(0.0f, 2.6f);
  for (const Joint joint : { RIGHT_KNEE, LEFT_KNEE, RIGHT_ANKLE, LEFT_ANKLE })
    person[joint].uncertainty = 0.1f;
  const std::vector<Thing> table{ { SCENE, box({ -0.8f, 0.45f, 2.1f }, { 0.8f, FLOOR, 2.4f }) } };
  expectLabels({ room(), table }, person, 0.96f, 0.01f);
}

TEST(LabelledCloud, TheLabelIsInThePaddingOrBehind)
{
  const std::vector<std::uint32_t> labels(WIDTH * HEIGHT, 7);
  for (const auto& [step, offset, new_step] : { std::array{ 32, 12, 32 }, std::array{ 12, 12, 16 } })
  {
    sensor_msgs::PointCloud2 cloud = emptyCloud(step);
    cloud.data[step + 4] = 99;  // in y of the second point
    const sensor_msgs::PointCloud2Ptr labelled = withLabels(cloud, labels);
    ASSERT_EQ(labelled->fields.size(), 4u);
    EXPECT_EQ(labelled->fields[3].name, "label");
    EXPECT_EQ(labelled->fields[3].datatype, sensor_msgs::PointField::UINT32);
    EXPECT_EQ(int(labelled->fields[3].offset), offset);
    EXPECT_EQ(int(labelled->point_step), new_step);
    EXPECT_EQ(labelled->row_step, labelled->point_step * WIDTH);
    EXPECT_EQ(labelled->data.size(), labelled->row_step * HEIGHT);
    EXPECT_EQ(labelled->header.frame_id, "camera");
    EXPECT_EQ(labelled->data[new_step + 4], 99);
    EXPECT_EQ(labelled->data[labelled->data.size() - new_step + offset], 7);  // of the last point
  }
}

TEST(LabelledCloud, PeopleAreMissingInTheRest)
{
  std::vector<std::uint32_t> labels(WIDTH * HEIGHT, SCENE);
  labels[WIDTH + 3] = 5;
  const sensor_msgs::PointCloud2 cloud = emptyCloud(32);
  const sensor_msgs::PointCloud2Ptr rest = withoutLabelled(cloud, labels);
  const OrganizedCloud points(*rest);
  EXPECT_FALSE(rest->is_dense);
  EXPECT_TRUE(points.at(1, 3).array().isNaN().all());
  EXPECT_EQ(points.at(1, 4), Eigen::Vector3f::Zero());
}

TEST(OrganizedCloud, RefusesWhatItCanNotRead)
{
  using Change = std::function<void(sensor_msgs::PointCloud2&)>;
  const std::vector<std::pair<Change, std::string>> bad = {
    { [](auto& cloud) { cloud = sensor_msgs::PointCloud2(); }, "not organized: it has 0 x 0 points" },
    { [](auto& cloud) { cloud.fields.resize(2); }, "no field 'z'" },
    { [](auto& cloud) { cloud.fields[0].datatype = 8; }, "field 'x' of datatype 8 at byte 0 of points of 32 bytes" },
    { [](auto& cloud) { cloud.is_bigendian = true; }, "big-endian" },
    { [](auto& cloud) { cloud.data.pop_back(); }, "truncated" },
  };
  for (const auto& [change, text] : bad)
  {
    sensor_msgs::PointCloud2 cloud = emptyCloud(32);
    change(cloud);
    try
    {
      OrganizedCloud{ cloud };
      ADD_FAILURE() << text;
    }
    catch (const BadInputError& error)
    {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  }
}

}  // namespace

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
