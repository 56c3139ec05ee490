/**
 * Compiled twin of the Python modules openpose_ros_pkg.decode.{peaks, limbs, assembly}, which explain what is done and
 * why; they are the reference.
 *
 * Every operation has the reference's order and precision, so that the results are the same to the last bit. This needs
 * a compiler that does not fuse or reorder floating-point operations (-ffp-contract=off, no -ffast-math).
 */
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace py = pybind11;

namespace openpose_ros_decode
{
/** A stack of maps, (count, height, width), one row after the other. */
struct Maps
{
  const float* data;
  int count;
  int height;
  int width;

  const float* map(int index) const
  {
    return data + static_cast<std::size_t>(index) * height * width;
  }
};

struct PeakSettings
{
  float threshold;      ///< height that a peak must exceed
  int max_per_joint;    ///< how many are kept, the strongest first
  int max_total;
  double scale;         ///< network pixels per cell of the maps
  double max_x, max_y;  ///< peaks beyond are left out [network pixels]
};

struct LimbSettings
{
  float stride;             ///< network pixels per cell of the fields
  const float* steps;       ///< where along a limb the field is sampled, 0..1
  int samples;              ///< number of steps
  float sample_threshold;   ///< component along the limb that a sample needs to count as support
  double min_support;       ///< share of samples that must be support
  float foreshortened;      ///< length below which a limb needs no support [network pixels]
};

struct PersonSettings
{
  int min_joints;
  double min_score;
};

/** A kind of limb: channels of the joints that it connects, and of the components of its field. */
struct Limb
{
  int start;
  int end;
  int paf_x;
  int paf_y;
  bool starts_person;
};

struct Peak
{
  int joint;
  float x;  // [network pixels]
  float y;
  float score;
};

/** A possible limb between two peaks. */
struct LimbCandidate
{
  int limb;
  int start;
  int end;
  float score;
};

struct Person
{
  std::vector<int> peak_of_joint;  // -1: none
  std::vector<int> peaks;          // in the order in which they were added
  double limb_scores = 0.0;
  int limbs = 0;
  double score = 0.0;

  explicit Person(int joints) : peak_of_joint(joints, -1)
  {
  }

  void addPeak(int joint, int peak)
  {
    if (peak_of_joint[joint] < 0)
    {
      peak_of_joint[joint] = peak;
      peaks.push_back(peak);
    }
  }

  bool hasOther(int joint, int peak) const
  {
    return peak_of_joint[joint] >= 0 && peak_of_joint[joint] != peak;
  }
};

// ---- peaks

constexpr int BLOCK = 32;  ///< cells of a row that are passed over together where none exceeds the threshold

/** Whether any value exceeds a threshold; without branches, so that compilers make vector instructions of it. */
bool anyAbove(const float* values, int count, float threshold)
{
  int above = 0;
  for (int i = 0; i < count; ++i)
  {
    above += values[i] > threshold;
  }
  return above > 0;
}

/** Whether a cell is higher than its neighbours; strict on one side only, so that two equal ones are one peak. */
bool isPeak(const float* cell, std::ptrdiff_t row)
{
  const float top = *cell;
  return top > cell[-1] && top > cell[-row] && top > cell[-row - 1] && top > cell[-row + 1] && top >= cell[1] &&
         top >= cell[row] && top >= cell[row - 1] && top >= cell[row + 1];
}

/** Where the parabola through a peak and its two neighbours has its top [cells, within +-0.5]. */
float parabolaOffset(const float* cell, std::ptrdiff_t step)
{
  const float before = cell[-step];
  const float after = cell[step];
  if (!std::isfinite(before) || !std::isfinite(after))
  {
    return 0.0f;
  }
  const float curvature = 2.0f * *cell - before - after;
  return curvature > 0.0f ? std::min(std::max((after - before) / (2.0f * curvature), -0.5f), 0.5f) : 0.0f;
}

bool isStronger(const Peak& first, const Peak& second)
{
  return first.score > second.score;
}

void keepStrongest(std::vector<Peak>& peaks, std::size_t count)
{
  if (peaks.size() <= count)
  {
    return;
  }
  std::vector<std::size_t> order(peaks.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&peaks](std::size_t a, std::size_t b) { return isStronger(peaks[a], peaks[b]); });
  order.resize(count);
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < count; ++i)
  {
    peaks[i] = peaks[order[i]];  // order[i] >= i
  }
  peaks.resize(count);
}

