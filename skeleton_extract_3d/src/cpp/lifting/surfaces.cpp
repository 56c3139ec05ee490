/** Twins of surfaces.py. */
#include "surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
/** Fill `below` with the weight below each edge of the bins. */
void cumulate(const std::vector<double>& histogram, std::vector<double>& below)
{
  below[0] = 0.0;
  for (std::size_t i = 0; i < histogram.size(); ++i)
  {
    below[i + 1] = below[i] + histogram[i];
  }
}

/** Logarithms of numbers that often repeat. */
class RepeatingLog
{
public:
  double operator()(double value)
  {
    if (value != last_)
    {
      last_ = value;
      log_ = std::log(value);
    }
    return log_;
  }

private:
  double last_ = 1.0;
  double log_ = 0.0;
};

struct RootSettings
{
  const double* joint_weights;
  double full_score;
  double nearest;         ///< first depth [m]
  double step;            ///< of the logarithm of the depth
  const std::int64_t *low, *high;  ///< first bin of a body at each depth, and first one behind it
  int depths;
  double front, behind, floor;  ///< likelihoods
};

void rootEvidence(const double* depth, const double* scores, const bool* foreign, int people, int joints, int samples,
                  const double* weights, const RootSettings& s, double* result)
{
  Window window(weights, samples);
  std::vector<double> all(s.depths), own(s.depths), all_below(s.depths + 1), own_below(s.depths + 1);
  const double log_nearest = std::log(s.nearest);
  std::fill_n(result, people * s.depths, 0.0);
  for (int row = 0; row < people * joints; ++row)
  {
    const double weight = s.joint_weights[row % joints] * std::min(1.0, scores[row] / s.full_score);
    if (weight == 0.0 || !window.look(depth + row * samples))
    {
      continue;
    }
    window.fill(foreign == nullptr ? nullptr : foreign + row * samples,
                [&](double z) { return (std::log(z) - log_nearest) / s.step; }, 0, all, own);
    cumulate(all, all_below);
    cumulate(own, own_below);
    double* of_person = result + row / joints * s.depths;
    RepeatingLog log;
    for (int i = 0; i < s.depths; ++i)
    {
      const double front = all_below[s.low[i]], behind = all_below[s.depths] - all_below[s.high[i]];
      const double near = std::max(own_below[s.high[i]] - own_below[s.low[i]], 0.0);
      of_person[i] += weight * log(near + s.front * front + s.behind * behind + s.floor);
    }
  }
}

struct CostSettings
{
  int steps, half;
  double step;  ///< [m]
  const std::int64_t* shifts;  ///< of the kernel [steps]
  const double* shares;        ///< of the kernel
  int kernel;
  double hidden, hidden_depth, under, anything, hidden_score, hidden_slope, hidden_most, hidden_covered;
};

void depthCosts(const double* depth, const double* offsets, const double* gaps, const double* root,
                const double* scores, const double* own, const bool* covered, const bool* foreign, int people,
                int joints, int samples, const double* weights, const CostSettings& s, float* result)
{
  Window window(weights, samples);
  // the first bin (-1) holds all that is nearer than the candidates, the last bin all that is further
  std::vector<double> all(s.steps + 2), surface(s.steps + 2), below(s.steps + 3), costs(s.steps);
  std::fill_n(result, people * joints * s.steps, 0.0f);
  for (int row = 0; row < people * joints; ++row)
  {
    if (!(scores[row] > 0.0) || !window.look(depth + row * samples))
    {
      continue;
    }
    const double from_root = root[row / joints], offset = offsets[row];
    window.fill(foreign == nullptr ? nullptr : foreign + row * samples,
                [&](double z) { return (z + offset - from_root) / s.step + s.half; }, -1, all, surface);
    cumulate(all, below);
    const double shift = std::max(1.0, std::nearbyint(gaps[row] / s.step));
    const int hiding = static_cast<int>(std::min(shift, s.steps + 1.0));
    const double by_score =
        std::min(std::max(std::exp(s.hidden_slope * (s.hidden_score - scores[row])), 1.0), s.hidden_most);
    const double hidden = (covered[row] ? s.hidden_covered : 1.0) * s.hidden * by_score * s.step / s.hidden_depth;
    double least = std::numeric_limits<double>::infinity();
    RepeatingLog log;
    for (int i = 0; i < s.steps; ++i)
    {
      double seen = 0.0;
      for (int k = 0; k < s.kernel; ++k)
      {
        const std::int64_t from = i - s.shifts[k];
        seen += from >= 0 && from < s.steps ? s.shares[k] * surface[from + 1] : 0.0;
      }
      const double front = below[std::max(i + 1 - hiding, 0)];
      const double under = std::max(below[i + 1] - front, 0.0);
      costs[i] = -2.0 * log(own[row] * (seen + s.under * under) + hidden * front + s.anything);
      least = std::min(least, costs[i]);
    }
    float* of_joint = result + row * s.steps;
    for (int i = 0; i < s.steps; ++i)
    {
      of_joint[i] = static_cast<float>(costs[i] - least);
    }
  }
}

