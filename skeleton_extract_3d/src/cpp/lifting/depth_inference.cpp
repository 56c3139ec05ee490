/** Twins of depth_inference.py. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "body.h"
#include "cost_tables.h"
#include "geometry.h"

namespace skeleton_extract_3d
{
namespace
{
Ray middle(const Ray& a, const Ray& b)
{
  return { (a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2 };
}

/** Means and standard deviations outwards and forwards of the four limbs, (4, 2) each [m]. */
struct Directions
{
  const double* mean;
  const double* sigma;
};

struct InferenceSettings
{
  int steps;       ///< candidates of a joint
  int half;        ///< which of them is the trunk's depth
  double step;     ///< between candidates [m]
  int mode;        ///< candidates on each side of the cheapest one that make up the mean
  double nearest;  ///< [m]
  float length_limit, direction_limit, turn_limit;
  const float* turn_spread;  ///< of shoulders and hips [m]
  double pair_error, level, least_length;
  double adult_stature;  ///< [m]
  const double* sides;   ///< +1 for limbs of the left, -1 for those of the right
  Directions upper, lower;

  int middles() const
  {
    return 2 * steps - 1;
  }
};

/** What is known of a person's bones, see depth_inference.Bones. */
struct PersonBones
{
  const float *upper, *lower, *pairs;
  float trunk, head;
  const float *upper_sigma, *lower_sigma, *pairs_sigma;
  float trunk_sigma, head_sigma;
};

/** Return depth from the trunk's and its standard deviation, in candidates and from the first one. */
std::pair<double, double> readDepth(const float* beliefs, int steps, int mode, float* likelihood)
{
  const float least = *std::min_element(beliefs, beliefs + steps);
  float total = 0.0f;
  for (int i = 0; i < steps; ++i)
  {
    likelihood[i] = std::exp(-0.5f * (beliefs[i] - least));
    total += likelihood[i];
  }
  for (int i = 0; i < steps; ++i)
  {
    likelihood[i] /= total;
  }
  const int best = static_cast<int>(std::max_element(likelihood, likelihood + steps) - likelihood);
  double mean = 0.0, weight = 0.0;
  for (int i = std::max(best - mode, 0); i <= std::min(best + mode, steps - 1); ++i)
  {
    mean += static_cast<double>(likelihood[i]) * i;
    weight += likelihood[i];
  }
  mean /= weight;
  double variance = 0.0;
  for (int i = 0; i < steps; ++i)
  {
    variance += likelihood[i] * (i - mean) * (i - mean);
  }
  return { mean, std::sqrt(variance) };
}

/** Infers the depths of one person after the other; keeps the memory for the tables. */
class DepthInference
{
public:
  explicit DepthInference(const InferenceSettings& settings)
    : s_(settings)
    , z_(settings.steps)
    , z_middle_(settings.middles())
    , trunk_(settings.middles(), settings.middles())
    , head_(settings.middles(), settings.steps)
    , pair_(PAIRS, Table(settings.steps, settings.steps))
    , filled_pair_(PAIRS, Table(settings.steps, settings.steps))
    , upper_(LIMBS, Table(settings.steps, settings.steps))
    , lower_(LIMBS, Table(settings.steps, settings.steps))
    , from_head_(message())
    , shoulders_(message())
    , hips_(message())
    , from_hips_(message())
    , from_shoulders_(message())
    , to_shoulders_(message())
    , likelihood_(settings.steps)
  {
  }