/** Find the peaks of maps that are framed with -infinity, sorted by joint, the strongest of each joint first. */
std::vector<Peak> findPeaks(const Maps& maps, const PeakSettings& settings)
{
  std::vector<Peak> peaks;
  for (int joint = 0; joint < maps.count; ++joint)
  {
    const std::size_t first = peaks.size();
    for (int v = 1; v < maps.height - 1; ++v)
    {
      const float* row = maps.map(joint) + static_cast<std::size_t>(v) * maps.width;
      for (int u = 1; u < maps.width - 1; ++u)
      {
        if (u % BLOCK == 1 && !anyAbove(row + u, std::min(BLOCK, maps.width - 1 - u), settings.threshold))
        {
          u += BLOCK - 1;
          continue;
        }
        if (!(row[u] > settings.threshold) || !isPeak(row + u, maps.width))
        {
          continue;
        }
        const double column = u - 1 + static_cast<double>(parabolaOffset(row + u, 1));
        const double line = v - 1 + static_cast<double>(parabolaOffset(row + u, maps.width));
        const float x = static_cast<float>((column + 0.5) * settings.scale - 0.5);
        const float y = static_cast<float>((line + 0.5) * settings.scale - 0.5);
        if (x <= settings.max_x && y <= settings.max_y)
        {
          peaks.push_back({ joint, x, y, std::min(row[u], 1.0f) });
        }
      }
    }
    std::stable_sort(peaks.begin() + first, peaks.end(), isStronger);
    peaks.resize(std::min(peaks.size(), first + settings.max_per_joint), Peak{});
  }
  keepStrongest(peaks, settings.max_total);
  return peaks;
}

// ---- limbs

/** Number of samples that may lie outside the field of a limb with enough support. */
int allowedMisses(const LimbSettings& settings)
{
  int support = settings.samples;
  while (support > 0 && static_cast<double>(support - 1) / settings.samples >= settings.min_support - 1e-6)
  {
    --support;
  }
  return settings.samples - support;
}

/** Rate every pair of peaks that a limb may connect, and keep those with support. */
std::vector<LimbCandidate> scoreLimbs(const Maps& pafs, const std::vector<Peak>& peaks, int joints,
                                      const std::vector<Limb>& limbs, const LimbSettings& settings)
{
  std::vector<int> bounds(joints + 1, 0);  // of each joint's peaks
  std::vector<float> u, v;                 // [cells]
  for (const Peak& peak : peaks)
  {
    ++bounds[peak.joint + 1];
    u.push_back((peak.x + 0.5f) / settings.stride - 0.5f);
    v.push_back((peak.y + 0.5f) / settings.stride - 0.5f);
  }
  std::partial_sum(bounds.begin(), bounds.end(), bounds.begin());

  const int allowed_misses = allowedMisses(settings);
  const int first_look = std::min(allowed_misses + 1, settings.samples);
  const int first_sample = (settings.samples - first_look) / 2;
  const float half_height = static_cast<float>(0.5 * pafs.height);
  std::vector<LimbCandidate> candidates;
  for (int limb = 0; limb < static_cast<int>(limbs.size()); ++limb)
  {
    const float* paf_x = pafs.map(limbs[limb].paf_x);
    const float* paf_y = pafs.map(limbs[limb].paf_y);
    for (int start = bounds[limbs[limb].start]; start < bounds[limbs[limb].start + 1]; ++start)
    {
      for (int end = bounds[limbs[limb].end]; end < bounds[limbs[limb].end + 1]; ++end)
      {
        const float du = u[end] - u[start];
        const float dv = v[end] - v[start];
        const float length = std::max(std::sqrt(du * du + dv * dv), 1e-3f);
        const auto affinity = [&](int sample) {
          const long column = std::lrint(u[start] + settings.steps[sample] * du);
          const long line = std::lrint(v[start] + settings.steps[sample] * dv);
          const long cell = std::min(std::max(line, 0L), pafs.height - 1L) * pafs.width +
                            std::min(std::max(column, 0L), pafs.width - 1L);
          return paf_x[cell] * (du / length) + paf_y[cell] * (dv / length);
        };
        // Most pairs belong to different people; of these the first few samples in the middle are all misses.
        int misses = 0;
        while (misses < first_look && !(affinity(first_sample + misses) > settings.sample_threshold))
        {
          ++misses;
        }
        float sum = 0.0f;
        if (misses <= allowed_misses)
        {
          misses = 0;
          for (int i = 0; i < settings.samples; ++i)
          {
            const float along = affinity(i);
            sum += along;
            misses += !(along > settings.sample_threshold);
          }
        }
        const float score = sum / settings.samples + std::min(half_height / length - 1.0f, 0.0f);
        if (misses <= allowed_misses && score > 0.0f)
        {
          candidates.push_back({ limb, start, end, score });
        }
        else if (length * settings.stride < settings.foreshortened)
        {
          candidates.push_back({ limb, start, end, 0.0f });
        }
      }
    }
  }
  return candidates;
}

// ---- assembly

