/** Greedy assembly of limbs into people. */
#include <algorithm>

#include "types.h"

namespace openpose_ros_decode
{
namespace
{
/** Choose the limbs that win: each peak is used once per kind of limb. */
std::vector<LimbCandidate> matchLimbs(std::vector<LimbCandidate> candidates, const std::vector<Peak>& peaks,
                                      std::size_t limbs, float peak_weight)
{
  const auto priority = [&](const LimbCandidate& limb) {
    return limb.score + peak_weight * (peaks[limb.start].score + peaks[limb.end].score);
  };
  // Limbs of score 0 come last: they only add to people that others have started.
  const auto precedes = [&](const LimbCandidate& first, const LimbCandidate& second) {
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

/** Join a person to another one, unless both have a joint; return whether that was done. */
bool join(Person& person, Person& other)
{
  std::vector<int> joined = person.peak_of_joint;
  for (std::size_t joint = 0; joint < joined.size(); ++joint)
  {
    if (joined[joint] >= 0 && other.peak_of_joint[joint] >= 0)
    {
      return false;
    }
    joined[joint] = std::max(joined[joint], other.peak_of_joint[joint]);
  }
  person = { joined, person.limb_scores + other.limb_scores, person.limbs + other.limbs };
  other.peak_of_joint.assign(joined.size(), -1);
  return true;
}

/** Merge limbs into people; each peak belongs to one person at most. People that were merged into others have no joints. */
std::vector<Person> mergeLimbs(const std::vector<LimbCandidate>& matched, const std::vector<Peak>& peaks, int joints,
                               const std::vector<Limb>& limbs)
{
  std::vector<Person> people;
  std::vector<int> owner(peaks.size(), -1);
  for (const LimbCandidate& limb : matched)
  {
    int first = owner[limb.start];
    const int second = owner[limb.end];
    if (first < 0 && second < 0)
    {
      if (!limbs[limb.limb].starts_person || limb.score <= 0.0f)
      {
        continue;
      }
      people.push_back({ std::vector<int>(joints, -1) });
      first = static_cast<int>(people.size()) - 1;
    }
    else if (first >= 0 && second >= 0 && first != second)
    {
      if (!join(people[first], people[second]))
      {
        continue;  // two people who touch: they stay apart
      }
      std::replace(owner.begin(), owner.end(), second, first);
    }
    Person& person = people[first >= 0 ? first : second];
    int& start = person.peak_of_joint[peaks[limb.start].joint];
    int& end = person.peak_of_joint[peaks[limb.end].joint];
    if ((start >= 0 && start != limb.start) || (end >= 0 && end != limb.end))
    {
      continue;  // the person has this joint elsewhere already
    }
    start = limb.start;
    end = limb.end;
    owner[limb.start] = owner[limb.end] = first >= 0 ? first : second;
    person.limb_scores += limb.score;
    person.limbs += limb.score > 0.0f;
  }
  return people;
}
}  // namespace

std::vector<Person> assemble(std::vector<LimbCandidate> candidates, const std::vector<Peak>& peaks, int joints,
                             const std::vector<Limb>& limbs, const Settings& settings)
{
  std::vector<Person> kept;
  const auto matched = matchLimbs(std::move(candidates), peaks, limbs.size(), settings.peak_weight);
  for (Person& person : mergeLimbs(matched, peaks, joints, limbs))
  {
    double total = person.limb_scores;
    int count = 0;
    for (const int peak : person.peak_of_joint)
    {
      if (peak >= 0)
      {
        total += peaks[peak].score;
        ++count;
      }
    }
    person.score = count > 0 ? std::min(total / (count + person.limbs), 1.0) : 0.0;
    if (count >= settings.person_min_joints && person.score >= settings.person_min_score)
    {
      kept.push_back(std::move(person));
    }
  }
  std::stable_sort(kept.begin(), kept.end(), [](const Person& a, const Person& b) { return a.score > b.score; });
  return kept;
}
}  // namespace openpose_ros_decode
