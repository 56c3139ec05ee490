/** Line integrals of part affinity fields: which pairs of peaks may be limbs. */
#include <algorithm>
#include <cmath>
#include <numeric>

#include "types.h"

namespace openpose_ros_decode
{
namespace
{
constexpr float LEAST_LENGTH = 1e-3f;       ///< of a limb, so that nothing is divided by zero [cells]
constexpr double SUPPORT_TOLERANCE = 1e-6;  ///< for shares of samples that are no binary fractions

/** The field of a kind of limb along the line between two peaks [cells]. */
struct LimbField
{
  const Maps& pafs;
  const float* x;
  const float* y;
  float u = 0.0f, v = 0.0f, du = 0.0f, dv = 0.0f, length = 1.0f;

  void setLine(const Peak& start, const Peak& end, float stride)
  {
    u = (start.x + 0.5f) / stride - 0.5f;
    v = (start.y + 0.5f) / stride - 0.5f;
    du = (end.x + 0.5f) / stride - 0.5f - u;
    dv = (end.y + 0.5f) / stride - 0.5f - v;
    length = std::max(std::sqrt(du * du + dv * dv), LEAST_LENGTH);
  }

  /** Return the component along the line at a share of it, 0 at the start .. 1 at the end. */
  float along(float share) const
  {
    const long column = std::min(std::max(std::lrint(u + share * du), 0L), pafs.width - 1L);
    const long row = std::min(std::max(std::lrint(v + share * dv), 0L), pafs.height - 1L);
    const long cell = row * pafs.width + column;
    return x[cell] * (du / length) + y[cell] * (dv / length);
  }
};

/** Return where lines are sampled, 0 at the start .. 1 at the end. */
std::vector<float> sampleSteps(int samples)
{
  std::vector<float> steps(samples, 1.0f);
  for (int i = 0; i < samples - 1; ++i)
  {
    steps[i] = static_cast<float>(i * (1.0 / (samples - 1)));
  }
  return steps;
}

/** Return the mean of the field along its line, or 0 if more samples than allowed lie outside. */
float meanAlong(const LimbField& field, const std::vector<float>& steps, int allowed_misses, float threshold)
{
  const int samples = static_cast<int>(steps.size());
  // Most pairs belong to different people; of these the first few samples in the middle are all misses.
  const int first_look = std::min(allowed_misses + 1, samples);
  const int first_sample = (samples - first_look) / 2;
  int misses = 0;
  while (misses < first_look && !(field.along(steps[first_sample + misses]) > threshold))
  {
    ++misses;
  }
  if (misses > allowed_misses)
  {
    return 0.0f;
  }
  misses = 0;
  float sum = 0.0f;
  for (const float step : steps)
  {
    const float along = field.along(step);
    sum += along;
    misses += !(along > threshold);
  }
  return misses <= allowed_misses ? sum / samples : 0.0f;
}
}  // namespace

std::vector<LimbCandidate> scoreLimbs(const Maps& pafs, const std::vector<Peak>& peaks, int joints,
                                      const std::vector<Limb>& limbs, float stride, const Settings& settings)
{
  std::vector<int> bounds(joints + 1, 0);  // of the peaks of each joint
  for (const Peak& peak : peaks)
  {
    ++bounds[peak.joint + 1];
  }
  std::partial_sum(bounds.begin(), bounds.end(), bounds.begin());

  const std::vector<float> steps = sampleSteps(settings.limb_samples);
  const double support = std::ceil((settings.limb_min_support - SUPPORT_TOLERANCE) * settings.limb_samples);
  const int allowed_misses = settings.limb_samples - std::max(static_cast<int>(support), 0);
  const float long_limb = static_cast<float>(settings.long_limb * pafs.height);  // [cells]
  const float foreshortened = static_cast<float>(settings.foreshortened_limb * stride *
                                                 std::sqrt(static_cast<double>(pafs.height) * pafs.width));
  std::vector<LimbCandidate> candidates;
  for (int limb = 0; limb < static_cast<int>(limbs.size()); ++limb)
  {
    LimbField field{ pafs, pafs.map(limbs[limb].paf_x), pafs.map(limbs[limb].paf_y) };
    for (int start = bounds[limbs[limb].start]; start < bounds[limbs[limb].start + 1]; ++start)
    {
      for (int end = bounds[limbs[limb].end]; end < bounds[limbs[limb].end + 1]; ++end)
      {
        field.setLine(peaks[start], peaks[end], stride);
        const float penalty = std::min(long_limb / field.length - 1.0f, 0.0f);
        const float score = meanAlong(field, steps, allowed_misses, settings.limb_sample_threshold) + penalty;
        if (score > 0.0f)
        {
          candidates.push_back({ limb, start, end, score });
        }
        else if (field.length * stride < foreshortened)
        {
          candidates.push_back({ limb, start, end, 0.0f });
        }
      }
    }
  }
  return candidates;
}
}  // namespace openpose_ros_decode