/** Choose the limbs that win: each peak is used once per kind of limb. */
std::vector<LimbCandidate> matchLimbs(std::vector<LimbCandidate> candidates, const std::vector<Peak>& peaks,
                                      std::size_t limbs)
{
  const auto priority = [&peaks](const LimbCandidate& limb) {
    return limb.score + 0.5f * (peaks[limb.start].score + peaks[limb.end].score);
  };
  const auto precedes = [&priority](const LimbCandidate& first, const LimbCandidate& second) {
    if ((first.score <= 0.0f) != (second.score <= 0.0f))
    {
      return second.score <= 0.0f;
    }
    return first.limb != second.limb ? first.limb < second.limb : priority(first) > priority(second);
  };
  std::stable_sort(candidates.begin(), candidates.end(), precedes);

  std::vector<bool> used(limbs * peaks.size(), false);
  std::vector<LimbCandidate> matched;
  for (const LimbCandidate& candidate : candidates)
  {
    const std::size_t offset = candidate.limb * peaks.size();
    if (!used[offset + candidate.start] && !used[offset + candidate.end])
    {
      used[offset + candidate.start] = used[offset + candidate.end] = true;
      matched.push_back(candidate);
    }
  }
  return matched;
}

bool shareJoint(const Person& first, const Person& second)
{
  for (std::size_t joint = 0; joint < first.peak_of_joint.size(); ++joint)
  {
    if (first.peak_of_joint[joint] >= 0 && second.peak_of_joint[joint] >= 0)
    {
      return true;
    }
  }
  return false;
}

/** Merge limbs into people, in the order of the first of their peaks; each peak belongs to one person at most. */
std::vector<Person> mergeLimbs(const std::vector<LimbCandidate>& matched, const std::vector<Peak>& peaks, int joints,
                               const std::vector<Limb>& limbs)
{
  std::vector<Person> people;  // some of them swallowed by others
  std::vector<int> owner(peaks.size(), -1);
  std::vector<int> owned;  // peaks in the order in which they got an owner
  for (const LimbCandidate& limb : matched)
  {
    const int first = owner[limb.start];
    const int second = owner[limb.end];
    int person = first >= 0 ? first : second;
    if (person < 0)
    {
      if (!limbs[limb.limb].starts_person || limb.score <= 0.0f)
      {
        continue;
      }
      person = static_cast<int>(people.size());
      people.emplace_back(joints);
    }
    else if (first >= 0 && second >= 0 && first != second)
    {
      if (shareJoint(people[first], people[second]))
      {
        continue;  // two people who touch: they stay apart
      }
      people[first].limb_scores += people[second].limb_scores;
      people[first].limbs += people[second].limbs;
      for (const int peak : people[second].peaks)
      {
        people[first].addPeak(peaks[peak].joint, peak);
        owner[peak] = first;
      }
    }
    if (people[person].hasOther(peaks[limb.start].joint, limb.start) ||
        people[person].hasOther(peaks[limb.end].joint, limb.end))
    {
      continue;  // the person has this joint elsewhere already
    }
    for (const int peak : { limb.start, limb.end })
    {
      people[person].addPeak(peaks[peak].joint, peak);
      if (owner[peak] < 0)
      {
        owned.push_back(peak);
      }
      owner[peak] = person;
    }
    people[person].limb_scores += limb.score;
    people[person].limbs += limb.score > 0.0f;
  }

  std::vector<Person> merged;
  std::vector<bool> listed(people.size(), false);
  for (const int peak : owned)
  {
    if (!listed[owner[peak]])
    {
      listed[owner[peak]] = true;
      merged.push_back(people[owner[peak]]);
    }
  }
  return merged;
}

/** Return the people with enough joints and score, the surest first. */
std::vector<Person> assemble(const std::vector<LimbCandidate>& candidates, const std::vector<Peak>& peaks, int joints,
                             const std::vector<Limb>& limbs, const PersonSettings& settings)
{
  std::vector<Person> kept;
  for (Person& person : mergeLimbs(matchLimbs(candidates, peaks, limbs.size()), peaks, joints, limbs))
  {
    double total = person.limb_scores;
    for (const int peak : person.peaks)
    {
      total += static_cast<double>(peaks[peak].score);
    }
    const int count = static_cast<int>(person.peaks.size());
    person.score = std::min(total / (count + person.limbs), 1.0);
    if (count >= settings.min_joints && person.score >= settings.min_score)
    {
      kept.push_back(person);
    }
  }
  std::stable_sort(kept.begin(), kept.end(), [](const Person& a, const Person& b) { return a.score > b.score; });
  return kept;
}

// ---- interface to Python

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using IntArray = py::array_t<int, py::array::c_style | py::array::forcecast>;

