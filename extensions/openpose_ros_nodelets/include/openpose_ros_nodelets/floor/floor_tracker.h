#pragma once

#include <optional>

#include "openpose_ros_nodelets/floor/floor_finder.h"

namespace openpose_ros_nodelets
{

/// Decides over time which plane is the floor: smooths what agrees, and believes another plane only when it stays.
class FloorTracker
{
public:
  /// `smoothing_time`: time constant of the mean over time [s]; 0: none.
  explicit FloorTracker(double smoothing_time);

  /// Take the floor of a frame, if it shows one, and return the floor, if it is known.
  ///
  /// A plane counts when a second one in a row agrees with it. One above the floor that was known, such as a table
  /// that fills the view, has to stay for longer than one that is as high or lower. Until then there is no floor.
  std::optional<Floor> update(const std::optional<Floor>& found, double stamp);

private:
  std::optional<Floor> floor_, contender_;
  double smoothing_time_, stamp_ = 0, contender_since_ = 0;
};

}  // namespace openpose_ros_nodelets
