/** Twins of identity.py. */
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "surfaces.h"

namespace skeleton_extract_3d
{
namespace
{
void distancesAcross(const double* position, const bool* has, int tracks, const double* rays, const bool* known,
                     int people, int joints, double* result)
{
  std::vector<double> distances;
  for (int pair = 0; pair < tracks * people; ++pair)
  {
    const int track = pair / people * joints, person = pair % people * joints;
    distances.clear();
    for (int joint = 0; joint < joints; ++joint)
    {
      if (has[track + joint] && known[person + joint])
      {
        const double *at = position + 3 * (track + joint), *ray = rays + 3 * (person + joint);
        const double x = ray[0] * at[2] - at[0], y = ray[1] * at[2] - at[1];
        distances.push_back(std::sqrt(x * x + y * y));
      }
    }
    if (distances.empty())
    {
      result[pair] = std::numeric_limits<double>::infinity();
      continue;
    }
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() - 1) / 2;
    std::nth_element(distances.begin(), middle, distances.end());
    result[pair] = *middle;
  }
}

/** Return by how much another depth is likelier than a track's for one person. */
double evidenceAgainst(const double* evidence, double size, double spread, double z, double same_depth, double most,
                       const SizeSettings& s)
{
  const double log_size = std::log(size), log_z = std::log(std::max(z, 0.1));
  double greatest = -std::numeric_limits<double>::infinity(), there = greatest;
  for (std::size_t i = 0; i < s.log_depths.size(); ++i)
  {
    const double total = evidence[i] + s.evidence(i, log_size, spread);
    greatest = std::max(greatest, total);
    there = std::abs(s.log_depths[i] - log_z) < same_depth ? std::max(there, total) : there;
  }
  return std::min(greatest - there, most);
}

py::array_t<double> distancesAcrossOf(const Doubles& position, const Flags& has, const Doubles& rays,
                                      const Flags& known)
{
  const py::ssize_t tracks = sizeOf(position, "position", 3, 0), joints = position.shape(1);
  const py::ssize_t people = sizeOf(rays, "rays", 3, 0);
  const double* at = checked(position, "position", { tracks, joints, 3 });
  const bool* placed = checked(has, "has", { tracks, joints });
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const bool* found = checked(known, "known", { people, joints });
  py::array_t<double> result({ tracks, people });
  distancesAcross(at, placed, tracks, ray, found, people, joints, result.mutable_data());
  return result;
}

py::array_t<double> evidenceAgainstOf(const Doubles& evidence, const Doubles& size, const Doubles& scale,
                                      const Doubles& spread, const Doubles& z, double same_depth, double most,
                                      const Doubles& depths, double foreshortening, double weight, double limit)
{
  const SizeSettings settings = sizeSettings(depths, foreshortening, weight, limit);
  const py::ssize_t people = sizeOf(size, "size", 1, 0), tracks = sizeOf(z, "z", 1, 0);
  const double* of_surfaces = checked(evidence, "evidence", { people, depths.size() });
  const double* by_track = checked(scale, "scale", { tracks });
  const double* uncertainty = checked(spread, "spread", { tracks });
  py::array_t<double> result({ tracks, people });
  for (py::ssize_t t = 0; t < tracks; ++t)
  {
    for (py::ssize_t p = 0; p < people; ++p)
    {
      *result.mutable_data(t, p) = evidenceAgainst(of_surfaces + p * depths.size(), size.data()[p] * by_track[t],
                                                   uncertainty[t], z.data()[t], same_depth, most, settings);
    }
  }
  return result;
}
}  // namespace

void bindIdentity(py::module& module)
{
  module.def("distances_across", &distancesAcrossOf, "Twin of identity.distances_across.", py::arg("position"),
             py::arg("has"), py::arg("rays"), py::arg("known"));
  module.def("evidence_against", &evidenceAgainstOf, "Twin of identity.evidence_against.", py::arg("evidence"),
             py::arg("size"), py::arg("scale"), py::arg("spread"), py::arg("z"), py::arg("same_depth"), py::arg("most"),
             py::arg("depths"), py::arg("foreshortening"), py::arg("weight"), py::arg("limit"));
}
}  // namespace skeleton_extract_3d