  /**
   * Infer a person's depths.
   *
   * costs: (12, steps); head_costs: (steps); rays: (12); left_before: 3 numbers; joints: (12, steps) and head: (steps),
   * for the results. Returns the direction to the person's left.
   */
  Direction infer(const float* costs, const float* head_costs, const Ray* rays, const Ray& head_ray, double root,
                  const PersonBones& bones, double stature, const double* left_before, float* joints, float* head)
  {
    const int n = s_.steps;
    const float *root_costs = costs, *middle_costs = costs + LIMBS * n, *end_costs = costs + 2 * LIMBS * n;
    const Ray *roots = rays, *middles = rays + LIMBS, *ends = rays + 2 * LIMBS;
    placeCandidates(root);
    const Ray neck = middle(roots[0], roots[1]), hips = middle(roots[2], roots[3]);
    lengthCosts(z_middle_.data(), neck, z_middle_.data(), hips, bones.trunk, bones.trunk_sigma, s_.length_limit,
                trunk_);
    lengthCosts(z_middle_.data(), neck, z_.data(), head_ray, bones.head, bones.head_sigma, s_.length_limit, head_);
    for (int pair = 0; pair < PAIRS; ++pair)
    {
      lengthCosts(z_.data(), roots[2 * pair], z_.data(), roots[2 * pair + 1], bones.pairs[pair],
                  bones.pairs_sigma[pair], s_.length_limit, pair_[pair]);
    }
    Message incoming = message();
    std::copy_n(head_costs, n, incoming.begin());
    passToRows(head_, incoming, from_head_.data());

    trunkBeliefs(root_costs, joints);
    const auto [left, forward] = facing(roots, root, joints, left_before);
    for (int pair = 0; pair < PAIRS; ++pair)
    {
      addTurnCosts(bones.pairs[pair] * static_cast<float>(left.z), s_.turn_spread[pair], pair_[pair]);
    }

    const double scale = static_cast<float>(stature / s_.adult_stature);
    std::vector<Message> from_ends(LIMBS, message()), from_middles(LIMBS, message()), middles_in(LIMBS, message());
    Message roots_in(ROOTS * n);
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      const Direction outwards = scaled(left, s_.sides[limb]);
      lengthCosts(z_.data(), roots[limb], z_.data(), middles[limb], bones.upper[limb], bones.upper_sigma[limb],
                  s_.length_limit, upper_[limb]);
      addDirectionCosts(z_.data(), roots[limb], middles[limb], outwards, forward, s_.upper.mean + 2 * limb,
                        s_.upper.sigma + 2 * limb, scale, s_.direction_limit, upper_[limb]);
      lengthCosts(z_.data(), middles[limb], z_.data(), ends[limb], bones.lower[limb], bones.lower_sigma[limb],
                  s_.length_limit, lower_[limb]);
      addDirectionCosts(z_.data(), middles[limb], ends[limb], outwards, forward, s_.lower.mean + 2 * limb,
                        s_.lower.sigma + 2 * limb, scale, s_.direction_limit, lower_[limb]);
      std::copy_n(end_costs + limb * n, n, incoming.begin());
      passToRows(lower_[limb], incoming, from_ends[limb].data());
      for (int i = 0; i < n; ++i)
      {
        middles_in[limb][i] = middle_costs[limb * n + i] + from_ends[limb][i];
      }
      passToRows(upper_[limb], middles_in[limb], from_middles[limb].data());
      for (int i = 0; i < n; ++i)
      {
        roots_in[limb * n + i] = root_costs[limb * n + i] + from_middles[limb][i];
      }
    }
    trunkBeliefs(roots_in.data(), joints);

    Message outgoing(n);
    for (int limb = 0; limb < LIMBS; ++limb)
    {
      const float* root_beliefs = joints + limb * n;
      float* middle_beliefs = joints + (LIMBS + limb) * n;
      float* end_beliefs = joints + (2 * LIMBS + limb) * n;
      for (int i = 0; i < n; ++i)
      {
        outgoing[i] = root_beliefs[i] - from_middles[limb][i];
      }
      passToColumns(upper_[limb], outgoing.data(), middle_beliefs);
      for (int i = 0; i < n; ++i)
      {
        middle_beliefs[i] += middles_in[limb][i];
        outgoing[i] = middle_beliefs[i] - from_ends[limb][i];
      }
      passToColumns(lower_[limb], outgoing.data(), end_beliefs);
      for (int i = 0; i < n; ++i)
      {
        end_beliefs[i] += end_costs[limb * n + i];
      }
    }
    for (int i = 0; i < s_.middles(); ++i)
    {
      to_shoulders_[i] = shoulders_[i] + from_hips_[i];
    }
    passToColumns(head_, to_shoulders_.data(), head);
    for (int i = 0; i < n; ++i)
    {
      head[i] += head_costs[i];
    }
    return left;
  }

