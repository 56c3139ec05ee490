#include "people_labeller.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace openpose_ros_nodelets
{
namespace
{

// The crop of a person is found in every such row and column [px], and enlarged by twice as much.
constexpr std::size_t STRIDE = 4;
// The scene around a person is looked at as far beyond the reach of the bones [m].
constexpr float AROUND = 0.25f;
// A component is of a person if this number and this share of its points lie in a core.
constexpr std::uint32_t LEAST_CORES = 10;
constexpr float LEAST_CORE_SHARE = 0.05f;
// Neighbours in the image, of which some may be missing, are at most this many columns or rows apart.
constexpr std::uint32_t GAP = 2;
// Cameras mix the depths of both sides of an edge. Such a point is within this many pixels of the person, and fewer
// points than these, of those around it in the image, are near it.
constexpr int EDGE = 2, MIXED = 6;

// Bones are held against so many points at once, which lie near each other: most are out of reach of all of them.
constexpr Eigen::Index BLOCK = 64;
using Values = Eigen::Array<float, Eigen::Dynamic, 1, 0, BLOCK, 1>;

float square(float value)
{
  return value * value;
}

// Points of the image, an array per axis for vector instructions.
struct Points
{
  void push(std::uint32_t index, const Eigen::Vector3f& point)
  {
    indices.push_back(index);
    for (int axis = 0; axis < 3; ++axis)
      axes[axis].push_back(point[axis]);
  }

  Eigen::Vector3f at(std::size_t number) const
  {
    return { axes[0][number], axes[1][number], axes[2][number] };
  }

  std::vector<std::uint32_t> indices;
  std::vector<float> axes[3];
};

// The scores of the points by their nearest bone: below 0 in a core, 1 at the end of the reach, more beyond it.
std::vector<float> scoresOf(const Points& points, const Body& body)
{
  const Eigen::Index count = points.indices.size();
  std::vector<float> scores(count, std::numeric_limits<float>::max());
  for (Eigen::Index begin = 0; begin < count; begin += BLOCK)
  {
    const Eigen::Index size = std::min(BLOCK, count - begin);
    const auto axis = [&](int number) { return Values(Values::Map(&points.axes[number][begin], size)); };
    const Values points_x = axis(0), points_y = axis(1), points_z = axis(2);
    const Eigen::AlignedBox3f box(
        Eigen::Vector3f(points_x.minCoeff(), points_y.minCoeff(), points_z.minCoeff()),
        Eigen::Vector3f(points_x.maxCoeff(), points_y.maxCoeff(), points_z.maxCoeff()));
    auto least = Values::Map(&scores[begin], size);
    for (const Bone& bone : body.bones)
    {
      if (!bone.box.intersects(box))
        continue;
      const Eigen::Vector3f along = bone.end - bone.start;
      const float length = along.squaredNorm();
      const Eigen::Vector3f unit = length > 0.0f ? Eigen::Vector3f(along / length) : Eigen::Vector3f::Zero();
      const Values x = points_x - bone.start.x(), y = points_y - bone.start.y(), z = points_z - bone.start.z();
      const Values share = (x * unit.x() + y * unit.y() + z * unit.z()).max(0.0f).min(1.0f);
      const auto distance = ((x - share * along.x()).square() + (y - share * along.y()).square() +
                             (z - share * along.z()).square()).sqrt();
      const float penalty = bone.end_penalty - bone.start_penalty, offset = bone.start_penalty - bone.core;
      least = least.min((distance + share * penalty + offset) * (1.0f / bone.margin));
    }
  }
  return scores;
}

}  // namespace

// Where a person may be, and the scene around.
struct PeopleLabeller::Crop
{
  Eigen::AlignedBox2i pixels;          // columns and rows
  Points around;                       // points near the person
  std::vector<Eigen::Vector3f> scene;  // those of them that are out of reach [m]
};

const std::vector<std::uint32_t>& PeopleLabeller::label(const OrganizedCloud& cloud,
                                                        const std::vector<Skeleton>& people)
{
  const std::size_t size = cloud.width() * cloud.height();
  labels_.assign(size, 0);
  scores_.resize(size);
  parents_.resize(size);
  counts_.resize(size);
  candidates_.clear();
  std::vector<Body> bodies;
  for (const Skeleton& person : people)
    bodies.push_back(shapeBody(person, settings_.looseness));
  const std::vector<Crop> crops = crop(cloud, bodies);
  Planes known;
  for (std::size_t number = 0; number < bodies.size(); ++number)
    if (!crops[number].pixels.isEmpty())
      choose(cloud, number + 1, bodies[number], crops[number],
             findSupports(bodies[number], crops[number].scene, settings_.floor_margin, known));
  connect(cloud);
  dropFar();
  takeEdges(cloud);
  return labels_;
}

std::vector<PeopleLabeller::Crop> PeopleLabeller::crop(const OrganizedCloud& cloud,
                                                       const std::vector<Body>& bodies) const
{
  std::vector<Crop> crops(bodies.size());
  std::vector<Eigen::AlignedBox3f> around;
  for (const Body& body : bodies)
    around.emplace_back(body.box.min().array() - AROUND, body.box.max().array() + AROUND);
  for (std::size_t row = 0; row < cloud.height(); row += STRIDE)
    for (std::size_t column = 0; column < cloud.width(); column += STRIDE)
    {
      const Eigen::Vector3f point = cloud.at(row, column);
      for (std::size_t number = 0; number < bodies.size(); ++number)
      {
        if (!around[number].contains(point))  // nor does it where the point is missing
          continue;
        crops[number].around.push(0, point);
        if (bodies[number].box.contains(point))
          crops[number].pixels.extend(Eigen::Vector2i(column, row));
      }
    }
  for (std::size_t number = 0; number < bodies.size(); ++number)
  {
    Crop& crop = crops[number];
    const std::vector<float> scores = scoresOf(crop.around, bodies[number]);
    for (std::size_t i = 0; i < scores.size(); ++i)
      if (scores[i] > 1.0f)
        crop.scene.push_back(crop.around.at(i));
    const Eigen::Vector2i margin = Eigen::Vector2i::Constant(2 * STRIDE), last(cloud.width() - 1, cloud.height() - 1);
    if (!crop.pixels.isEmpty())
      crop.pixels = { (crop.pixels.min() - margin).cwiseMax(0), (crop.pixels.max() + margin).cwiseMin(last) };
  }
  return crops;
}

void PeopleLabeller::choose(const OrganizedCloud& cloud, std::uint32_t label, const Body& body,
                            const Crop& crop, const Planes& supports)
{
  Points points;
  for (int row = crop.pixels.min().y(); row <= crop.pixels.max().y(); ++row)
    for (int column = crop.pixels.min().x(); column <= crop.pixels.max().x(); ++column)
    {
      const Eigen::Vector3f point = cloud.at(row, column);
      if (body.box.contains(point))
        points.push(row * cloud.width() + column, point);
    }
  const std::vector<float> scores = scoresOf(points, body);
  for (std::size_t number = 0; number < scores.size(); ++number)
  {
    const std::uint32_t index = points.indices[number];
    const float score = scores[number];
    const auto holds = [&](const auto& plane) { return plane.absDistance(points.at(number)) < settings_.floor_margin; };
    if (score >= 1.0f || (labels_[index] != 0 && scores_[index] <= score) ||
        std::any_of(supports.begin(), supports.end(), holds))
      continue;
    if (labels_[index] == 0)
      candidates_.push_back(index);
    labels_[index] = label;
    scores_[index] = score;
  }
}

std::uint32_t PeopleLabeller::root(std::uint32_t index)
{
  while (parents_[index] != index)
    index = parents_[index] = parents_[parents_[index]];
  return index;
}

void PeopleLabeller::connect(const OrganizedCloud& cloud)
{
  const std::uint32_t width = cloud.width();
  for (const std::uint32_t index : candidates_)
    parents_[index] = index;
  for (const std::uint32_t index : candidates_)
  {
    const std::uint32_t row = index / width, column = index % width;
    const Eigen::Vector3f point = cloud.at(row, column);
    const float step = square(settings_.cluster_step) * point.squaredNorm();
    const auto join = [&](std::uint32_t other_row, std::uint32_t other_column) {
      const std::uint32_t other = other_row * width + other_column;
      if (labels_[other] == labels_[index] && parents_[other] != parents_[index] &&
          (cloud.at(other_row, other_column) - point).squaredNorm() < step)
        parents_[root(other)] = root(index);
    };
    for (std::uint32_t gap = 1; gap <= GAP; ++gap)
    {
      if (column + gap < width)
        join(row, column + gap);
      if (row + gap < cloud.height())
        join(row + gap, column);
    }
  }
}

void PeopleLabeller::dropFar()
{
  for (const std::uint32_t index : candidates_)
    counts_[index] = {};
  for (const std::uint32_t index : candidates_)
  {
    Count& count = counts_[root(index)];
    ++count.points;
    count.cores += scores_[index] < 0.0f;
  }
  std::size_t kept = 0;
  for (const std::uint32_t index : candidates_)
  {
    const Count& count = counts_[root(index)];
    if (count.cores >= LEAST_CORES && count.cores >= LEAST_CORE_SHARE * count.points)
      candidates_[kept++] = index;
    else
      labels_[index] = 0;
  }
  candidates_.resize(kept);
}

void PeopleLabeller::takeEdges(const OrganizedCloud& cloud)
{
  const int width = cloud.width(), height = cloud.height();
  std::vector<std::pair<std::uint32_t, std::uint32_t>> taken;
  const auto inside = [&](int row, int column) { return row >= 0 && row < height && column >= 0 && column < width; };
  const auto is_mixed = [&](int row, int column) {
    const Eigen::Vector3f point = cloud.at(row, column);
    if (!point.allFinite())
      return false;
    const float step = square(settings_.cluster_step) * point.squaredNorm();
    int alike = -1;  // without itself
    for (int v = row - EDGE; v <= row + EDGE; ++v)
      for (int u = column - EDGE; u <= column + EDGE; ++u)
        if (inside(v, u) && labels_[v * width + u] == 0)
          alike += (cloud.at(v, u) - point).squaredNorm() < step;
    return alike < MIXED;
  };
  for (const std::uint32_t index : candidates_)
  {
    const int row = index / width, column = index % width;
    for (const auto& [down, right] : { std::pair{ 0, 1 }, { 0, -1 }, { 1, 0 }, { -1, 0 } })
      for (int gap = 1; gap <= EDGE; ++gap)
      {
        const int v = row + gap * down, u = column + gap * right;
        if (inside(v, u) && labels_[v * width + u] == 0 && is_mixed(v, u))
          taken.emplace_back(v * width + u, labels_[index]);
      }
  }
  for (const auto& [index, label] : taken)
    labels_[index] = label;
}

}  // namespace openpose_ros_nodelets
