/** What the steps of the decoder take and return; openpose_ros_pkg/decode/paf.py explains the method. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace openpose_ros_decode
{
/** A stack of maps, (count, height, width), one row after the other. */
struct Maps
{
  const float* data;
  int count, height, width;

  const float* map(int index) const
  {
    return data + static_cast<std::size_t>(index) * height * width;
  }
};

/** Thresholds (DecodeParams) and constants of the method (DecodeConstants). */
struct Settings
{
  int max_peaks_per_joint, max_peaks;
  int limb_samples;
  float limb_sample_threshold;
  double limb_min_support;
  int person_min_joints;
  double person_min_score;
  double foreshortened_limb, long_limb;
  float peak_weight;
};

/** A kind of limb: channels of the joints that it connects, and of the components of its field. */
struct Limb
{
  std::int32_t start, end, paf_x, paf_y, starts_person;
};

/** A possible joint [px of the network's input]. */
struct Peak
{
  std::int32_t joint;
  float x, y, score;
};

/** A possible limb between two peaks, by their indices; score 0 if only their nearness speaks for it. */
struct LimbCandidate
{
  std::int32_t limb, start, end;
  float score;
};

struct Person
{
  std::vector<int> peak_of_joint;  ///< -1: missing
  double limb_scores = 0.0;
  int limbs = 0;
  double score = 0.0;
};

/** Find the peaks of maps that are framed with -infinity, by joint, the strongest first, with x and y up to a limit. */
std::vector<Peak> findPeaks(const Maps& maps, double scale, double max_x, double max_y, float threshold,
                            const Settings& settings);

/** Rate every pair of peaks, sorted by joint, that a limb may connect, and keep those with support. */
std::vector<LimbCandidate> scoreLimbs(const Maps& pafs, const std::vector<Peak>& peaks, int joints,
                                      const std::vector<Limb>& limbs, float stride, const Settings& settings);

/** Match limbs greedily, the best first, and merge those that share a joint into people, the surest first. */
std::vector<Person> assemble(std::vector<LimbCandidate> candidates, const std::vector<Peak>& peaks, int joints,
                             const std::vector<Limb>& limbs, const Settings& settings);
}  // namespace openpose_ros_decode