private:
  /** Room for a message to places with any number of candidates, also where a row begins in its midst. */
  Message message() const
  {
    return Message(filledUp(s_.middles()) + filledUp(s_.steps), 0.0f);
  }

  void placeCandidates(double root)
  {
    for (int i = 0; i < s_.steps; ++i)
    {
      z_[i] = static_cast<float>(std::max(root + (i - s_.half) * s_.step, s_.nearest));
    }
    for (int i = 0; i < s_.middles(); ++i)
    {
      z_middle_[i] = static_cast<float>(std::max(root + (i - 2 * s_.half) * (s_.step / 2), s_.nearest));
    }
  }

  void addTurnCosts(float turn, float spread, Table& table) const
  {
    for (int i = 0; i < s_.steps; ++i)
    {
      float* row = table.row(i);
      const float* z = z_.data();
      const float z_start = z[i];
      const int columns = s_.steps;
      const float limit = s_.turn_limit;
      for (int j = 0; j < columns; ++j)
      {
        const float turned = (z_start - z[j] - turn) / spread;
        row[j] += lesser(turned * turned, limit);
      }
    }
  }

  /** Pass messages between shoulders, hips and head: roots_in and beliefs are (4, steps). */
  void trunkBeliefs(const float* roots_in, float* beliefs)
  {
    leastByMiddle(roots_in, 0, shoulders_);
    leastByMiddle(roots_in, 1, hips_);
    passToRows(trunk_, hips_, from_hips_.data());
    for (int i = 0; i < s_.middles(); ++i)
    {
      to_shoulders_[i] = shoulders_[i] + from_head_[i];
    }
    passToColumns(trunk_, to_shoulders_.data(), from_shoulders_.data());
    for (int i = 0; i < s_.middles(); ++i)
    {
      to_shoulders_[i] = from_head_[i] + from_hips_[i];
    }
    pairBeliefs(filled_pair_[0], to_shoulders_, beliefs, beliefs + s_.steps);
    pairBeliefs(filled_pair_[1], from_shoulders_, beliefs + 2 * s_.steps, beliefs + 3 * s_.steps);
  }

  /** Add what comes from both joints of a pair, and find the least cost of each middle. */
  void leastByMiddle(const float* roots_in, int pair, Message& least)
  {
    const int columns = s_.steps;
    const float *left = roots_in + 2 * pair * columns, *right = left + columns;
    std::fill_n(least.begin(), s_.middles(), INFINITE);
    for (int i = 0; i < s_.steps; ++i)
    {
      const float* row = pair_[pair].row(i);
      float* filled = filled_pair_[pair].row(i);
      float* of_middle = least.data() + i;
      const float from_left = left[i];
      for (int j = 0; j < columns; ++j)
      {
        filled[j] = row[j] + from_left + right[j];
      }
      for (int j = 0; j < columns; ++j)
      {
        of_middle[j] = lesser(filled[j], of_middle[j]);
      }
    }
  }

  /** Return the least cost through each candidate of the joints of a pair, given what comes to each middle. */
  void pairBeliefs(const Table& filled, const Message& of_middle, float* left, float* right) const
  {
    const int columns = s_.steps;
    std::fill_n(right, columns, INFINITE);
    for (int i = 0; i < s_.steps; ++i)
    {
      const float* row = filled.row(i);
      const float* incoming = of_middle.data() + i;
      left[i] = leastSum(row, incoming, filled.stride());
      for (int j = 0; j < columns; ++j)
      {
        right[j] = lesser(row[j] + incoming[j], right[j]);
      }
    }
  }

  /** Return the directions to the left and forwards of the person. */
  std::pair<Direction, Direction> facing(const Ray* roots, double root, const float* beliefs, const double* left_before)
  {
    Direction at[ROOTS];
    double variance[ROOTS];
    for (int i = 0; i < ROOTS; ++i)
    {
      const auto [number, deviation] = readDepth(beliefs + i * s_.steps, s_.steps, s_.mode, likelihood_.data());
      at[i] = scaled({ roots[i].x, roots[i].y, roots[i].z }, root + (number - s_.half) * s_.step);
      variance[i] = deviation * s_.step * (deviation * s_.step);
    }
    const double error = s_.pair_error * s_.pair_error;
    Direction across = sum(scaled(difference(at[0], at[1]), 1 / (variance[0] + variance[1] + error)),
                           scaled(difference(at[2], at[3]), 1 / (variance[2] + variance[3] + error)));
    across.y *= s_.level;
    const auto known = [](double value) { return std::isfinite(value) ? value : 0.0; };
    const Direction left = unit(sum(unit(across, s_.least_length),
                                    { known(left_before[0]), known(left_before[1]), known(left_before[2]) }),
                                s_.least_length);
    const Direction up = unit(difference(sum(at[0], at[1]), sum(at[2], at[3])), s_.least_length);
    const Direction forward{ left.y * up.z - left.z * up.y, left.z * up.x - left.x * up.z,
                             left.x * up.y - left.y * up.x };
    return { left, unit(forward, s_.least_length) };
  }

  InferenceSettings s_;
  Message z_, z_middle_;
  Table trunk_, head_;
  std::vector<Table> pair_, filled_pair_, upper_, lower_;
  Message from_head_, shoulders_, hips_, from_hips_, from_shoulders_, to_shoulders_, likelihood_;
};

