// The floor in scenes whose floor is known.
#include <cmath>
#include <functional>
#include <optional>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "openpose_ros_nodelets/floor/floor_finder.h"
#include "openpose_ros_nodelets/floor/floor_tracker.h"

namespace openpose_ros_nodelets
{
namespace
{

constexpr double DEGREE = M_PI / 180;
const Eigen::Vector3f IMAGE_UP(0, -1, 0);
// How well a floor is to be found [deg], [m].
constexpr double ANGLE = 1.0, HEIGHT = 0.03;

/// A box that is seen from outside or, as a room, from inside; axes: x right, y ahead, z up from the floor below the
/// camera [m].
struct Box
{
  Eigen::Vector3f least, greatest;
};

/// A camera in a scene of boxes, with 160 x 120 pixels and a view of 70 degrees.
class Scene
{
public:
  Scene(double height, double pitch, double roll = 0) : height_(height)
  {
    // the optical frame: x right, y down, z forward
    rotation_ << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    rotation_ = rotation_ * Eigen::AngleAxisf(-pitch * DEGREE, Eigen::Vector3f::UnitX()) *
                Eigen::AngleAxisf(roll * DEGREE, Eigen::Vector3f::UnitZ());
  }

  Scene& add(const Eigen::Vector3f& least, const Eigen::Vector3f& greatest)
  {
    boxes_.push_back({ least, greatest });
    return *this;
  }

  Eigen::Vector3f up() const
  {
    return rotation_.transpose() * Eigen::Vector3f::UnitZ();
  }

  /// Return the points with noise of 1 cm along the rays, of the rows above `bottom`.
  Points::Ptr points(int bottom = 120) const
  {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, 0.01F);
    Points::Ptr points(new Points);
    for (int v = 0; v < bottom; ++v)
      for (int u = 0; u < 160; ++u)
      {
        const Eigen::Vector3f ray = Eigen::Vector3f((u - 79.5F) / 114, (v - 59.5F) / 114, 1).normalized();
        const Eigen::Vector3f point = (distance(rotation_ * ray) + noise(random)) * ray;
        points->push_back(pcl::PointXYZ(point.x(), point.y(), point.z()));
      }
    return points;
  }

private:
  /// Return the distance to the first surface: of a room of 4 x 6 x 2.5 m, or of a box in it.
  float distance(const Eigen::Vector3f& ray) const
  {
    const Eigen::Vector3f origin(0, 0, height_);
    float nearest = crossing({ { -2, -1, 0 }, { 2, 5, 2.5F } }, origin, ray).second;
    for (const Box& box : boxes_)
    {
      const auto [in, out] = crossing(box, origin, ray);
      if (in > 0 && in < out)
        nearest = std::min(nearest, in);
    }
    return nearest;
  }

  static std::pair<float, float> crossing(const Box& box, const Eigen::Vector3f& origin, const Eigen::Vector3f& ray)
  {
    const Eigen::Array3f first = (box.least - origin).array() / ray.array();
    const Eigen::Array3f second = (box.greatest - origin).array() / ray.array();
    return { first.min(second).maxCoeff(), first.max(second).minCoeff() };
  }

