/** Likelihood of depths of the trunk, and of each joint, given the samples around keypoints. */
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** The weights of the valid samples of a window, with sum 1, in histograms. */
class Window
{
public:
  Window(const std::vector<double>& weights, int bins) : weights_(weights), all_(bins), own_(bins)
  {
  }

  /** Read a window; return whether it has any valid sample. */
  bool read(const double* depth)
  {
    depth_ = depth;
    double total = 0.0;
    for (int i = 0; i < SAMPLES; ++i)
    {
      weight_[i] = std::isfinite(depth[i]) ? weights_[i] : 0.0;
      total += weight_[i];
    }
    for (double& weight : weight_)
    {
      weight /= total > 0.0 ? total : 1.0;
    }
    return total > 0.0;
  }

  /**
   * Fill the histograms of all samples, and of those that are not foreign; both are the same where `foreign` is null.
   *
   * position: function from depth to number of the bin; first: number of the first bin; it and the last one are open.
   */
  template <typename Position>
  void fill(const bool* foreign, int first, const Position& position)
  {
    const double last = first + static_cast<double>(all_.size() - 1);
    std::fill(all_.begin(), all_.end(), 0.0);
    std::fill(own_.begin(), own_.end(), 0.0);
    for (int i = 0; i < SAMPLES; ++i)
    {
      if (weight_[i] > 0.0)
      {
        const double at = position(depth_[i]);
        const long bin = at > first ? std::lrint(std::min(at, last)) - first : 0;
        all_[bin] += weight_[i];
        own_[bin] += foreign != nullptr && foreign[i] ? 0.0 : weight_[i];
      }
    }
  }

  const std::vector<double>& all() const
  {
    return all_;
  }
  const std::vector<double>& own() const
  {
    return own_;
  }

private:
  const std::vector<double>& weights_;
  const double* depth_ = nullptr;
  std::array<double, SAMPLES> weight_;
  std::vector<double> all_, own_;
};

/** Fill `below` with the weight below each edge of the bins. */
void cumulate(const std::vector<double>& histogram, std::vector<double>& below)
{
  below[0] = 0.0;
  std::partial_sum(histogram.begin(), histogram.end(), below.begin() + 1);
}

/** Arguments of one joint, see depthCosts. */
struct Joint
{
  double score, root, offset, gap, own;
  bool covered;
};

/** Return the costs of the candidates of one joint, of which the least is 0. */
void jointCosts(const Constants::Costs& s, const Joint& joint, const Window& window, std::vector<double>& below,
                std::vector<double>& costs, float* result)
{
  const std::vector<double>& surface = window.own();
  cumulate(window.all(), below);
  const int hiding = static_cast<int>(std::min(std::max(1.0, std::nearbyint(joint.gap / s.step)), s.steps + 1.0));
  const double by_score = std::max(std::exp(s.hidden_slope * (s.hidden_score - joint.score)), 1.0);
  const double hidden = (joint.covered ? s.hidden_covered : 1.0) * s.hidden * by_score * s.step;
  const int reach = static_cast<int>(s.kernel_shares.size()) - 1;
  for (int i = 0; i < s.steps; ++i)
  {
    double seen = 0.0;
    for (int from = std::max(i - reach, 0); from <= std::min(i + reach, s.steps - 1); ++from)
    {
      seen += s.kernel_shares[std::abs(from - i)] * surface[from + 1];
    }
    const double front = below[std::max(i + 1 - hiding, 0)];
    const double under = std::max(below[i + 1] - front, 0.0);
    costs[i] = -2.0 * std::log(joint.own * (seen + s.under * under) + hidden * front + s.anything);
  }
  const double least = *std::min_element(costs.begin(), costs.end());
  std::transform(costs.begin(), costs.end(), result, [=](double cost) { return static_cast<float>(cost - least); });
}
}  // namespace

py::array_t<double> rootEvidence(const Constants& method, const Doubles& samples, const Doubles& scores,
                                 const std::optional<Flags>& foreign)
{
  const Constants::Trunk& s = method.trunk;
  const py::ssize_t people = countOf(samples);
  const int depths = s.count;
  const double* depth = checked(samples, "samples", { people, JOINTS, SAMPLES });
  const double* score = checked(scores, "scores", { people, JOINTS });
  const bool* others = checked(foreign, "foreign", { people, JOINTS, SAMPLES });
  py::array_t<double> result(Shape{ people, depths });
  double* out = result.mutable_data();
  py::gil_scoped_release release;
  std::fill_n(out, people * depths, 0.0);
  Window window(method.windows.weights, depths);
  std::vector<double> all_below(depths + 1), own_below(depths + 1);
  const double log_nearest = std::log(s.nearest);
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    const double weight = std::min(1.0, score[row] / method.sizes.least_score);
    if (weight == 0.0 || !window.read(depth + row * SAMPLES))
    {
      continue;
    }
    window.fill(others == nullptr ? nullptr : others + row * SAMPLES, 0,
                [&](double z) { return (std::log(z) - log_nearest) / s.step; });
    cumulate(window.all(), all_below);
    cumulate(window.own(), own_below);
    double* of_person = out + row / JOINTS * depths;
    for (int i = 0; i < depths; ++i)
    {
      const double front = all_below[s.low[i]], behind = all_below[depths] - all_below[s.high[i]];
      const double near = std::max(own_below[s.high[i]] - own_below[s.low[i]], 0.0);
      of_person[i] += weight * std::log(near + s.front * front + s.behind * behind + method.costs.anything);
    }
  }
  return result;
}

py::array_t<float> depthCosts(const Constants& method, const Doubles& samples, const Doubles& scores,
                              const Doubles& root, const Doubles& offsets, const Doubles& gaps, const Doubles& own,
                              const Flags& covered, const std::optional<Flags>& foreign)
{
  const Constants::Costs& s = method.costs;
  const py::ssize_t people = countOf(samples);
  const double* depth = checked(samples, "samples", { people, JOINTS, SAMPLES });
  const double* score = checked(scores, "scores", { people, JOINTS });
  const double* trunk = checked(root, "root", { people });
  const double* offset = checked(offsets, "offsets", { people, JOINTS });
  const double* gap = checked(gaps, "gaps", { people, JOINTS });
  const double* likely_own = checked(own, "own", { people, JOINTS });
  const bool* covered_by_self = checked(covered, "covered", { people, JOINTS });
  const bool* others = checked(foreign, "foreign", { people, JOINTS, SAMPLES });
  py::array_t<float> result(Shape{ people, JOINTS, s.steps });
  float* out = result.mutable_data();
  py::gil_scoped_release release;
  std::fill_n(out, people * JOINTS * s.steps, 0.0f);
  Window window(method.windows.weights, s.steps + 2);
  std::vector<double> below(s.steps + 3), costs(s.steps);
  for (py::ssize_t row = 0; row < people * JOINTS; ++row)
  {
    if (!(score[row] > 0.0) || !window.read(depth + row * SAMPLES))
    {
      continue;
    }
    const Joint joint{ score[row], trunk[row / JOINTS], offset[row], gap[row], likely_own[row], covered_by_self[row] };
    // the first bin holds all that is nearer than the candidates, the last bin all that is further
    window.fill(others == nullptr ? nullptr : others + row * SAMPLES, -1,
                [&](double z) { return (z + joint.offset - joint.root) / s.step + s.half; });
    jointCosts(s, joint, window, below, costs, out + row * s.steps);
  }
  return result;
}
}  // namespace skeleton_extract_3d