struct SizedPairs
{
  const std::int64_t* pairs;
  const double* lengths;
  int count;
  double least_score, bias;
};

void sizeDepth(const double* rays, const double* scores, int people, int joints, const SizedPairs& s, double* result)
{
  for (int person = 0; person < people; ++person)
  {
    const double *ray = rays + person * joints * 3, *score = scores + person * joints;
    double first = std::numeric_limits<double>::infinity(), second = first;
    int usable = 0;
    for (int i = 0; i < s.count; ++i)
    {
      const std::int64_t start = s.pairs[2 * i], end = s.pairs[2 * i + 1];
      const double length = distanceBetween(ray + 3 * start, ray + 3 * end);
      if (score[start] > s.least_score && score[end] > s.least_score && length > 1e-4)
      {
        const double depth = s.lengths[i] / length;
        second = std::min(second, std::max(first, depth));
        first = std::min(first, depth);
        ++usable;
      }
    }
    result[person] = usable >= 3 ? second * s.bias : first;
  }
}

void meanWithin(const double* depth, const double* offsets, const double* middle, double reach, const bool* known,
                const bool* foreign, const std::int64_t* chosen, int chosen_count, int people, int joints, int samples,
                const double* weights, double* mean, double* weight)
{
  for (int person = 0; person < people; ++person)
  {
    double total = 0.0, moment = 0.0;
    for (int i = 0; i < chosen_count; ++i)
    {
      const int row = person * joints + static_cast<int>(chosen[i]);
      for (int k = row * samples; known[row] && k < (row + 1) * samples; ++k)
      {
        const double z = depth[k] + offsets[person * chosen_count + i];
        if (std::abs(z - middle[person]) < reach && (foreign == nullptr || !foreign[k]))
        {
          total += weights[k - row * samples];
          moment += weights[k - row * samples] * z;
        }
      }
    }
    mean[person] = moment / std::max(total, 1e-9);
    weight[person] = total;
  }
}

py::array_t<double> rootEvidenceOf(const Doubles& depth, const Doubles& scores, const std::optional<Flags>& foreign,
                                   const Doubles& weights, const Doubles& joint_weights, double full_score,
                                   double nearest, double step, const Integers& low, const Integers& high, double front,
                                   double behind, double floor)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const py::ssize_t depths = sizeOf(low, "low", 1, 0);
  const RootSettings settings{ checked(joint_weights, "joint_weights", { joints }), full_score, nearest, step,
                               low.data(), checked(high, "high", { depths }), static_cast<int>(depths), front, behind,
                               floor };
  checkWithin(settings.low, depths, depths + 1, "low");
  checkWithin(settings.high, depths, depths + 1, "high");
  const double* score = checked(scores, "scores", { people, joints });
  const bool* others = checked(foreign, "foreign", { people, joints, samples });
  const double* weight = checked(weights, "weights", { samples });
  py::array_t<double> result({ people, depths });
  double* out = result.mutable_data();
  py::gil_scoped_release release;
  rootEvidence(depth.data(), score, others, people, joints, samples, weight, settings, out);
  return result;
}

