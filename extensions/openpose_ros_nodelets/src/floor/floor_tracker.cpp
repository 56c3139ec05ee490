#include "openpose_ros_nodelets/floor/floor_tracker.h"

#include <cmath>

namespace openpose_ros_nodelets
{
namespace
{

// Planes that differ less, in angle [rad] and height [m], are the same.
constexpr float SAME_ANGLE = 0.05F, SAME_HEIGHT = 0.06F;
// A plane above the known floor has to stay for this long [s].
constexpr double RISE_TIME = 2.0;
// What was known is forgotten when no plane agreed with it for this long, or when time goes back [s].
constexpr double MEMORY = 10.0;

bool agree(const Floor& floor, const Floor& other)
{
  return angleBetween(floor.normal, other.normal) < SAME_ANGLE && std::abs(floor.height - other.height) < SAME_HEIGHT;
}

}  // namespace

FloorTracker::FloorTracker(double smoothing_time) : smoothing_time_(smoothing_time)
{
}

std::optional<Floor> FloorTracker::update(const std::optional<Floor>& found, double stamp)
{
  if (stamp < stamp_ || stamp - stamp_ > MEMORY)
    floor_ = contender_ = std::nullopt;
  if (!found)
    return contender_ = std::nullopt;
  if (floor_ && agree(*floor_, *found))
  {
    const float share = smoothing_time_ > 0 ? 1 - std::exp(-(stamp - stamp_) / smoothing_time_) : 1;
    const Floor before = *floor_;
    floor_ = found;
    floor_->normal = (before.normal + share * (found->normal - before.normal)).normalized();
    floor_->height = before.height + share * (found->height - before.height);
    contender_ = std::nullopt;
    stamp_ = stamp;
    return floor_;
  }
  const bool stays = contender_ && agree(*contender_, *found);
  if (!stays)
    contender_since_ = stamp;
  contender_ = found;
  const bool rises = floor_ && found->height < floor_->height - SAME_HEIGHT;
  if (!stays || (rises && stamp - contender_since_ < RISE_TIME))
  {
    if (!floor_)
      stamp_ = stamp;
    return std::nullopt;
  }
  floor_ = found;
  contender_ = std::nullopt;
  stamp_ = stamp;
  return floor_;
}

}  // namespace openpose_ros_nodelets