  float height_;
  Eigen::Matrix3f rotation_;
  std::vector<Box> boxes_;
};

std::optional<Floor> find(const Scene& scene, int bottom = 120, double tolerance = 40)
{
  return findFloor(scene.points(bottom), IMAGE_UP, tolerance * DEGREE, FloorSettings()).floor;
}

void expectFloor(const std::optional<Floor>& floor, const Scene& scene, double height)
{
  ASSERT_TRUE(floor);
  EXPECT_LT(angleBetween(floor->normal, scene.up()) / DEGREE, ANGLE);
  EXPECT_NEAR(floor->height, height, HEIGHT);
  EXPECT_NEAR(floor->normal.norm(), 1, 1e-5);
}

TEST(Finder, EmptyRoomAtManyHeightsAndTilts)
{
  for (const double height : { 0.4, 0.9, 1.4 })
    for (const double pitch : { 0, 15, 35 })
      for (const double roll : { -15, 0 })
      {
        SCOPED_TRACE(testing::Message() << height << " m, " << pitch << " deg down, " << roll << " deg rolled");
        const Scene scene(height, pitch, roll);
        expectFloor(find(scene), scene, height);
      }
}

TEST(Finder, TableLargerThanTheFloorThatIsSeen)
{
  Scene scene(1.4, 25);
  scene.add({ -2, 0.6F, 0.7F }, { 0.7F, 1.9F, 0.75F });
  expectFloor(find(scene), scene, 1.4);
}

TEST(Finder, BedAndPeople)
{
  Scene scene(1.3, 12);
  scene.add({ -2, 2, 0 }, { -0.2F, 4, 0.5F });
  for (const float x : { 0.2F, 0.8F, 1.4F })
    scene.add({ x, 2.5F, 0 }, { x + 0.4F, 2.8F, 1.8F });
  expectFloor(find(scene), scene, 1.3);
}

TEST(Finder, WhatIsNoFloor)
{
  Scene table(1.3, 10);
  table.add({ -2, 0.3F, 0.7F }, { 2, 3.5F, 0.75F });
  EXPECT_FALSE(find(table));
  EXPECT_FALSE(findFloor(Points::Ptr(new Points), IMAGE_UP, 1, FloorSettings()).floor) << "no points";
  EXPECT_FALSE(find(Scene(1.3, -10), 70)) << "walls alone";
  EXPECT_FALSE(find(Scene(1.3, -35))) << "a ceiling";
  EXPECT_FALSE(find(Scene(1.3, 5), 86)) << "a narrow strip is not sure enough";
}

TEST(Finder, TiltBeyondTheToleranceIsRefused)
{
  const Scene scene(1.3, 35);
  EXPECT_TRUE(find(scene, 120, 40));
  EXPECT_FALSE(find(scene, 120, 20));
}

TEST(Finder, SigmasContainTheErrors)
{
  const Scene scene(1.3, 10);
  const auto floor = find(scene);
  ASSERT_TRUE(floor);
  EXPECT_LT(std::abs(floor->height - 1.3), 3 * floor->height_sigma);
  EXPECT_LT(floor->height_sigma, HEIGHT);
}

Floor plane(float height, float tilt = 0)
{
  return { Eigen::Vector3f(0, -std::cos(tilt * DEGREE), std::sin(tilt * DEGREE)), height, 0.5F, 4, 0.01F, 0.003F };
}

class Tracker : public testing::Test
{
protected:
  /// The height at the end of planes in a row, 0.2 s apart; negative: none.
  float heightAfter(const std::optional<Floor>& found, int times)
  {
    std::optional<Floor> floor;
    for (int time = 0; time < times; ++time)
      floor = tracker_.update(found, stamp_ += 0.2);
    return floor ? floor->height : -1;
  }

  double stamp_ = 100;

private:
  FloorTracker tracker_{ 0.5 };
};

TEST_F(Tracker, FirstPlaneHasToComeTwice)
{
  EXPECT_LT(heightAfter(plane(1.3), 1), 0);
  EXPECT_FLOAT_EQ(heightAfter(plane(1.3), 1), 1.3);
}

TEST_F(Tracker, SmoothsWhatAgrees)
{
  heightAfter(plane(1.30), 2);
  const float next = heightAfter(plane(1.34), 1);
  EXPECT_NEAR(next, 1.30 + 0.04 * (1 - std::exp(-0.2 / 0.5)), 1e-4);
  EXPECT_NEAR(heightAfter(plane(1.34), 30), 1.34, 1e-3);
}

TEST_F(Tracker, NothingSeenNothingTold)
{
  heightAfter(plane(1.3), 5);
  EXPECT_LT(heightAfter(std::nullopt, 1), 0);
  EXPECT_FLOAT_EQ(heightAfter(plane(1.3), 1), 1.3);
}

TEST_F(Tracker, TableThatFillsTheViewForAMomentIsNoFloor)
{
  heightAfter(plane(1.3), 5);
  EXPECT_LT(heightAfter(plane(0.6), 9), 0);
  EXPECT_FLOAT_EQ(heightAfter(plane(1.3), 1), 1.3);
}

TEST_F(Tracker, LowerPlaneAndTiltedCameraAreBelievedAtOnce)
{
  heightAfter(plane(0.6), 5);
  EXPECT_FLOAT_EQ(heightAfter(plane(1.3), 2), 1.3);
  EXPECT_FLOAT_EQ(heightAfter(plane(1.3, 20), 2), 1.3);
}

TEST_F(Tracker, RaisedCameraIsBelievedAfterAWhile)
{
  heightAfter(plane(1.3), 5);
  EXPECT_FLOAT_EQ(heightAfter(plane(0.6), 12), 0.6);
}

TEST_F(Tracker, ForgetsWhenTimeGoesBack)
{
  heightAfter(plane(1.3), 5);
  stamp_ = 10;
  EXPECT_FLOAT_EQ(heightAfter(plane(0.6), 2), 0.6);
}

}  // namespace
}  // namespace openpose_ros_nodelets

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
