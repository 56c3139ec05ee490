/** Twins of occluders.py. */
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "surfaces.h"

namespace skeleton_extract_3d
{
namespace
{
/** The parts of a body in the picture. */
class BodyParts
{
public:
  BodyParts(const std::int64_t* parts, int count)
    : parts_(parts), count_(count), x_(count), y_(count), along_x_(count), along_y_(count), length_(count), at_(count)
    , share_(count)
  {
  }

  void place(const double* uv, double least_square)
  {
    for (int i = 0; i < count_; ++i)
    {
      const double *start = uv + 2 * parts_[2 * i], *end = uv + 2 * parts_[2 * i + 1];
      x_[i] = start[0];
      y_[i] = start[1];
      along_x_[i] = end[0] - start[0];
      along_y_[i] = end[1] - start[1];
      const double square = along_x_[i] * along_x_[i] + along_y_[i] * along_y_[i];
      length_[i] = square < least_square ? least_square : square;  // NaN stays
    }
  }

  /** Find the distances of a pixel from the parts [px], and where along them the nearest places are, 0..1. */
  void measure(const double* uv)
  {
    const double u = uv[0], v = uv[1];
    const double *x = x_.data(), *y = y_.data(), *along_x = along_x_.data(), *along_y = along_y_.data();
    const double* length = length_.data();
    double *at = at_.data(), *share = share_.data();
    const int count = count_;
    for (int i = 0; i < count; ++i)
    {
      const double from_x = u - x[i], from_y = v - y[i];
      double along = (from_x * along_x[i] + from_y * along_y[i]) / length[i];
      along = along < 0.0 ? 0.0 : along;
      along = along > 1.0 ? 1.0 : along;
      const double off_x = from_x - along * along_x[i], off_y = from_y - along * along_y[i];
      at[i] = std::sqrt(off_x * off_x + off_y * off_y);
      share[i] = along;
    }
  }

  double distance(int part) const
  {
    return at_[part];
  }
  double share(int part) const
  {
    return share_[part];
  }

private:
  const std::int64_t* parts_;
  int count_;
  std::vector<double> x_, y_, along_x_, along_y_, length_, at_, share_;
};

/** The part of the picture outside of which a body covers nothing. */
class Outline
{
public:
  Outline(const double* uv, const double* depths, int joints, double thickest, double focal)
  {
    double nearest = std::numeric_limits<double>::infinity();
    for (int joint = 0; joint < joints; ++joint)
    {
      const double u = uv[2 * joint], v = uv[2 * joint + 1];
      if (std::isfinite(u) && std::isfinite(v))
      {
        left_ = std::min(left_, u);
        right_ = std::max(right_, u);
        top_ = std::min(top_, v);
        bottom_ = std::max(bottom_, v);
        nearest = std::min(nearest, depths[joint]);
      }
    }
    reach_ = nearest > 0.0 ? thickest * focal / nearest : std::numeric_limits<double>::infinity();
  }