py::array_t<float> depthCostsOf(const Doubles& depth, const Doubles& offsets, const Doubles& gaps, const Doubles& root,
                                const Doubles& scores, const Doubles& own, const Flags& covered,
                                const std::optional<Flags>& foreign, const Doubles& weights, int steps, int half,
                                double step, const Integers& kernel_shifts, const Doubles& kernel_shares, double hidden,
                                double hidden_depth, double under, double anything, double hidden_score,
                                double hidden_slope, double hidden_most, double hidden_covered)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const py::ssize_t kernel = sizeOf(kernel_shifts, "kernel_shifts", 1, 0);
  const CostSettings settings{ steps, half, step, kernel_shifts.data(),
                               checked(kernel_shares, "kernel_shares", { kernel }), static_cast<int>(kernel), hidden,
                               hidden_depth, under, anything, hidden_score, hidden_slope, hidden_most, hidden_covered };
  const double* offset = checked(offsets, "offsets", { people, joints });
  const double* gap = checked(gaps, "gaps", { people, joints });
  const double* score = checked(scores, "scores", { people, joints });
  const double* likely_own = checked(own, "own", { people, joints });
  const bool* behind_self = checked(covered, "covered", { people, joints });
  const bool* others = checked(foreign, "foreign", { people, joints, samples });
  const double* weight = checked(weights, "weights", { samples });
  const double* trunk = checked(root, "root", { people });
  py::array_t<float> result({ people, joints, py::ssize_t{ steps } });
  float* out = result.mutable_data();
  py::gil_scoped_release release;
  depthCosts(depth.data(), offset, gap, trunk, score, likely_own, behind_self, others, people, joints, samples, weight,
             settings, out);
  return result;
}

py::array_t<double> sizeEvidenceOf(const Doubles& size, const Doubles& spread, const Doubles& depths,
                                   double foreshortening, double weight, double limit)
{
  const SizeSettings settings = sizeSettings(depths, foreshortening, weight, limit);
  std::vector<py::ssize_t> shape(size.shape(), size.shape() + size.ndim());
  if (!std::equal(shape.begin(), shape.end(), spread.shape(), spread.shape() + spread.ndim()))
  {
    throw std::invalid_argument("size and spread must have the same shape");
  }
  shape.push_back(depths.size());
  py::array_t<double> result(shape);
  double* out = result.mutable_data();
  for (py::ssize_t i = 0; i < size.size(); ++i)
  {
    const double log_size = std::log(size.data()[i]);
    for (std::size_t k = 0; k < settings.log_depths.size(); ++k)
    {
      *out++ = settings.evidence(k, log_size, spread.data()[i]);
    }
  }
  return result;
}

py::array_t<double> sizeDepthOf(const Doubles& rays, const Doubles& scores, const Integers& pairs,
                                const Doubles& lengths, double least_score, double bias)
{
  const py::ssize_t people = sizeOf(rays, "rays", 3, 0), joints = rays.shape(1), count = partCount(pairs, joints);
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const double* score = checked(scores, "scores", { people, joints });
  const SizedPairs settings{ pairs.data(), checked(lengths, "lengths", { count }), static_cast<int>(count), least_score,
                             bias };
  py::array_t<double> result(people);
  sizeDepth(ray, score, people, joints, settings, result.mutable_data());
  return result;
}

py::tuple meanWithinOf(const Doubles& depth, const Doubles& offsets, const Doubles& middle, double reach,
                       const Flags& known, const std::optional<Flags>& foreign, const Integers& chosen,
                       const Doubles& weights)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const py::ssize_t count = sizeOf(chosen, "joints", 1, 0);
  checkWithin(chosen.data(), count, joints, "joints");
  const double* offset = checked(offsets, "offsets", { people, count });
  const double* at = checked(middle, "middle", { people });
  const bool* found = checked(known, "known", { people, joints });
  const bool* others = checked(foreign, "foreign", { people, joints, samples });
  const double* weight = checked(weights, "weights", { samples });
  py::array_t<double> mean(people), total(people);
  meanWithin(depth.data(), offset, at, reach, found, others, chosen.data(), count, people, joints, samples, weight,
             mean.mutable_data(), total.mutable_data());
  return py::make_tuple(mean, total);
}