using DirectionArrays = std::pair<Doubles, Doubles>;

py::tuple inferDepths(const Floats& costs, const Floats& head_costs, const Floats& rays, const Floats& head_ray,
                      const Doubles& root, const std::array<Floats, 10>& bones, const Doubles& stature,
                      const Doubles& left_before, int steps, int half, double step, int mode, double nearest,
                      float length_limit, float direction_limit, float turn_limit, const Floats& turn_spread,
                      double pair_error, double level, double least_length, double adult_stature, const Doubles& sides,
                      const DirectionArrays& upper_directions, const DirectionArrays& lower_directions)
{
  if (steps < 1)
  {
    throw std::invalid_argument("steps must be at least 1");
  }
  const py::ssize_t people = sizeOf(root, "root", 1, 0);
  const auto directions = [](const DirectionArrays& arrays, const char* name) {
    return Directions{ checked(arrays.first, name, { LIMBS, 2 }), checked(arrays.second, name, { LIMBS, 2 }) };
  };
  const InferenceSettings settings{ steps, half, step, mode, nearest, length_limit, direction_limit, turn_limit,
                                    checked(turn_spread, "turn_spread", { PAIRS }), pair_error, level, least_length,
                                    adult_stature, checked(sides, "sides", { LIMBS }),
                                    directions(upper_directions, "upper_directions"),
                                    directions(lower_directions, "lower_directions") };
  const float* cost = checked(costs, "costs", { people, CHAINED, steps });
  const float* head_cost = checked(head_costs, "head_costs", { people, steps });
  const float* ray = checked(rays, "rays", { people, CHAINED, 3 });
  const float* to_head = checked(head_ray, "head_ray", { people, 3 });
  const double* depth = root.data();
  const double* height = checked(stature, "stature", { people });
  const double* before = checked(left_before, "left_before", { people, 3 });
  std::array<const float*, 10> bone;
  constexpr py::ssize_t WIDTHS[] = { LIMBS, LIMBS, PAIRS, 0, 0 };  // 0: one number per person
  for (std::size_t i = 0; i < bone.size(); ++i)
  {
    const py::ssize_t width = WIDTHS[i % 5];
    bone[i] = width > 0 ? checked(bones[i], "bones", { people, width }) : checked(bones[i], "bones", { people });
  }
  py::array_t<float> joints({ people, py::ssize_t{ CHAINED }, py::ssize_t{ steps } });
  py::array_t<float> head({ people, py::ssize_t{ steps } });
  py::array_t<double> left({ people, py::ssize_t{ 3 } });
  float *joints_out = joints.mutable_data(), *head_out = head.mutable_data();
  double* left_out = left.mutable_data();
  {
    py::gil_scoped_release release;
    DepthInference inference(settings);
    for (py::ssize_t p = 0; p < people; ++p)
    {
      std::array<Ray, CHAINED> person_rays;
      for (int i = 0; i < CHAINED; ++i)
      {
        const float* r = ray + (p * CHAINED + i) * 3;
        person_rays[i] = { r[0], r[1], r[2] };
      }
      const PersonBones person_bones{ bone[0] + p * LIMBS, bone[1] + p * LIMBS, bone[2] + p * PAIRS, bone[3][p],
                                      bone[4][p],          bone[5] + p * LIMBS, bone[6] + p * LIMBS,
                                      bone[7] + p * PAIRS, bone[8][p],          bone[9][p] };
      const Direction to_left = inference.infer(
          cost + p * CHAINED * steps, head_cost + p * steps, person_rays.data(),
          { to_head[3 * p], to_head[3 * p + 1], to_head[3 * p + 2] }, depth[p], person_bones, height[p], before + 3 * p,
          joints_out + p * CHAINED * steps, head_out + p * steps);
      left_out[3 * p] = to_left.x;
      left_out[3 * p + 1] = to_left.y;
      left_out[3 * p + 2] = to_left.z;
    }
  }
  return py::make_tuple(joints, head, left);
}