  bool holds(const double* uv) const
  {
    return uv[0] >= left_ - reach_ && uv[0] <= right_ + reach_ && uv[1] >= top_ - reach_ && uv[1] <= bottom_ + reach_;
  }

private:
  double left_ = std::numeric_limits<double>::infinity(), right_ = -left_, top_ = left_, bottom_ = right_, reach_;
};

void othersDepths(const double* uv, const double* joint_depths, double focal, int people, int joints,
                  const std::int64_t* parts, const double* radii, int part_count, double least_square, double* result)
{
  BodyParts body(parts, part_count);
  const double thickest = part_count > 0 ? *std::max_element(radii, radii + part_count) : 0.0;
  std::fill_n(result, people * joints * people, std::numeric_limits<double>::infinity());
  for (int other = 0; other < people; ++other)
  {
    body.place(uv + other * joints * 2, least_square);
    const double* depths = joint_depths + other * joints;
    const Outline outline(uv + other * joints * 2, depths, joints, thickest, focal);
    for (int row = 0; row < people * joints; ++row)
    {
      if (row / joints == other || !outline.holds(uv + 2 * row))
      {
        continue;
      }
      body.measure(uv + 2 * row);
      double& nearest = result[row * people + other];
      for (int i = 0; i < part_count; ++i)
      {
        const double start = depths[parts[2 * i]], end = depths[parts[2 * i + 1]];
        const double depth = start + body.share(i) * (end - start);
        const bool covers = body.distance(i) < radii[i] * focal / depth;
        nearest = covers && depth < nearest ? depth : nearest;
      }
    }
  }
}

struct ForeignSettings
{
  double reach, lead, skin;  ///< [m]
};

/** Mark the samples on other people; return whether there is any. */
bool foreignSamples(const double* depth, const double* others, const double* expected, int expected_per_person,
                    int people, int joints, int samples, int other_count, const ForeignSettings& s, bool* result)
{
  bool any = false;
  std::fill_n(result, people * joints * samples, false);
  std::vector<double> near;
  for (int row = 0; row < people * joints; ++row)
  {
    const double* of_row = others + row * other_count;
    near.clear();
    std::copy_if(of_row, of_row + other_count, std::back_inserter(near), [](double z) { return std::isfinite(z); });
    const double own = expected[expected_per_person == 1 ? row / joints : row];
    for (int i = 0; i < samples && !near.empty(); ++i)
    {
      const double surface = depth[row * samples + i] + s.skin;
      double gap = std::numeric_limits<double>::infinity();
      for (const double z : near)
      {
        gap = std::min(gap, std::abs(surface - z));
      }
      const bool foreign = gap < s.reach && gap + s.lead < std::abs(surface - own);
      result[row * samples + i] = foreign;
      any = any || foreign;
    }
  }
  return any;
}

void coveredBySelf(const double* uv, const double* root, double focal, int people, int joints,
                   const std::int64_t* parts, const double* radii, const bool* covering, int part_count, double share,
                   double least_square, bool* result)
{
  BodyParts body(parts, part_count);
  for (int person = 0; person < people; ++person)
  {
    body.place(uv + person * joints * 2, least_square);
    const double scale = focal / root[person];
    for (int joint = 0; joint < joints; ++joint)
    {
      body.measure(uv + (person * joints + joint) * 2);
      bool covered = false;
      for (int i = 0; i < part_count; ++i)
      {
        covered |= covering[joint * part_count + i] && body.distance(i) < share * radii[i] * scale;
      }
      result[person * joints + joint] = covered;
    }
  }
}

struct DoubtSettings
{
  std::vector<bool> arm;  ///< joint by joint
  double in_front;        ///< [m]
  const std::int64_t* limb_to;
  double shortest;  ///< [px]
};

struct Doubt
{
  std::int64_t person, joint;
  double surface;
  bool in_front, on_trunk;
};

std::vector<Doubt> doubtfulSurfaces(const double* uv, const double* depth, const double* root, const bool* covered,
                                    int people, int joints, int samples, const DoubtSettings& s)
{
  std::vector<Doubt> result;
  std::vector<double> valid;
  for (int row = 0; row < people * joints; ++row)
  {
    const int person = row / joints, joint = row % joints;
    const double surface = lowerMedian(depth + row * samples, samples, valid);
    const bool in_front = surface < root[person] - s.in_front && std::isfinite(uv[2 * row]);
    const bool on_trunk = s.arm[joint] && covered[row] && std::isfinite(surface);
    if (in_front || on_trunk)
    {
      result.push_back({ person, joint, surface, in_front, on_trunk });
    }
  }
  return result;
}

/** Return one metre across a limb in the picture [px]. */
std::pair<double, double> acrossLimb(const double* uv, const Doubt& doubt, int joints, double focal,
                                     const DoubtSettings& s)
{
  const double* of_person = uv + doubt.person * joints * 2;
  const double *here = of_person + 2 * doubt.joint, *there = of_person + 2 * s.limb_to[doubt.joint];
  double x = there[0] - here[0], y = there[1] - here[1];
  const double length = std::sqrt(x * x + y * y), scale = focal / doubt.surface;
  const bool known = length > s.shortest;
  x = known ? x / length : 0.0;
  y = known ? y / length : 1.0;
  return { -y * scale, x * scale };
}

py::array_t<double> othersDepthsOf(const Doubles& uv, const Doubles& joint_depths, double focal, const Integers& parts,
                                   const Doubles& radii, double least_square)
{
  const py::ssize_t people = sizeOf(uv, "uv", 3, 0), joints = uv.shape(1), count = partCount(parts, joints);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* depth = checked(joint_depths, "joint_depths", { people, joints });
  const double* radius = checked(radii, "radii", { count });
  py::array_t<double> result({ people, joints, people });
  double* out = result.mutable_data();
  py::gil_scoped_release release;
  othersDepths(at, depth, focal, people, joints, parts.data(), radius, count, least_square, out);
  return result;
}

std::optional<py::array_t<bool>> foreignSamplesOf(const Doubles& depth, const Doubles& others, const Doubles& expected,
                                                  double reach, double lead, double skin)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const py::ssize_t other_count = sizeOf(others, "others", 3, 2);
  const py::ssize_t per_person = sizeOf(expected, "expected", 2, 1) == 1 ? 1 : joints;
  const double* other = checked(others, "others", { people, joints, other_count });
  const double* own = checked(expected, "expected", { people, per_person });
  py::array_t<bool> result({ people, joints, samples });
  bool* out = result.mutable_data();
  bool any = false;
  {
    py::gil_scoped_release release;
    any = foreignSamples(depth.data(), other, own, per_person, people, joints, samples, other_count,
                         { reach, lead, skin }, out);
  }
  return any ? std::make_optional(result) : std::nullopt;
}

py::array_t<bool> coveredBySelfOf(const Doubles& uv, const Doubles& root, double focal, const Integers& parts,
                                  const Doubles& radii, const Flags& covering, double share, double least_square)
{
  const py::ssize_t people = sizeOf(uv, "uv", 3, 0), joints = uv.shape(1), count = partCount(parts, joints);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* trunk = checked(root, "root", { people });
  const double* radius = checked(radii, "radii", { count });
  const bool* may_cover = checked(covering, "covering", { joints, count });
  py::array_t<bool> result({ people, joints });
  bool* out = result.mutable_data();
  py::gil_scoped_release release;
  coveredBySelf(at, trunk, focal, people, joints, parts.data(), radius, may_cover, count, share, least_square, out);
  return result;
}

py::tuple doubtfulSurfacesOf(const Doubles& uv, const Doubles& depth, const Doubles& root, const Flags& covered,
                             double focal, const Integers& arms, double in_front, const Integers& limb_to,
                             const Doubles& beside, double shortest)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* trunk = checked(root, "root", { people });
  const bool* behind_self = checked(covered, "covered", { people, joints });
  DoubtSettings settings{ std::vector<bool>(joints), in_front, checked(limb_to, "limb_to", { joints }), shortest };
  checkWithin(settings.limb_to, joints, joints, "limb_to");
  checkWithin(arms.data(), arms.size(), joints, "arms");
  for (py::ssize_t i = 0; i < arms.size(); ++i)
  {
    settings.arm[arms.data()[i]] = true;
  }
  const std::vector<Doubt> doubts = doubtfulSurfaces(at, depth.data(), trunk, behind_self, people, joints, samples,
                                                     settings);
  const py::ssize_t count = doubts.size(), distances = sizeOf(beside, "beside", 1, 0);
  py::array_t<std::int64_t> person(count), joint(count);
  py::array_t<double> surface(count), places({ py::ssize_t{ 2 }, distances, count, py::ssize_t{ 2 } });
  py::array_t<bool> far_in_front(count), on_trunk(count);
  for (py::ssize_t i = 0; i < count; ++i)
  {
    const Doubt& doubt = doubts[i];
    person.mutable_data()[i] = doubt.person;
    joint.mutable_data()[i] = doubt.joint;
    surface.mutable_data()[i] = doubt.surface;
    far_in_front.mutable_data()[i] = doubt.in_front;
    on_trunk.mutable_data()[i] = doubt.on_trunk;
    const auto [x, y] = acrossLimb(at, doubt, joints, focal, settings);
    const double* here = at + 2 * (doubt.person * joints + doubt.joint);
    for (py::ssize_t side = 0; side < 2; ++side)
    {
      for (py::ssize_t k = 0; k < distances; ++k)
      {
        const double reach = side == 0 ? -beside.data()[k] : beside.data()[k];
        double* place = places.mutable_data(side, k, i, 0);
        place[0] = here[0] + reach * x;
        place[1] = here[1] + reach * y;
      }
    }
  }
  return py::make_tuple(person, joint, surface, far_in_front, on_trunk, places);
}
}  // namespace

void bindOccluders(py::module& module)
{
  module.def("others_depths", &othersDepthsOf, "Twin of occluders.others_depths.", py::arg("uv"),
             py::arg("joint_depths"), py::arg("focal"), py::arg("parts"), py::arg("radii"),
             py::arg("least_square"));
  module.def("foreign_samples", &foreignSamplesOf, "Twin of occluders.foreign_samples.", py::arg("depth"),
             py::arg("others"), py::arg("expected"), py::arg("reach"), py::arg("lead"), py::arg("skin"));
  module.def("covered_by_self", &coveredBySelfOf, "Twin of occluders.covered_by_self.", py::arg("uv"), py::arg("root"),
             py::arg("focal"), py::arg("parts"), py::arg("radii"), py::arg("covering"), py::arg("share"),
             py::arg("least_square"));
  module.def("doubtful_surfaces", &doubtfulSurfacesOf, "Twin of occluders.doubtful_surfaces.", py::arg("uv"),
             py::arg("depth"), py::arg("root"), py::arg("covered"), py::arg("focal"), py::arg("arms"),
             py::arg("in_front"), py::arg("limb_to"), py::arg("beside"), py::arg("shortest"));
}
}  // namespace skeleton_extract_3d