py::array_t<double> lowerMedianOf(const Doubles& values)
{
  if (values.ndim() < 1)
  {
    throw std::invalid_argument("values must have at least 1 dimension");
  }
  const py::ssize_t count = values.shape(values.ndim() - 1);
  py::array_t<double> result(std::vector<py::ssize_t>(values.shape(), values.shape() + values.ndim() - 1));
  std::vector<double> valid;
  for (py::ssize_t i = 0; i < result.size(); ++i)
  {
    result.mutable_data()[i] = lowerMedian(values.data() + i * count, static_cast<int>(count), valid);
  }
  return result;
}
}  // namespace

SizeSettings sizeSettings(const Doubles& depths, double foreshortening, double weight, double limit)
{
  SizeSettings result{ std::vector<double>(sizeOf(depths, "depths", 1, 0)), foreshortening, weight, limit };
  std::transform(depths.data(), depths.data() + depths.size(), result.log_depths.begin(),
                 [](double depth) { return std::log(depth); });
  return result;
}

double lowerMedian(const double* samples, int count, std::vector<double>& valid)
{
  valid.clear();
  std::copy_if(samples, samples + count, std::back_inserter(valid), [](double z) { return std::isfinite(z); });
  if (valid.empty())
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto middle = valid.begin() + static_cast<std::ptrdiff_t>(valid.size() - 1) / 2;
  std::nth_element(valid.begin(), middle, valid.end());
  return *middle;
}

void bindSurfaces(py::module& module)
{
  module.def("root_evidence", &rootEvidenceOf, "Twin of surfaces.root_evidence.", py::arg("depth"), py::arg("scores"),
             py::arg("foreign"), py::arg("weights"), py::arg("joint_weights"), py::arg("full_score"),
             py::arg("nearest"), py::arg("step"), py::arg("low"), py::arg("high"), py::arg("front"), py::arg("behind"),
             py::arg("floor"));
  module.def("depth_costs", &depthCostsOf, "Twin of surfaces.depth_costs.", py::arg("depth"), py::arg("offsets"),
             py::arg("gaps"), py::arg("root"), py::arg("scores"), py::arg("own"), py::arg("covered"),
             py::arg("foreign"), py::arg("weights"), py::arg("steps"), py::arg("half"), py::arg("step"),
             py::arg("kernel_shifts"), py::arg("kernel_shares"), py::arg("hidden"), py::arg("hidden_depth"),
             py::arg("under"), py::arg("anything"), py::arg("hidden_score"), py::arg("hidden_slope"),
             py::arg("hidden_most"), py::arg("hidden_covered"));
  module.def("size_evidence", &sizeEvidenceOf, "Twin of surfaces.size_evidence.", py::arg("size"), py::arg("spread"),
             py::arg("depths"), py::arg("foreshortening"), py::arg("weight"), py::arg("limit"));
  module.def("size_depth", &sizeDepthOf, "Twin of surfaces.size_depth.", py::arg("rays"), py::arg("scores"),
             py::arg("pairs"), py::arg("lengths"), py::arg("least_score"), py::arg("bias"));
  module.def("mean_within", &meanWithinOf, "Twin of surfaces.mean_within.", py::arg("depth"), py::arg("offsets"),
             py::arg("middle"), py::arg("reach"), py::arg("known"), py::arg("foreign"), py::arg("joints"),
             py::arg("weights"));
  module.def("lower_median", &lowerMedianOf, "Twin of surfaces.lower_median.", py::arg("values"));
}
}  // namespace skeleton_extract_3d
