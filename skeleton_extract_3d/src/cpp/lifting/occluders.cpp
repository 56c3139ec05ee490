/** Bodies that cover keypoints: those of other people, and the same one. */
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
constexpr double INFINITELY_FAR = std::numeric_limits<double>::infinity();
constexpr double LEAST_SQUARE = 1e-6;  ///< of a length that divides [px^2]

/** Parts of one body in the image, as arrays that compilers make vector instructions of. */
class BodyParts
{
public:
  explicit BodyParts(const Constants& method)
    : ends_(method.body.part_joints)
    , radii_(method.body.part_radii)
    , widest_(*std::max_element(radii_.begin(), radii_.end()))
  {
  }

  void place(const double* uv)
  {
    low_x_ = low_y_ = INFINITELY_FAR;
    high_x_ = high_y_ = -INFINITELY_FAR;
    for (const Index joint : ends_)
    {
      low_x_ = std::fmin(low_x_, uv[2 * joint]);  // NaN does not count
      high_x_ = std::fmax(high_x_, uv[2 * joint]);
      low_y_ = std::fmin(low_y_, uv[2 * joint + 1]);
      high_y_ = std::fmax(high_y_, uv[2 * joint + 1]);
    }
    for (std::size_t i = 0; i < radii_.size(); ++i)
    {
      const double *start = uv + 2 * ends_[2 * i], *end = uv + 2 * ends_[2 * i + 1];
      x_[i] = start[0];
      y_[i] = start[1];
      along_x_[i] = end[0] - start[0];
      along_y_[i] = end[1] - start[1];
      const double square = along_x_[i] * along_x_[i] + along_y_[i] * along_y_[i];
      square_[i] = square < LEAST_SQUARE ? LEAST_SQUARE : square;  // NaN stays
    }
  }

  /** Return whether the parts may cover a pixel: it is near the box around them; reach: pixels per metre of breadth. */
  bool mayCover(const double* uv, double reach) const
  {
    const double margin = widest_ * reach;
    return uv[0] >= low_x_ - margin && uv[0] <= high_x_ + margin && uv[1] >= low_y_ - margin &&
           uv[1] <= high_y_ + margin;
  }

  /** Find the distances of a pixel from the parts [px], and where along them the nearest places are, 0..1. */
  void measure(const double* uv)
  {
    const double u = uv[0], v = uv[1];
    for (std::size_t i = 0; i < radii_.size(); ++i)
    {
      const double from_x = u - x_[i], from_y = v - y_[i];
      double share = (from_x * along_x_[i] + from_y * along_y_[i]) / square_[i];
      share = share < 0.0 ? 0.0 : share;
      share = share > 1.0 ? 1.0 : share;
      const double off_x = from_x - share * along_x_[i], off_y = from_y - share * along_y_[i];
      distance_[i] = std::sqrt(off_x * off_x + off_y * off_y);
      share_[i] = share;
    }
  }

  /** Return the least depth of the parts that cover the measured pixel [m], infinite where none does. */
  double nearest(const double* depths, double focal) const
  {
    double nearest = INFINITELY_FAR;
    for (std::size_t i = 0; i < radii_.size(); ++i)
    {
      const double start = depths[ends_[2 * i]], end = depths[ends_[2 * i + 1]];
      const double depth = start + share_[i] * (end - start);
      nearest = distance_[i] < radii_[i] * focal / depth && depth < nearest ? depth : nearest;
    }
    return nearest;
  }

  /** Return whether any of some parts, all at one depth, covers the measured pixel; reach: pixels per metre of breadth. */
  bool anyCovers(std::vector<bool>::const_iterator may_cover, double reach) const
  {
    bool covers = false;
    for (std::size_t i = 0; i < radii_.size(); ++i, ++may_cover)
    {
      covers |= *may_cover && distance_[i] < radii_[i] * reach;
    }
    return covers;
  }

private:
  const std::vector<Index>& ends_;
  const std::vector<double>& radii_;
  double widest_, low_x_ = 0.0, high_x_ = 0.0, low_y_ = 0.0, high_y_ = 0.0;
  std::vector<double> x_ = std::vector<double>(radii_.size()), y_ = x_, along_x_ = x_, along_y_ = x_;
  std::vector<double> square_ = x_, distance_ = x_, share_ = x_;
};
}  // namespace

py::array_t<double> othersDepths(const Constants& method, const Doubles& uv, const Doubles& joint_depths, double focal)
{
  const py::ssize_t people = countOf(uv);
  const double* pixels = checked(uv, "uv", { people, JOINTS, 2 });
  const double* depth = checked(joint_depths, "joint_depths", { people, JOINTS });
  py::array_t<double> result(Shape{ people, JOINTS, people });
  double* out = result.mutable_data();
  py::gil_scoped_release release;
  std::fill_n(out, people * JOINTS * people, INFINITELY_FAR);
  BodyParts body(method);
  for (py::ssize_t other = 0; other < people; ++other)
  {
    body.place(pixels + other * JOINTS * 2);
    const double* depths = depth + other * JOINTS;
    const double nearest = *std::min_element(depths, depths + JOINTS);
    const double reach = nearest > 0.0 ? focal / nearest : INFINITELY_FAR;
    for (py::ssize_t row = 0; row < people * JOINTS; ++row)
    {
      if (row / JOINTS != other && body.mayCover(pixels + 2 * row, reach))
      {
        body.measure(pixels + 2 * row);
        out[row * people + other] = body.nearest(depths, focal);
      }
    }
  }
  return result;
}

py::array_t<bool> coveredBySelf(const Constants& method, const Doubles& uv, const Doubles& root, double focal)
{
  const py::ssize_t people = countOf(uv);
  const double* pixels = checked(uv, "uv", { people, JOINTS, 2 });
  const double* depth = checked(root, "root", { people });
  py::array_t<bool> result(Shape{ people, JOINTS });
  const std::size_t parts = method.body.part_radii.size();
  BodyParts body(method);
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    const py::ssize_t person = row / JOINTS, joint = row % JOINTS;
    if (joint == 0)
    {
      body.place(pixels + 2 * row);
    }
    body.measure(pixels + 2 * row);
    result.mutable_data()[row] = body.anyCovers(method.body.covering_parts.begin() + joint * parts,
                                                method.occluders.covering_share * focal / depth[person]);
  }
  return result;
}
}  // namespace skeleton_extract_3d
