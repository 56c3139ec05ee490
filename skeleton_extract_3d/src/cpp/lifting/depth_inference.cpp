/** Depths of all joints of a person at once, by passing messages between them; see robust.py. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cost_tables.h"
#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
/** Places whose depths are inferred: roots, middles and ends of the limbs, and the middle of the ears. */
constexpr int ROOT = 0, MIDDLE = LIMBS, END = 2 * LIMBS, HEAD = 3 * LIMBS, PLACES = HEAD + 1;
/** Bones between them: upper and lower ones of the limbs, between the pairs of roots, trunk and neck. */
constexpr int UPPER = 0, LOWER = LIMBS, PAIR = 2 * LIMBS, TRUNK = PAIR + PAIRS, NECK = TRUNK + 1, BONES = NECK + 1;

struct Person
{
  const float* costs;  ///< (13, steps)
  std::array<Ray, PLACES> rays;
  std::array<Length, BONES> bones;
  double root;   ///< depth of the trunk [m]
  double scale;  ///< stature in statures of an adult
  Direction left_before;
};

Ray middle(const Ray& a, const Ray& b)
{
  return { (a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2 };
}

/** Return mean around the best candidate and standard deviation, in candidates and from the first one. */
std::pair<double, double> readDepth(const float* beliefs, int steps, int mode)
{
  const float least = *std::min_element(beliefs, beliefs + steps);
  std::vector<float> likelihood(steps);
  float total = 0.0f;
  for (int i = 0; i < steps; ++i)
  {
    likelihood[i] = std::exp(-0.5f * (beliefs[i] - least));
    total += likelihood[i];
  }
  const int best = static_cast<int>(std::max_element(likelihood.begin(), likelihood.end()) - likelihood.begin());
  double mean = 0.0, weight = 0.0, variance = 0.0;
  for (int i = std::max(best - mode, 0); i <= std::min(best + mode, steps - 1); ++i)
  {
    mean += static_cast<double>(likelihood[i]) * i;
    weight += likelihood[i];
  }
  mean /= weight;
  for (int i = 0; i < steps; ++i)
  {
    variance += likelihood[i] / total * (i - mean) * (i - mean);
  }
  return { mean, std::sqrt(variance) };
}

/** Infers the depths of one person after the other; keeps the memory for the tables. */
class DepthInference
{
public:
  explicit DepthInference(const Constants& method) : method_(method)
  {
  }

  /** Infer a person's depths: fill the min-marginals (13, steps), and return the direction to the person's left. */
  Direction infer(const Person& person, float* beliefs)
  {
    fillTrunk(person);
    trunkBeliefs(person.costs, beliefs);
    const auto [left, forward] = facing(person, beliefs);
    addTurnCosts(person, left);
    fillLimbs(person, left, forward);
    Message roots_in(LIMBS * steps_);
    passInwards(person.costs, roots_in.data());
    trunkBeliefs(roots_in.data(), beliefs);
    passOutwards(person.costs, beliefs);
    return left;
  }

private:
  /** Place the candidates, and fill the tables between shoulders, hips and head. */
  void fillTrunk(const Person& person)
  {
    const double step = method_.costs.step;
    for (int i = 0; i < steps_; ++i)
    {
      z_[i] = static_cast<float>(std::max(person.root + (i - method_.costs.half) * step, method_.trunk.nearest));
    }
    // the middle of a pair of joints is between two candidates as well
    for (int i = 0; i < middles_; ++i)
    {
      const double z = person.root + (i - 2 * method_.costs.half) * (step / 2);
      z_middle_[i] = static_cast<float>(std::max(z, method_.trunk.nearest));
    }
    const auto& rays = person.rays;
    const Candidates neck{ z_middle_, middle(rays[0], rays[1]) }, hips{ z_middle_, middle(rays[2], rays[3]) };
    lengthCosts(neck, hips, person.bones[TRUNK], s_.length_limit, trunk_);
    lengthCosts(neck, { z_, rays[HEAD] }, person.bones[NECK], s_.length_limit, head_);
    for (int pair = 0; pair < PAIRS; ++pair)
    {
      lengthCosts({ z_, rays[2 * pair] }, { z_, rays[2 * pair + 1] }, person.bones[PAIR + pair], s_.length_limit,
                  pair_[pair]);
    }
    std::copy_n(person.costs + HEAD * steps_, steps_, incoming_.begin());
    passToRows(head_, incoming_, from_head_.data());
  }

  /** Pass messages between shoulders, hips and head: roots_in and beliefs are (4, steps). */
  void trunkBeliefs(const float* roots_in, float* beliefs)
  {
    leastByMiddle(roots_in, 0, shoulders_);
    leastByMiddle(roots_in, 1, hips_);
    passToRows(trunk_, hips_, from_hips_.data());
    add(shoulders_, from_head_, to_pair_);
    passToColumns(trunk_, to_pair_, from_shoulders_.data());
    add(from_head_, from_hips_, to_pair_);
    pairBeliefs(filled_pair_[0], to_pair_, beliefs, beliefs + steps_);
    pairBeliefs(filled_pair_[1], from_shoulders_, beliefs + 2 * steps_, beliefs + 3 * steps_);
  }

  static void add(const Message& a, const Message& b, Message& result)
  {
    std::transform(a.begin(), a.end(), b.begin(), result.begin(), std::plus<>());
  }

  /** Add what comes from both joints of a pair, and find the least cost of each middle. */
  void leastByMiddle(const float* roots_in, int pair, Message& least)
  {
    const int columns = steps_;
    const float *left = roots_in + 2 * pair * columns, *right = left + columns;
    std::fill_n(least.begin(), middles_, INFINITE);
    for (int i = 0; i < steps_; ++i)
    {
      const float* row = pair_[pair].row(i);
      float* filled = filled_pair_[pair].row(i);
      const float from_left = left[i];
      for (int j = 0; j < columns; ++j)
      {
        filled[j] = row[j] + from_left + right[j];
      }
      lower(filled, 0.0f, columns, least.data() + i);
    }
  }

  /** Find the least cost through each candidate of the joints of a pair, given what comes to each middle. */
  void pairBeliefs(const Table& filled, const Message& of_middle, float* left, float* right) const
  {
    std::fill_n(right, steps_, INFINITE);
    for (int i = 0; i < steps_; ++i)
    {
      const float* row = filled.row(i);
      const float* incoming = of_middle.data() + i;
      left[i] = leastSum(row, incoming, filled.stride);
      for (int j = 0; j < filled.columns; ++j)
      {
        right[j] = lesser(row[j] + incoming[j], right[j]);
      }
    }
  }

  /** Return the directions to the left and forwards of the person, by the beliefs in shoulders and hips. */
  std::pair<Direction, Direction> facing(const Person& person, const float* beliefs) const
  {
    std::array<Direction, LIMBS> at;
    std::array<double, LIMBS> variance;
    const double step = method_.costs.step;
    for (int i = 0; i < LIMBS; ++i)
    {
      const auto [number, deviation] = readDepth(beliefs + i * steps_, steps_, s_.mode);
      const Ray& ray = person.rays[i];
      at[i] = Direction{ ray.x, ray.y, ray.z } * (person.root + (number - method_.costs.half) * step);
      variance[i] = deviation * step * (deviation * step);
    }
    const double error = s_.keypoint_error * s_.keypoint_error;
    const Direction across = (at[0] - at[1]) * (1 / (variance[0] + variance[1] + error)) +
                             (at[2] - at[3]) * (1 / (variance[2] + variance[3] + error));
    const Direction left = unit(unit(across) + person.left_before);
    const Direction up = unit(at[0] + at[1] - (at[2] + at[3]));
    return { left, unit(cross(left, up)) };
  }

  /** Add the costs of shoulders and hips that are turned otherwise than the person. */
  void addTurnCosts(const Person& person, const Direction& left)
  {
    for (int pair = 0; pair < PAIRS; ++pair)
    {
      const float turn = person.bones[PAIR + pair].mean * static_cast<float>(left.z), limit = method_.costs.limit;
      const float certainty = static_cast<float>(1 / s_.turn_spread[pair]);
      for (int i = 0; i < steps_; ++i)
      {
        float* row = pair_[pair].row(i);
        const float* z = z_.data();
        const float z_start = z[i];
        for (int j = 0, columns = steps_; j < columns; ++j)
        {
          const float turned = (z_start - z[j] - turn) * certainty;
          row[j] += lesser(turned * turned, limit);
        }
      }
    }
  }

  /** Fill the tables of the limbs. */
  void fillLimbs(const Person& person, const Direction& left, const Direction& forward)
  {
    const Constants::Body& body = method_.body;
    const auto fill = [&](int bone, int start, int end, const std::vector<double>& mean,
                          const std::vector<double>& spread, int limb, Table& table) {
      const Candidates from{ z_, person.rays[start + limb] }, to{ z_, person.rays[end + limb] };
      lengthCosts(from, to, person.bones[bone + limb], s_.length_limit, table);
      const auto lead = [&](const Direction& axis, int i) {
        const double sigma = spread[2 * limb + i] * person.scale;
        return Lead{ axis, static_cast<float>(mean[2 * limb + i] * person.scale / sigma), sigma };
      };
      const Direction outwards = left * method_.joints.sides[limb];
      addDirectionCosts(from, to, lead(outwards, 0), lead(forward, 1), method_.costs.limit, table);
    };
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      fill(UPPER, ROOT, MIDDLE, body.upper_directions, body.upper_direction_spreads, limb, upper_[limb]);
      fill(LOWER, MIDDLE, END, body.lower_directions, body.lower_direction_spreads, limb, lower_[limb]);
    }
  }

  /** Pass messages from the ends of the limbs to their roots: roots_in is (4, steps). */
  void passInwards(const float* costs, float* roots_in)
  {
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      std::copy_n(costs + (END + limb) * steps_, steps_, incoming_.begin());
      passToRows(lower_[limb], incoming_, from_ends_[limb].data());
      const float *of_middle = costs + (MIDDLE + limb) * steps_, *of_root = costs + (ROOT + limb) * steps_;
      std::transform(of_middle, of_middle + steps_, from_ends_[limb].begin(), middles_in_[limb].begin(), std::plus<>());
      passToRows(upper_[limb], middles_in_[limb], from_middles_[limb].data());
      std::transform(of_root, of_root + steps_, from_middles_[limb].begin(), roots_in + limb * steps_, std::plus<>());
    }
  }

  /** Pass messages from the roots of the limbs, whose beliefs are known, to their ends, and to the head. */
  void passOutwards(const float* costs, float* beliefs)
  {
    Message outgoing(steps_);
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      const float *of_root = beliefs + (ROOT + limb) * steps_, *end_costs = costs + (END + limb) * steps_;
      float *of_middle = beliefs + (MIDDLE + limb) * steps_, *of_end = beliefs + (END + limb) * steps_;
      std::transform(of_root, of_root + steps_, from_middles_[limb].begin(), outgoing.begin(), std::minus<>());
      passToColumns(upper_[limb], outgoing, of_middle);
      std::transform(of_middle, of_middle + steps_, middles_in_[limb].begin(), of_middle, std::plus<>());
      std::transform(of_middle, of_middle + steps_, from_ends_[limb].begin(), outgoing.begin(), std::minus<>());
      passToColumns(lower_[limb], outgoing, of_end);
      std::transform(of_end, of_end + steps_, end_costs, of_end, std::plus<>());
    }
    add(shoulders_, from_hips_, to_pair_);
    float* of_head = beliefs + HEAD * steps_;
    passToColumns(head_, to_pair_, of_head);
    std::transform(of_head, of_head + steps_, costs + HEAD * steps_, of_head, std::plus<>());
  }

  const Constants& method_;
  const Constants::Inference& s_ = method_.inference;
  int steps_ = method_.costs.steps, middles_ = 2 * steps_ - 1;  ///< candidates of a joint, and of the middle of two
  Message z_ = Message(steps_), z_middle_ = Message(middles_);
  Table trunk_{ middles_, middles_ }, head_{ middles_, steps_ };
  std::vector<Table> pair_ = std::vector<Table>(PAIRS, Table(steps_, steps_)), filled_pair_ = pair_;
  std::vector<Table> upper_ = std::vector<Table>(LIMBS, Table(steps_, steps_)), lower_ = upper_;
  // room for a message to places with any number of candidates, also where a row begins in its midst
  Message from_head_ = Message(filledUp(middles_) + filledUp(steps_)), shoulders_ = from_head_, hips_ = from_head_;
  Message from_hips_ = from_head_, from_shoulders_ = from_head_, to_pair_ = from_head_, incoming_ = from_head_;
  std::vector<Message> from_ends_ = std::vector<Message>(LIMBS, from_head_), from_middles_ = from_ends_;
  std::vector<Message> middles_in_ = from_ends_;
};
}  // namespace