py::tuple readDepths(const Floats& beliefs, int steps, int half, double step, int mode)
{
  if (beliefs.ndim() < 1 || steps < 1 || beliefs.shape(beliefs.ndim() - 1) != steps)
  {
    throw std::invalid_argument("the last axis of beliefs must have size " + std::to_string(steps));
  }
  const std::vector<py::ssize_t> shape(beliefs.shape(), beliefs.shape() + beliefs.ndim() - 1);
  py::array_t<double> depth(shape), deviation(shape);
  std::vector<float> likelihood(steps);
  const float* belief = beliefs.data();
  double *depth_out = depth.mutable_data(), *deviation_out = deviation.mutable_data();
  for (py::ssize_t i = 0; i < depth.size(); ++i)
  {
    const auto [mean, sigma] = readDepth(belief + i * steps, steps, mode, likelihood.data());
    depth_out[i] = (mean - half) * step;
    deviation_out[i] = sigma * step;
  }
  return py::make_tuple(depth, deviation);
}
}  // namespace

void bindDepthInference(py::module& module)
{
  module.def("infer_depths", &inferDepths, "Twin of depth_inference.infer_depths: (joints, head, left).",
             py::arg("costs"), py::arg("head_costs"), py::arg("rays"), py::arg("head_ray"), py::arg("root"),
             py::arg("bones"), py::arg("stature"), py::arg("left_before"), py::arg("steps"),
             py::arg("half"), py::arg("step"), py::arg("mode"), py::arg("nearest"), py::arg("length_limit"),
             py::arg("direction_limit"), py::arg("turn_limit"), py::arg("turn_spread"), py::arg("pair_error"),
             py::arg("level"), py::arg("least_length"), py::arg("adult_stature"), py::arg("sides"),
             py::arg("upper_directions"), py::arg("lower_directions"));
  module.def("read_depths", &readDepths, "Twin of depth_inference.read_depths.", py::arg("beliefs"),
             py::arg("steps"), py::arg("half"), py::arg("step"), py::arg("mode"));
}
}  // namespace skeleton_extract_3d
