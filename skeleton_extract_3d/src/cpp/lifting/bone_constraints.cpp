/** Twins of bone_constraints.py. */
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "arrays.h"
#include "bindings.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
struct BoneRules
{
  const std::int64_t* bones;  ///< start, end, kind
  int count;
  double change, most_violation;
};

/** Move the joints of one person. */
void satisfyLengths(double* xyz, const double* covariance, const double* lengths, const double* spreads,
                    const bool* usable, const BoneRules& rules)
{
  for (int i = 0; i < rules.count; ++i)
  {
    const std::int64_t start = rules.bones[3 * i], end = rules.bones[3 * i + 1], kind = rules.bones[3 * i + 2];
    double *from = xyz + 3 * start, *to = xyz + 3 * end;
    const Direction along{ to[0] - from[0], to[1] - from[1], to[2] - from[2] };
    const double distance = std::max(std::sqrt(dot(along, along)), 1e-6);
    const double excess = distance - lengths[kind];
    if (!usable[start] || !usable[end] || !(std::abs(excess) < rules.most_violation * lengths[kind]))
    {
      continue;
    }
    const Direction unit_along{ along.x / distance, along.y / distance, along.z / distance };
    const Direction start_pull = product(matrixAt(covariance + 9 * start), unit_along);
    const Direction end_pull = product(matrixAt(covariance + 9 * end), unit_along);
    const double uncertainty = std::max(rules.change, spreads[kind]) * lengths[kind];
    const double share = excess / (dot(sum(start_pull, end_pull), unit_along) + uncertainty * uncertainty);
    from[0] += share * start_pull.x;
    from[1] += share * start_pull.y;
    from[2] += share * start_pull.z;
    to[0] -= share * end_pull.x;
    to[1] -= share * end_pull.y;
    to[2] -= share * end_pull.z;
  }
}

py::array_t<double> satisfyLengthsOf(const Doubles& xyz, const Doubles& covariance, const Doubles& lengths,
                                     const Doubles& spreads, const Flags& usable, const Integers& bones, double change,
                                     double most_violation)
{
  const py::ssize_t people = sizeOf(xyz, "xyz", 3, 0), joints = xyz.shape(1), kinds = sizeOf(lengths, "lengths", 2, 1);
  const py::ssize_t count = sizeOf(bones, "bones", 2, 0);
  const BoneRules rules{ checked(bones, "bones", { count, 3 }), static_cast<int>(count), change, most_violation };
  for (py::ssize_t i = 0; i < count; ++i)
  {
    checkWithin(rules.bones + 3 * i, 2, joints, "ends of bones");
    checkWithin(rules.bones + 3 * i + 2, 1, kinds, "kinds of bones");
  }
  const double* at = checked(xyz, "xyz", { people, joints, 3 });
  const double* noise = checked(covariance, "covariance", { people, joints, 3, 3 });
  const double* length = checked(lengths, "lengths", { people, kinds });
  const double* spread = checked(spreads, "spreads", { people, kinds });
  const bool* use = checked(usable, "usable", { people, joints });
  py::array_t<double> result({ people, joints, py::ssize_t{ 3 } });
  std::copy_n(at, xyz.size(), result.mutable_data());
  for (py::ssize_t p = 0; p < people; ++p)
  {
    satisfyLengths(result.mutable_data() + p * joints * 3, noise + p * joints * 9, length + p * kinds,
                   spread + p * kinds, use + p * joints, rules);
  }
  return result;
}
}  // namespace

void bindBoneConstraints(py::module& module)
{
  module.def("satisfy_lengths", &satisfyLengthsOf, "Twin of bone_constraints.satisfy_lengths.", py::arg("xyz"),
             py::arg("covariance"), py::arg("lengths"), py::arg("spreads"), py::arg("usable"), py::arg("bones"),
             py::arg("change"), py::arg("most_violation"));
}
}  // namespace skeleton_extract_3d