Maps asMaps(const FloatArray& array, const char* name)
{
  if (array.ndim() != 3)
  {
    throw std::invalid_argument(std::string(name) + " must have 3 dimensions, got " + std::to_string(array.ndim()));
  }
  return { array.data(), static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
           static_cast<int>(array.shape(2)) };
}

std::vector<Limb> asLimbs(const IntArray& array, int joints, int channels)
{
  if (array.ndim() != 2 || array.shape(1) != 5)
  {
    throw std::invalid_argument("limbs must be of shape (L, 5)");
  }
  const auto rows = array.unchecked<2>();
  const auto within = [](int index, int count) { return index >= 0 && index < count; };
  std::vector<Limb> limbs;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
  {
    const Limb limb{ rows(i, 0), rows(i, 1), rows(i, 2), rows(i, 3), rows(i, 4) != 0 };
    if (!within(limb.start, joints) || !within(limb.end, joints) || !within(limb.paf_x, channels) ||
        !within(limb.paf_y, channels))
    {
      throw std::invalid_argument("limb " + std::to_string(i) + " names a joint or channel that is not there: " +
                                  std::to_string(joints) + " joints, " + std::to_string(channels) + " channels");
    }
    limbs.push_back(limb);
  }
  return limbs;
}

py::tuple asArrays(const std::vector<Person>& people, const std::vector<Peak>& peaks, int joints)
{
  const auto count = static_cast<py::ssize_t>(people.size());
  py::array_t<float> keypoints({ count, static_cast<py::ssize_t>(joints), static_cast<py::ssize_t>(3) });
  py::array_t<float> scores(count);
  auto points = keypoints.mutable_unchecked<3>();
  auto score = scores.mutable_unchecked<1>();
  for (py::ssize_t i = 0; i < count; ++i)
  {
    score(i) = static_cast<float>(people[i].score);
    for (int joint = 0; joint < joints; ++joint)
    {
      const int peak = people[i].peak_of_joint[joint];
      points(i, joint, 0) = peak >= 0 ? peaks[peak].x : std::numeric_limits<float>::quiet_NaN();
      points(i, joint, 1) = peak >= 0 ? peaks[peak].y : std::numeric_limits<float>::quiet_NaN();
      points(i, joint, 2) = peak >= 0 ? peaks[peak].score : 0.0f;
    }
  }
  return py::make_tuple(keypoints, scores);
}

py::tuple decode(const FloatArray& maps, const FloatArray& pafs, const IntArray& limbs, const FloatArray& steps,
                 double stride, double upsample, float peak_threshold, int max_peaks_per_joint, int max_peaks,
                 double max_x, double max_y, float sample_threshold, double min_support, float foreshortened,
                 int min_joints, double min_score)
{
  const Maps framed_maps = asMaps(maps, "maps");
  const Maps fields = asMaps(pafs, "pafs");
  const std::vector<Limb> kinds = asLimbs(limbs, framed_maps.count, fields.count);
  const PeakSettings peak_settings{ peak_threshold, max_peaks_per_joint, max_peaks, stride / upsample, max_x, max_y };
  const LimbSettings limb_settings{ static_cast<float>(stride), steps.data(),    static_cast<int>(steps.size()),
                                    sample_threshold,           min_support, foreshortened };
  std::vector<Peak> peaks;
  std::vector<Person> people;
  {
    py::gil_scoped_release release;
    peaks = findPeaks(framed_maps, peak_settings);
    const auto candidates = scoreLimbs(fields, peaks, framed_maps.count, kinds, limb_settings);
    people = assemble(candidates, peaks, framed_maps.count, kinds, { min_joints, min_score });
  }
  return asArrays(people, peaks, framed_maps.count);
}
}  // namespace openpose_ros_decode

PYBIND11_MODULE(openpose_ros_decode, module)
{
  module.doc() = "Compiled twin of openpose_ros_pkg.decode.";
  module.def("decode", &openpose_ros_decode::decode,
             "Return keypoints (P, K, 3) and scores (P,), as openpose_ros_pkg.decode.decode does.\n\n"
             "maps: (K, H + 2, W + 2) float32 enlarged confidence maps, framed with -inf. pafs: (C, h, w) float32.\n"
             "limbs: (L, 5) int: start, end, channels of x and y, whether it starts a person. steps: (S,) float32 0..1.",
             py::arg("maps"), py::arg("pafs"), py::arg("limbs"), py::arg("steps"), py::arg("stride"),
             py::arg("upsample"), py::arg("peak_threshold"), py::arg("max_peaks_per_joint"), py::arg("max_peaks"),
             py::arg("max_x"), py::arg("max_y"), py::arg("sample_threshold"), py::arg("min_support"),
             py::arg("foreshortened"), py::arg("min_joints"), py::arg("min_score"));
}