py::tuple inferDepths(const Constants& method, const Floats& costs, const Floats& rays, const Doubles& root,
                      const Floats& lengths, const Floats& sigmas, const Doubles& stature, const Doubles& left_before)
{
  const py::ssize_t people = countOf(root), steps = method.costs.steps;
  const float* cost = checked(costs, "costs", { people, PLACES, steps });
  const float* ray = checked(rays, "rays", { people, PLACES, 3 });
  const double* depth = checked(root, "root", { people });
  const float* length = checked(lengths, "lengths", { people, BONES });
  const float* sigma = checked(sigmas, "sigmas", { people, BONES });
  const double* height = checked(stature, "stature", { people });
  const double* before = checked(left_before, "left_before", { people, 3 });
  py::array_t<float> beliefs(Shape{ people, PLACES, steps });
  py::array_t<double> left(Shape{ people, 3 });
  float* beliefs_out = beliefs.mutable_data();
  double* left_out = left.mutable_data();
  {
    py::gil_scoped_release release;
    DepthInference inference(method);
    for (py::ssize_t p = 0; p < people; ++p)
    {
      const auto known = [=](int i) { return std::isfinite(before[3 * p + i]) ? before[3 * p + i] : 0.0; };
      Person person{ cost + p * PLACES * steps, {}, {}, depth[p],
                     static_cast<float>(height[p] / method.body.adult_stature), { known(0), known(1), known(2) } };
      for (int i = 0; i < PLACES; ++i)
      {
        const float* to = ray + (p * PLACES + i) * 3;
        person.rays[i] = { to[0], to[1], to[2] };
      }
      for (int i = 0; i < BONES; ++i)
      {
        person.bones[i] = { length[p * BONES + i], sigma[p * BONES + i] };
      }
      store(inference.infer(person, beliefs_out + p * PLACES * steps), left_out + 3 * p);
    }
  }
  return py::make_tuple(beliefs, left);
}

py::tuple readDepths(const Constants& method, const Floats& beliefs)
{
  const int steps = method.costs.steps;
  if (beliefs.ndim() < 1 || beliefs.shape(beliefs.ndim() - 1) != steps)
  {
    throw std::invalid_argument("the last axis of beliefs must have size " + std::to_string(steps));
  }
  const Shape shape(beliefs.shape(), beliefs.shape() + beliefs.ndim() - 1);
  py::array_t<double> depth(shape), deviation(shape);
  for (py::ssize_t i = 0; i < depth.size(); ++i)
  {
    const auto [mean, sigma] = readDepth(beliefs.data() + i * steps, steps, method.inference.mode);
    depth.mutable_data()[i] = (mean - method.costs.half) * method.costs.step;
    deviation.mutable_data()[i] = sigma * method.costs.step;
  }
  return py::make_tuple(depth, deviation);
}
}  // namespace skeleton_extract_3d
