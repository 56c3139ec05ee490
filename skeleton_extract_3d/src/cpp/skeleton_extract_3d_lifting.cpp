/**
 * Compiled twins of hot functions of the Python modules of skeleton_extract_3d, which explain what is done and why; they are
 * the reference, and every constant comes from them.
 *
 * Operations have the reference's precision and mostly its order; sums of many numbers are added up in another one, and
 * exponentials and logarithms may differ in the last bit. NaN means missing, so no -ffast-math.
 *
 * Loops over candidates run over contiguous floats and without branches, so that compilers make vector instructions of
 * them.
 */
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace skeleton_extract_3d
{
constexpr float INFINITE = std::numeric_limits<float>::infinity();

// ---- depth_inference

constexpr int LANES = 8;  ///< numbers that are compared side by side; rows of tables are filled up to a multiple of it
constexpr int ROOTS = 4, LIMBS = 4, PAIRS = 2, CHAINED = 12;

int filledUp(int count)
{
  return (count + LANES - 1) / LANES * LANES;
}

float lesser(float a, float b)
{
  return a < b ? a : b;
}

/** Costs of the pairs of candidates of two places, row by row; rows are filled up with infinity. */
class Table
{
public:
  Table(int rows, int columns)
    : rows_(rows), columns_(columns), stride_(filledUp(columns)), values_(rows * stride_, INFINITE)
  {
  }
  int rows() const
  {
    return rows_;
  }
  int columns() const
  {
    return columns_;
  }
  int stride() const
  {
    return stride_;
  }
  float* row(int index)
  {
    return values_.data() + index * stride_;
  }
  const float* row(int index) const
  {
    return values_.data() + index * stride_;
  }

private:
  int rows_;
  int columns_;
  int stride_;
  std::vector<float> values_;
};

/** One number per candidate; what rows are filled up with is 0 and has no effect. */
using Message = std::vector<float>;

template <typename T>
struct Vector
{
  T x, y, z;
};
using Ray = Vector<float>;
using Direction = Vector<double>;

template <typename A, typename B>
auto dot(const Vector<A>& a, const Vector<B>& b)
{
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

Direction scaled(const Direction& v, double factor)
{
  return { v.x * factor, v.y * factor, v.z * factor };
}

Direction sum(const Direction& a, const Direction& b)
{
  return { a.x + b.x, a.y + b.y, a.z + b.z };
}

Direction difference(const Direction& a, const Direction& b)
{
  return { a.x - b.x, a.y - b.y, a.z - b.z };
}

Direction unit(const Direction& v, double least_length)
{
  const double length = std::max(std::sqrt(dot(v, v)), least_length);
  return { v.x / length, v.y / length, v.z / length };
}

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

/** Least sum of a row of a table and a message. */
float leastSum(const float* row, const float* message, int stride)
{
  float lanes[LANES];
  std::fill_n(lanes, LANES, INFINITE);
  for (int i = 0; i < stride; i += LANES)
  {
    for (int lane = 0; lane < LANES; ++lane)
    {
      lanes[lane] = lesser(row[i + lane] + message[i + lane], lanes[lane]);
    }
  }
  return *std::min_element(lanes, lanes + LANES);
}

/** For each row, the least sum with a message to the columns. */
void passToRows(const Table& table, const Message& message, float* result)
{
  for (int i = 0; i < table.rows(); ++i)
  {
    result[i] = leastSum(table.row(i), message.data(), table.stride());
  }
}

/** For each column, the least sum with a message to the rows. */
void passToColumns(const Table& table, const float* message, float* result)
{
  const int columns = table.columns();
  std::fill_n(result, columns, INFINITE);
  for (int i = 0; i < table.rows(); ++i)
  {
    const float* row = table.row(i);
    const float value = message[i];
    for (int j = 0; j < columns; ++j)
    {
      result[j] = lesser(row[j] + value, result[j]);
    }
  }
}

/** Fill a table with the costs of a bone between candidates of its ends. */
void lengthCosts(const float* z_start, const Ray& start, const float* z_end, const Ray& end, float length, float sigma,
                 float limit, Table& table)
{
  const int columns = table.columns();
  const float start_start = dot(start, start), end_end = dot(end, end), twice_both = 2 * dot(start, end);
  Message end_square(columns);
  for (int j = 0; j < columns; ++j)
  {
    end_square[j] = end_end * z_end[j] * z_end[j];
  }
  const float* of_end = end_square.data();
  for (int i = 0; i < table.rows(); ++i)
  {
    const float start_square = start_start * z_start[i] * z_start[i];
    const float both = twice_both * z_start[i];
    float* row = table.row(i);
    for (int j = 0; j < columns; ++j)
    {
      const float square = start_square + of_end[j] - both * z_end[j];
      const float off = (std::sqrt(square > 0.0f ? square : 0.0f) - length) / sigma;
      row[j] = lesser(off * off, limit);
    }
  }
}

/** Add the costs of where a limb points. */
void addDirectionCosts(const float* z, const Ray& start, const Ray& end, const Direction& outwards,
                       const Direction& forward, const double* mean, const double* sigma, double scale, float limit,
                       Table& table)
{
  const int columns = table.columns();
  const double sigmas[2] = { sigma[0] * scale, sigma[1] * scale };
  const float start_out = static_cast<float>(dot(start, outwards) / sigmas[0]);
  const float start_forward = static_cast<float>(dot(start, forward) / sigmas[1]);
  const float end_out = static_cast<float>(dot(end, outwards) / sigmas[0]);
  const float end_forward = static_cast<float>(dot(end, forward) / sigmas[1]);
  const float mean_out = static_cast<float>(mean[0] * scale / sigmas[0]);
  const float mean_forward = static_cast<float>(mean[1] * scale / sigmas[1]);
  Message out_row(columns), forward_row(columns);
  for (int j = 0; j < columns; ++j)
  {
    out_row[j] = end_out * z[j] - mean_out;
    forward_row[j] = end_forward * z[j] - mean_forward;
  }
  const float *to_out = out_row.data(), *to_forward = forward_row.data();
  for (int i = 0; i < table.rows(); ++i)
  {
    const float from_out = start_out * z[i], from_forward = start_forward * z[i];
    float* row = table.row(i);
    for (int j = 0; j < columns; ++j)
    {
      const float out = to_out[j] - from_out, ahead = to_forward[j] - from_forward;
      row[j] += lesser(out * out + ahead * ahead, limit);
    }
  }
}

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

// ---- surfaces

/** The nearest integer from `first` to `last`; NaN is taken for the first. */
int nearestWithin(double position, int first, int last)
{
  return position > first ? static_cast<int>(std::lrint(std::min(position, static_cast<double>(last)))) : first;
}

/** The valid samples of a window, their weights with sum 1. */
class Window
{
public:
  explicit Window(const double* weights, int samples) : weights_(weights), samples_(samples), weight_(samples)
  {
  }

  /** Look at a window; return whether it has any valid sample. */
  bool look(const double* depth)
  {
    depth_ = depth;
    double total = 0.0;
    for (int i = 0; i < samples_; ++i)
    {
      weight_[i] = std::isfinite(depth[i]) ? weights_[i] : 0.0;
      total += weight_[i];
    }
    for (int i = 0; i < samples_ && total > 0.0; ++i)
    {
      weight_[i] /= total;
    }
    return total > 0.0;
  }

  /**
   * Fill histograms of all samples, and of those that are not foreign; both are the same where `foreign` is null.
   *
   * position: function from depth to number of the bin; first: number of the first bin; it and the last one are open.
   */
  template <typename Position>
  void fill(const bool* foreign, const Position& position, int first, std::vector<double>& all,
            std::vector<double>& own) const
  {
    const int last = first + static_cast<int>(all.size()) - 1;
    std::fill(all.begin(), all.end(), 0.0);
    std::fill(own.begin(), own.end(), 0.0);
    for (int i = 0; i < samples_; ++i)
    {
      if (weight_[i] > 0.0)
      {
        const int bin = nearestWithin(position(depth_[i]), first, last) - first;
        all[bin] += weight_[i];
        own[bin] += foreign != nullptr && foreign[i] ? 0.0 : weight_[i];
      }
    }
  }

  double weight(int sample) const
  {
    return weight_[sample];
  }

private:
  const double* weights_;
  int samples_;
  const double* depth_ = nullptr;
  std::vector<double> weight_;
};

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

// ---- occluders

/** The parts of a body in the picture. */
class BodyParts
{
public:
  BodyParts(const std::int64_t* parts, int count)
    : parts_(parts), count_(count), x_(count), y_(count), along_x_(count), along_y_(count), length_(count), at_(count)
    , share_(count)
  {
  }

  void place(const double* uv, double least_square)
  {
    for (int i = 0; i < count_; ++i)
    {
      const double *start = uv + 2 * parts_[2 * i], *end = uv + 2 * parts_[2 * i + 1];
      x_[i] = start[0];
      y_[i] = start[1];
      along_x_[i] = end[0] - start[0];
      along_y_[i] = end[1] - start[1];
      const double square = along_x_[i] * along_x_[i] + along_y_[i] * along_y_[i];
      length_[i] = square < least_square ? least_square : square;  // NaN stays
    }
  }

  /** Find the distances of a pixel from the parts [px], and where along them the nearest places are, 0..1. */
  void measure(const double* uv)
  {
    const double u = uv[0], v = uv[1];
    const double *x = x_.data(), *y = y_.data(), *along_x = along_x_.data(), *along_y = along_y_.data();
    const double* length = length_.data();
    double *at = at_.data(), *share = share_.data();
    const int count = count_;
    for (int i = 0; i < count; ++i)
    {
      const double from_x = u - x[i], from_y = v - y[i];
      double along = (from_x * along_x[i] + from_y * along_y[i]) / length[i];
      along = along < 0.0 ? 0.0 : along;
      along = along > 1.0 ? 1.0 : along;
      const double off_x = from_x - along * along_x[i], off_y = from_y - along * along_y[i];
      at[i] = std::sqrt(off_x * off_x + off_y * off_y);
      share[i] = along;
    }
  }

  double distance(int part) const
  {
    return at_[part];
  }
  double share(int part) const
  {
    return share_[part];
  }

private:
  const std::int64_t* parts_;
  int count_;
  std::vector<double> x_, y_, along_x_, along_y_, length_, at_, share_;
};

/** The part of the picture outside of which a body covers nothing. */
class Outline
{
public:
  Outline(const double* uv, const double* depths, int joints, double thickest, double focal)
  {
    double nearest = std::numeric_limits<double>::infinity();
    for (int joint = 0; joint < joints; ++joint)
    {
      const double u = uv[2 * joint], v = uv[2 * joint + 1];
      if (std::isfinite(u) && std::isfinite(v))
      {
        left_ = std::min(left_, u);
        right_ = std::max(right_, u);
        top_ = std::min(top_, v);
        bottom_ = std::max(bottom_, v);
        nearest = std::min(nearest, depths[joint]);
      }
    }
    reach_ = nearest > 0.0 ? thickest * focal / nearest : std::numeric_limits<double>::infinity();
  }

  bool holds(const double* uv) const
  {
    return uv[0] >= left_ - reach_ && uv[0] <= right_ + reach_ && uv[1] >= top_ - reach_ && uv[1] <= bottom_ + reach_;
  }

private:
  double left_ = std::numeric_limits<double>::infinity(), right_ = -left_, top_ = left_, bottom_ = right_, reach_;
};

void othersDepths(const double* uv, const double* joint_depths, double focal, int people, int joints,
                  const std::int64_t* parts, const double* radii, int part_count, double least_square, double* result)
{
  BodyParts body(parts, part_count);
  const double thickest = part_count > 0 ? *std::max_element(radii, radii + part_count) : 0.0;
  std::fill_n(result, people * joints * people, std::numeric_limits<double>::infinity());
  for (int other = 0; other < people; ++other)
  {
    body.place(uv + other * joints * 2, least_square);
    const double* depths = joint_depths + other * joints;
    const Outline outline(uv + other * joints * 2, depths, joints, thickest, focal);
    for (int row = 0; row < people * joints; ++row)
    {
      if (row / joints == other || !outline.holds(uv + 2 * row))
      {
        continue;
      }
      body.measure(uv + 2 * row);
      double& nearest = result[row * people + other];
      for (int i = 0; i < part_count; ++i)
      {
        const double start = depths[parts[2 * i]], end = depths[parts[2 * i + 1]];
        const double depth = start + body.share(i) * (end - start);
        const bool covers = body.distance(i) < radii[i] * focal / depth;
        nearest = covers && depth < nearest ? depth : nearest;
      }
    }
  }
}

struct ForeignSettings
{
  double reach, lead, skin;  ///< [m]
};

/** Mark the samples on other people; return whether there is any. */
bool foreignSamples(const double* depth, const double* others, const double* expected, int expected_per_person,
                    int people, int joints, int samples, int other_count, const ForeignSettings& s, bool* result)
{
  bool any = false;
  std::fill_n(result, people * joints * samples, false);
  std::vector<double> near;
  for (int row = 0; row < people * joints; ++row)
  {
    const double* of_row = others + row * other_count;
    near.clear();
    std::copy_if(of_row, of_row + other_count, std::back_inserter(near), [](double z) { return std::isfinite(z); });
    const double own = expected[expected_per_person == 1 ? row / joints : row];
    for (int i = 0; i < samples && !near.empty(); ++i)
    {
      const double surface = depth[row * samples + i] + s.skin;
      double gap = std::numeric_limits<double>::infinity();
      for (const double z : near)
      {
        gap = std::min(gap, std::abs(surface - z));
      }
      const bool foreign = gap < s.reach && gap + s.lead < std::abs(surface - own);
      result[row * samples + i] = foreign;
      any = any || foreign;
    }
  }
  return any;
}

void coveredBySelf(const double* uv, const double* root, double focal, int people, int joints,
                   const std::int64_t* parts, const double* radii, const bool* covering, int part_count, double share,
                   double least_square, bool* result)
{
  BodyParts body(parts, part_count);
  for (int person = 0; person < people; ++person)
  {
    body.place(uv + person * joints * 2, least_square);
    const double scale = focal / root[person];
    for (int joint = 0; joint < joints; ++joint)
    {
      body.measure(uv + (person * joints + joint) * 2);
      bool covered = false;
      for (int i = 0; i < part_count; ++i)
      {
        covered |= covering[joint * part_count + i] && body.distance(i) < share * radii[i] * scale;
      }
      result[person * joints + joint] = covered;
    }
  }
}

// ---- surfaces: sizes, means

/** Depths at which a trunk is looked for, and what a person's size in the image says of them. */
struct SizeSettings
{
  std::vector<double> log_depths;
  double foreshortening, weight, limit;

  /** Return the log likelihood of a depth for a person who looks like being at a depth. */
  double evidence(std::size_t depth, double log_size, double spread) const
  {
    double t = log_depths[depth] - log_size;
    t = std::isfinite(t) ? t : 0.0;
    t /= t > 0.0 ? spread : foreshortening + spread;
    return std::max(-0.5 * weight * t * t, limit);
  }
};

struct SizedPairs
{
  const std::int64_t* pairs;
  const double* lengths;
  int count;
  double least_score, bias;
};

double distanceBetween(const double* a, const double* b)
{
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

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

// ---- occluders: doubtful surfaces

struct DoubtSettings
{
  std::vector<bool> arm;  ///< joint by joint
  double in_front;        ///< [m]
  const std::int64_t* limb_to;
  double shortest;  ///< [px]
};

struct Doubt
{
  std::int64_t person, joint;
  double surface;
  bool in_front, on_trunk;
};

/** Return the lower median of the valid ones of some samples; NaN where there is none. */
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

std::vector<Doubt> doubtfulSurfaces(const double* uv, const double* depth, const double* root, const bool* covered,
                                    int people, int joints, int samples, const DoubtSettings& s)
{
  std::vector<Doubt> result;
  std::vector<double> valid;
  for (int row = 0; row < people * joints; ++row)
  {
    const int person = row / joints, joint = row % joints;
    const double surface = lowerMedian(depth + row * samples, samples, valid);
    const bool in_front = surface < root[person] - s.in_front && std::isfinite(uv[2 * row]);
    const bool on_trunk = s.arm[joint] && covered[row] && std::isfinite(surface);
    if (in_front || on_trunk)
    {
      result.push_back({ person, joint, surface, in_front, on_trunk });
    }
  }
  return result;
}

/** Return one metre across a limb in the picture [px]. */
std::pair<double, double> acrossLimb(const double* uv, const Doubt& doubt, int joints, double focal,
                                     const DoubtSettings& s)
{
  const double* of_person = uv + doubt.person * joints * 2;
  const double *here = of_person + 2 * doubt.joint, *there = of_person + 2 * s.limb_to[doubt.joint];
  double x = there[0] - here[0], y = there[1] - here[1];
  const double length = std::sqrt(x * x + y * y), scale = focal / doubt.surface;
  const bool known = length > s.shortest;
  x = known ? x / length : 0.0;
  y = known ? y / length : 1.0;
  return { -y * scale, x * scale };
}

// ---- matrices of 3 x 3, row by row

using Matrix = std::array<double, 9>;

Matrix matrixAt(const double* values)
{
  Matrix result;
  std::copy_n(values, result.size(), result.begin());
  return result;
}

Matrix transposed(const Matrix& m)
{
  return { m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8] };
}

Matrix product(const Matrix& a, const Matrix& b)
{
  Matrix result;
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      result[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    }
  }
  return result;
}

Direction product(const Matrix& a, const Direction& v)
{
  return { a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
           a[6] * v.x + a[7] * v.y + a[8] * v.z };
}

/** Return a + factor * b. */
Matrix sum(const Matrix& a, double factor, const Matrix& b)
{
  Matrix result;
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    result[i] = a[i] + factor * b[i];
  }
  return result;
}

Matrix symmetric(const Matrix& m)
{
  const Matrix other = transposed(m);
  Matrix result;
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    result[i] = (m[i] + other[i]) / 2;
  }
  return result;
}

Matrix inverse(const Matrix& m)
{
  const Matrix adjugate = { m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                            m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                            m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3] };
  const double determinant = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
  Matrix result;
  std::transform(adjugate.begin(), adjugate.end(), result.begin(), [=](double value) { return value / determinant; });
  return result;
}

// ---- joint_filter

/** The filters of points, point by point: (N, 3) and (N, 3, 3). */
struct FilterState
{
  double *position, *velocity, *position_covariance, *cross_covariance, *velocity_covariance;
};

/** Move points on; they take turns in having one of some accelerations [m/s^2]. */
void predict(const FilterState& state, int points, double elapsed, const double* acceleration, int kinds)
{
  const double square = elapsed * elapsed;
  for (int point = 0; point < points; ++point)
  {
    const double a = acceleration[point % kinds], noise = a * a;
    for (int i = 0; i < 3; ++i)
    {
      state.position[3 * point + i] += elapsed * state.velocity[3 * point + i];
    }
    double *of_position = state.position_covariance + 9 * point, *cross = state.cross_covariance + 9 * point;
    double* of_velocity = state.velocity_covariance + 9 * point;
    const Matrix turned = transposed(matrixAt(cross));
    for (int i = 0; i < 9; ++i)
    {
      const double driven = i % 4 == 0 ? noise : 0.0;  // on the diagonal
      of_position[i] += elapsed * (cross[i] + turned[i]) + square * of_velocity[i] + square * square / 4 * driven;
    }
    for (int i = 0; i < 9; ++i)
    {
      const double driven = i % 4 == 0 ? noise : 0.0;
      cross[i] += elapsed * of_velocity[i] + square * elapsed / 2 * driven;
      of_velocity[i] += square * driven;
    }
  }
}

/** Take the measurement of one point in. */
void correct(const FilterState& state, int point, const double* measured, const double* covariance,
             double trusted_deviations)
{
  double *position = state.position + 3 * point, *velocity = state.velocity + 3 * point;
  double *of_position = state.position_covariance + 9 * point, *of_both = state.cross_covariance + 9 * point;
  double* of_velocity = state.velocity_covariance + 9 * point;
  const Matrix prior = matrixAt(of_position), cross = matrixAt(of_both), noise = matrixAt(covariance);
  const Direction innovation{ measured[0] - position[0], measured[1] - position[1], measured[2] - position[2] };
  Matrix certainty = inverse(sum(prior, 1.0, noise));
  const double limit = trusted_deviations * trusted_deviations, off = dot(innovation, product(certainty, innovation));
  if (off > limit)
  {
    certainty = inverse(sum(prior, off / limit, noise));
  }
  const Matrix gain = product(prior, certainty), speed_gain = product(transposed(cross), certainty);
  const Direction moved = product(gain, innovation), sped = product(speed_gain, innovation);
  position[0] += moved.x;
  position[1] += moved.y;
  position[2] += moved.z;
  velocity[0] += sped.x;
  velocity[1] += sped.y;
  velocity[2] += sped.z;
  const auto store = [](const Matrix& matrix, double* values) { std::copy(matrix.begin(), matrix.end(), values); };
  store(symmetric(sum(matrixAt(of_velocity), -1.0, product(speed_gain, cross))), of_velocity);
  store(symmetric(sum(prior, -1.0, product(gain, prior))), of_position);
  store(sum(cross, -1.0, product(gain, cross)), of_both);
}

// ---- bone_constraints

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

// ---- body_measures

struct MeasureSettings
{
  const std::int64_t* sized_pairs;
  const double* sized_lengths;
  int sized;
  int least_bones;
  double adult_stature;
  std::pair<double, double> stature_limits;
  const double* adult_lengths;  ///< kind by kind
  int kind_count;
  std::int64_t neck;
  const std::int64_t *hips, *pairs, *kinds;  ///< the last kind is the trunk's
  int pair_count;
  double prior_frames, most_frames, most_change;
};

struct PersonSizes
{
  double &stature, &stature_weight;
  double *bones, *bone_weights;
};

void addStature(const double* xyz, const bool* good, const MeasureSettings& s, std::vector<double>& ratios,
                PersonSizes& sizes)
{
  ratios.clear();
  for (int i = 0; i < s.sized; ++i)
  {
    const std::int64_t start = s.sized_pairs[2 * i], end = s.sized_pairs[2 * i + 1];
    if (good[start] && good[end])
    {
      ratios.push_back(distanceBetween(xyz + 3 * start, xyz + 3 * end) / s.sized_lengths[i]);
    }
  }
  const std::size_t count = ratios.size();
  if (count < static_cast<std::size_t>(s.least_bones))
  {
    return;
  }
  std::sort(ratios.begin(), ratios.end());
  const double middle = (ratios[(count - 1) / 2] + ratios[count / 2]) / 2;
  const double stature = std::min(std::max(middle * s.adult_stature, s.stature_limits.first), s.stature_limits.second);
  const double weight = std::min(sizes.stature_weight + 1, s.most_frames);
  // of the first frame, an adult's is the other half
  sizes.stature += (stature - sizes.stature) * (weight > 1 ? 1 / weight : 0.5);
  sizes.stature_weight = weight;
}

/** Take a frame into the sizes of one person. */
void addFrame(const double* xyz, const bool* good, const MeasureSettings& s, std::vector<double>& scratch,
              PersonSizes sizes)
{
  addStature(xyz, good, s, scratch, sizes);
  std::vector<double>& total = scratch;
  total.assign(2 * s.kind_count, 0.0);
  double* count = total.data() + s.kind_count;
  const auto add = [&](std::int64_t kind, double length) {
    const double prior = s.adult_lengths[kind] * (sizes.stature / s.adult_stature), weight = sizes.bone_weights[kind];
    const double expected = (s.prior_frames * prior + weight * sizes.bones[kind]) / (s.prior_frames + weight);
    if (std::abs(length / expected - 1) < s.most_change)
    {
      total[kind] += length;
      count[kind] += 1;
    }
  };
  for (int i = 0; i < s.pair_count; ++i)
  {
    const std::int64_t start = s.pairs[2 * i], end = s.pairs[2 * i + 1];
    if (good[start] && good[end])
    {
      add(s.kinds[i], distanceBetween(xyz + 3 * start, xyz + 3 * end));
    }
  }
  if (good[s.neck] && good[s.hips[0]] && good[s.hips[1]])
  {
    const double *one = xyz + 3 * s.hips[0], *other = xyz + 3 * s.hips[1];
    const double hips[3] = { (one[0] + other[0]) / 2, (one[1] + other[1]) / 2, (one[2] + other[2]) / 2 };
    add(s.kinds[s.pair_count], distanceBetween(xyz + 3 * s.neck, hips));
  }
  for (int kind = 0; kind < s.kind_count; ++kind)
  {
    const double weight = sizes.bone_weights[kind] + count[kind];
    const double change = total[kind] / std::max(count[kind], 1.0) - sizes.bones[kind];
    sizes.bones[kind] += change * (count[kind] / std::max(weight, 1.0));
    sizes.bone_weights[kind] = std::min(weight, s.most_frames);
  }
}

// ---- head_pose

struct HeadSettings
{
  const std::int64_t* joints;
  const double* points;  ///< left, down, forwards of each joint [m]
  const double* offsets;
  int count;
  std::array<double, 3> axes;
  double ahead, error, cosine_spread, sine_spread;
};

/** Return the depth of the front of a turned ellipsoid, see head_pose._surface. */
double headSurface(double across, double down, double cosine, double sine, const HeadSettings& s)
{
  const auto [side, height, length] = s.axes;
  const auto square = [](double value) { return value * value; };
  across -= s.ahead * sine;
  const double a = square(cosine / side) + square(sine / length);
  const double b = cosine * sine * (1 / square(side) - 1 / square(length));
  const double c = square(sine / side) + square(cosine / length);
  const double level = std::max(1 - square(down / height), 0.1);
  const double root = std::sqrt(std::max(square(b * across) - c * (a * square(across) - level), 0.0));
  return -s.ahead * cosine - (b * across + root) / c;
}

/** Fit one person's head; return whether any of its joints was found. */
bool headPose(const double* rays, const double* scores, double root, double scale, double shoulder_cosine,
              const HeadSettings& s, double* ray, double* depths, double* surface)
{
  Matrix matrix{};
  Direction right_side{ 0.0, 0.0, 0.0 };
  double total = 0.0, y = 0.0;
  for (int i = 0; i < s.count; ++i)
  {
    const double* to = rays + 3 * s.joints[i];
    const double place_x = to[0] * root, place_y = to[1] * root;
    const double weight = std::isfinite(place_x) ? scores[s.joints[i]] : 0.0;
    if (!(weight > 0.0))
    {
      continue;
    }
    const double terms[3] = { 1.0, s.points[3 * i] * scale, s.points[3 * i + 2] * scale };
    const double precision = weight / (s.error * s.error);
    for (int j = 0; j < 3; ++j)
    {
      for (int k = 0; k < 3; ++k)
      {
        matrix[3 * j + k] += precision * terms[j] * terms[k];
      }
    }
    right_side = sum(right_side, scaled({ terms[0], terms[1], terms[2] }, precision * place_x));
    total += weight;
    y += weight * (place_y - s.points[3 * i + 1] * scale);
  }
  const double of_cosine = 1 / (s.cosine_spread * s.cosine_spread), of_sine = 1 / (s.sine_spread * s.sine_spread);
  matrix[0] += 1e-6;
  matrix[4] += of_cosine;
  matrix[8] += of_sine;
  right_side.y += of_cosine * shoulder_cosine;
  const Direction solution = product(inverse(matrix), right_side);
  const double norm = std::max(std::hypot(solution.y, solution.z), 1e-6);
  const double cosine = solution.y / norm, sine = solution.z / norm;
  ray[0] = solution.x / root;
  ray[1] = y / std::max(total, 1e-9) / root;
  ray[2] = 1.0;
  for (int i = 0; i < s.count; ++i)
  {
    const double left = s.points[3 * i] * scale, down = s.points[3 * i + 1] * scale;
    const double ahead = s.points[3 * i + 2] * scale;
    depths[i] = left * sine - ahead * cosine;
    const double front =
        headSurface((left * cosine + ahead * sine) / scale, down / scale, cosine, sine, s) * scale;
    // off the outline of the ellipsoid the joint itself is the surface
    surface[i] = std::min(front, depths[i] - s.offsets[i]);
  }
  return total > 0.0;
}

// ---- identity

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

// ---- pose_lifting

struct JointRules
{
  const double* thicknesses;  ///< joint by joint [m]
  const std::int64_t* head;
  int head_count;
  const std::int64_t* chains;  ///< roots, middles and ends of the four limbs
  const bool* legs;
  double agreement, least_support, against_front, least_own, shortest, longest, bone_error, sure_end, unsure_end,
      folded;
};

struct PersonSeen
{
  const double *rays, *scores;
  const bool* known;
  const double *depth, *z, *offsets, *own;
  const bool* foreign;
  const float *upper, *lower;
};

struct PersonMeasured
{
  double *xyz, *surface;
  bool *measured, *plausible;
};

/** Mark the joints that end a bone of a possible length. */
void markPlausible(const PersonSeen& seen, int joints, const JointRules& s, const PersonMeasured& out)
{
  std::fill_n(out.plausible, joints, true);
  for (int limb = 0; limb < LIMBS; ++limb)
  {
    const std::int64_t root = s.chains[limb], middle = s.chains[LIMBS + limb], end = s.chains[2 * LIMBS + limb];
    const double *at_root = out.xyz + 3 * root, *at_middle = out.xyz + 3 * middle, *at_end = out.xyz + 3 * end;
    const double upper = seen.upper[limb], lower = seen.lower[limb];
    const auto possible = [&s](double distance, double length) {
      return distance > s.shortest * length && distance < s.longest * length + s.bone_error;
    };
    out.plausible[middle] = possible(distanceBetween(at_root, at_middle), upper) ||
                            !(seen.known[root] && seen.known[middle]);
    const bool of_end = possible(distanceBetween(at_middle, at_end), lower) || !(seen.known[middle] && seen.known[end]);
    const bool folded = seen.known[root] && distanceBetween(at_root, at_end) < s.folded * (upper + lower) &&
                        (s.legs[limb] || seen.scores[middle] < s.unsure_end);
    out.plausible[end] = of_end && (out.plausible[middle] || seen.scores[end] > s.sure_end) &&
                         !(folded && seen.scores[end] < s.unsure_end);
  }
}

/** Decide which joints of one person were seen, and put those where their surface is. */
void measure(const PersonSeen& seen, int joints, int samples, Window& window, const JointRules& s,
             const PersonMeasured& out)
{
  const auto is_head = [&s](int joint) {
    const std::int64_t* end = s.head + s.head_count;
    return std::find(s.head, end, joint) != end;
  };
  for (int joint = 0; joint < joints; ++joint)
  {
    const double z = seen.z[joint], offset = seen.offsets[joint], thickness = s.thicknesses[joint];
    const double* depth = seen.depth + joint * samples;
    const double hides = z - std::max(thickness, offset);
    double support = 0.0, moment = 0.0, in_front = 0.0;
    window.look(depth);
    for (int i = 0; i < samples; ++i)
    {
      const double weight = window.weight(i);
      if (std::abs(depth[i] + offset - z) < s.agreement &&
          (seen.foreign == nullptr || !seen.foreign[joint * samples + i]))
      {
        support += weight;
        moment += weight * depth[i];
      }
      in_front += depth[i] < hides ? weight : 0.0;
    }
    const double surface = moment / std::max(support, 1e-9);
    bool measured = seen.known[joint] && support > s.least_support && seen.own[joint] > s.least_own &&
                    support >= s.against_front * in_front;
    double at = z;
    if (is_head(joint))
    {
      measured = measured && offset < thickness;
    }
    else if (measured)
    {
      at = surface + offset;
    }
    out.measured[joint] = measured;
    for (int i = 0; i < 3; ++i)
    {
      out.xyz[3 * joint + i] = seen.rays[3 * joint + i] * at;
      out.surface[3 * joint + i] = seen.rays[3 * joint + i] * surface;
    }
  }
  markPlausible(seen, joints, s, out);
  for (int joint = 0; joint < joints; ++joint)
  {
    out.measured[joint] = out.measured[joint] && out.plausible[joint];
    if (!out.measured[joint])
    {
      std::fill_n(out.surface + 3 * joint, 3, std::numeric_limits<double>::quiet_NaN());
    }
  }
}

/** Add the costs of being elsewhere than before to those of one joint. */
void addMemory(double root, double depth, double sigma, const double* deltas, int steps, double limit, float* costs)
{
  for (int i = 0; i < steps; ++i)
  {
    const double off = (root + deltas[i] - depth) / sigma;
    costs[i] += std::isfinite(off) ? static_cast<float>(std::min(off * off, limit)) : 0.0f;
  }
}

// ---- camera

struct Line
{
  double slope, offset, error;  ///< error: median distance
};

/** Fit y = slope x + offset by least squares. */
Line fitLine(const std::vector<double>& x, const std::vector<double>& y, double least_square)
{
  const double count = x.size();
  const double x_mean = std::accumulate(x.begin(), x.end(), 0.0) / count;
  const double y_mean = std::accumulate(y.begin(), y.end(), 0.0) / count;
  double square = 0.0, both = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
  {
    square += (x[i] - x_mean) * (x[i] - x_mean);
    both += (x[i] - x_mean) * (y[i] - y_mean);
  }
  const double slope = both / std::max(square, least_square);
  std::vector<double> errors(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
  {
    errors[i] = std::abs(slope * (x[i] - x_mean) - (y[i] - y_mean));
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size()) / 2;
  std::nth_element(errors.begin(), middle, errors.end());
  return { slope, y_mean - slope * x_mean, *middle };
}

// ---- interface to Python

template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;
using Floats = Array<float>;
using Doubles = Array<double>;
using Integers = Array<std::int64_t>;
using Flags = Array<bool>;

/** Return the data of an array that must have a shape. */
template <typename T>
const T* checked(const Array<T>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim()))
  {
    const auto text = [](const py::ssize_t* begin, const py::ssize_t* end) {
      std::string result = "(";
      for (const py::ssize_t* size = begin; size != end; ++size)
      {
        result += (size == begin ? "" : ", ") + std::to_string(*size);
      }
      return result + ")";
    };
    throw std::invalid_argument(std::string(name) + " must have shape " + text(shape.begin(), shape.end()) + ", got " +
                                text(array.shape(), array.shape() + array.ndim()));
  }
  return array.data();
}

template <typename T>
const T* checked(const std::optional<Array<T>>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  return array ? checked(*array, name, shape) : nullptr;
}

/** Return the size of an axis of an array with a number of axes. */
template <typename T>
py::ssize_t sizeOf(const Array<T>& array, const char* name, py::ssize_t axes, py::ssize_t axis)
{
  if (array.ndim() != axes)
  {
    throw std::invalid_argument(std::string(name) + " must have " + std::to_string(axes) + " dimensions, got " +
                                std::to_string(array.ndim()));
  }
  return array.shape(axis);
}

void checkWithin(const std::int64_t* values, py::ssize_t count, std::int64_t end, const char* name)
{
  if (!std::all_of(values, values + count, [end](std::int64_t value) { return value >= 0 && value < end; }))
  {
    throw std::invalid_argument(std::string(name) + " must lie in 0.." + std::to_string(end - 1));
  }
}

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

/** Return the number of parts, after a look at their ends. */
py::ssize_t partCount(const Integers& parts, py::ssize_t joints)
{
  const py::ssize_t count = sizeOf(parts, "parts", 2, 0);
  checkWithin(checked(parts, "parts", { count, 2 }), 2 * count, joints, "parts");
  return count;
}

py::array_t<double> othersDepthsOf(const Doubles& uv, const Doubles& joint_depths, double focal, const Integers& parts,
                                   const Doubles& radii, double least_square)
{
  const py::ssize_t people = sizeOf(uv, "uv", 3, 0), joints = uv.shape(1), count = partCount(parts, joints);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* depth = checked(joint_depths, "joint_depths", { people, joints });
  const double* radius = checked(radii, "radii", { count });
  py::array_t<double> result({ people, joints, people });
  double* out = result.mutable_data();
  py::gil_scoped_release release;
  othersDepths(at, depth, focal, people, joints, parts.data(), radius, count, least_square, out);
  return result;
}

std::optional<py::array_t<bool>> foreignSamplesOf(const Doubles& depth, const Doubles& others, const Doubles& expected,
                                                  double reach, double lead, double skin)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const py::ssize_t other_count = sizeOf(others, "others", 3, 2);
  const py::ssize_t per_person = sizeOf(expected, "expected", 2, 1) == 1 ? 1 : joints;
  const double* other = checked(others, "others", { people, joints, other_count });
  const double* own = checked(expected, "expected", { people, per_person });
  py::array_t<bool> result({ people, joints, samples });
  bool* out = result.mutable_data();
  bool any = false;
  {
    py::gil_scoped_release release;
    any = foreignSamples(depth.data(), other, own, per_person, people, joints, samples, other_count,
                         { reach, lead, skin }, out);
  }
  return any ? std::make_optional(result) : std::nullopt;
}

py::array_t<bool> coveredBySelfOf(const Doubles& uv, const Doubles& root, double focal, const Integers& parts,
                                  const Doubles& radii, const Flags& covering, double share, double least_square)
{
  const py::ssize_t people = sizeOf(uv, "uv", 3, 0), joints = uv.shape(1), count = partCount(parts, joints);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* trunk = checked(root, "root", { people });
  const double* radius = checked(radii, "radii", { count });
  const bool* may_cover = checked(covering, "covering", { joints, count });
  py::array_t<bool> result({ people, joints });
  bool* out = result.mutable_data();
  py::gil_scoped_release release;
  coveredBySelf(at, trunk, focal, people, joints, parts.data(), radius, may_cover, count, share, least_square, out);
  return result;
}

SizeSettings sizeSettings(const Doubles& depths, double foreshortening, double weight, double limit)
{
  SizeSettings result{ std::vector<double>(sizeOf(depths, "depths", 1, 0)), foreshortening, weight, limit };
  std::transform(depths.data(), depths.data() + depths.size(), result.log_depths.begin(),
                 [](double depth) { return std::log(depth); });
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

py::tuple doubtfulSurfacesOf(const Doubles& uv, const Doubles& depth, const Doubles& root, const Flags& covered,
                             double focal, const Integers& arms, double in_front, const Integers& limb_to,
                             const Doubles& beside, double shortest)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const double* at = checked(uv, "uv", { people, joints, 2 });
  const double* trunk = checked(root, "root", { people });
  const bool* behind_self = checked(covered, "covered", { people, joints });
  DoubtSettings settings{ std::vector<bool>(joints), in_front, checked(limb_to, "limb_to", { joints }), shortest };
  checkWithin(settings.limb_to, joints, joints, "limb_to");
  checkWithin(arms.data(), arms.size(), joints, "arms");
  for (py::ssize_t i = 0; i < arms.size(); ++i)
  {
    settings.arm[arms.data()[i]] = true;
  }
  const std::vector<Doubt> doubts = doubtfulSurfaces(at, depth.data(), trunk, behind_self, people, joints, samples,
                                                     settings);
  const py::ssize_t count = doubts.size(), distances = sizeOf(beside, "beside", 1, 0);
  py::array_t<std::int64_t> person(count), joint(count);
  py::array_t<double> surface(count), places({ py::ssize_t{ 2 }, distances, count, py::ssize_t{ 2 } });
  py::array_t<bool> far_in_front(count), on_trunk(count);
  for (py::ssize_t i = 0; i < count; ++i)
  {
    const Doubt& doubt = doubts[i];
    person.mutable_data()[i] = doubt.person;
    joint.mutable_data()[i] = doubt.joint;
    surface.mutable_data()[i] = doubt.surface;
    far_in_front.mutable_data()[i] = doubt.in_front;
    on_trunk.mutable_data()[i] = doubt.on_trunk;
    const auto [x, y] = acrossLimb(at, doubt, joints, focal, settings);
    const double* here = at + 2 * (doubt.person * joints + doubt.joint);
    for (py::ssize_t side = 0; side < 2; ++side)
    {
      for (py::ssize_t k = 0; k < distances; ++k)
      {
        const double reach = side == 0 ? -beside.data()[k] : beside.data()[k];
        double* place = places.mutable_data(side, k, i, 0);
        place[0] = here[0] + reach * x;
        place[1] = here[1] + reach * y;
      }
    }
  }
  return py::make_tuple(person, joint, surface, far_in_front, on_trunk, places);
}

/** Position, velocity and their covariances, see joint_filter.JointFilter. */
using FilterArrays = std::array<Doubles, 5>;

/** Copies of the arrays of a filter. */
class FilterCopy
{
public:
  explicit FilterCopy(const FilterArrays& state)
    : tracks(sizeOf(state[0], "position", 3, 0)), points(state[0].shape(1))
  {
    for (std::size_t i = 0; i < state.size(); ++i)
    {
      const double* values = i < 2 ? checked(state[i], "position and velocity", { tracks, points, 3 }) :
                                     checked(state[i], "covariances", { tracks, points, 3, 3 });
      arrays_[i] = py::array_t<double>(std::vector<py::ssize_t>(state[i].shape(), state[i].shape() + state[i].ndim()));
      std::copy_n(values, state[i].size(), arrays_[i].mutable_data());
    }
  }

  FilterState state()
  {
    return { arrays_[0].mutable_data(), arrays_[1].mutable_data(), arrays_[2].mutable_data(),
             arrays_[3].mutable_data(), arrays_[4].mutable_data() };
  }
  py::tuple arrays() const
  {
    return py::make_tuple(arrays_[0], arrays_[1], arrays_[2], arrays_[3], arrays_[4]);
  }

  const py::ssize_t tracks, points;

private:
  std::array<py::array_t<double>, 5> arrays_;
};

py::tuple predictOf(const FilterArrays& state, double elapsed, const Doubles& acceleration)
{
  FilterCopy copy(state);
  const double* by_point = checked(acceleration, "acceleration", { copy.points });
  predict(copy.state(), copy.tracks * copy.points, elapsed, by_point, copy.points);
  return copy.arrays();
}

py::tuple correctOf(const FilterArrays& state, const Integers& rows, const Doubles& measured, const Doubles& covariance,
                    const Flags& mask, double trusted_deviations)
{
  FilterCopy copy(state);
  const py::ssize_t count = sizeOf(rows, "rows", 1, 0), points = copy.points;
  checkWithin(rows.data(), count, copy.tracks, "rows");
  const double* at = checked(measured, "measured", { count, points, 3 });
  const double* noise = checked(covariance, "covariance", { count, points, 3, 3 });
  const bool* use = checked(mask, "mask", { count, points });
  for (py::ssize_t i = 0; i < count * points; ++i)
  {
    if (use[i])
    {
      correct(copy.state(), rows.data()[i / points] * points + i % points, at + 3 * i, noise + 9 * i,
              trusted_deviations);
    }
  }
  return copy.arrays();
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

py::tuple withFrame(const std::array<Doubles, 4>& sizes, const Doubles& xyz, const Flags& good,
                    const Integers& sized_pairs, const Doubles& sized_lengths, int least_bones, double adult_stature,
                    const std::pair<double, double>& stature_limits, const Doubles& adult_lengths, std::int64_t neck,
                    const Integers& hips, const Integers& pairs, const Integers& kinds, double prior_frames,
                    double most_frames, double most_change)
{
  const py::ssize_t people = sizeOf(xyz, "xyz", 3, 0), joints = xyz.shape(1);
  const py::ssize_t sized = partCount(sized_pairs, joints), pair_count = partCount(pairs, joints);
  const py::ssize_t kind_count = sizeOf(adult_lengths, "adult_lengths", 1, 0);
  checkWithin(&neck, 1, joints, "neck");
  checkWithin(checked(hips, "hips", { 2 }), 2, joints, "hips");
  checkWithin(checked(kinds, "kinds", { pair_count + 1 }), pair_count + 1, kind_count, "kinds");
  const MeasureSettings settings{ sized_pairs.data(), checked(sized_lengths, "sized_lengths", { sized }),
                                  static_cast<int>(sized), least_bones, adult_stature, stature_limits,
                                  adult_lengths.data(), static_cast<int>(kind_count), neck, hips.data(), pairs.data(),
                                  kinds.data(), static_cast<int>(pair_count), prior_frames, most_frames, most_change };
  const double* at = checked(xyz, "xyz", { people, joints, 3 });
  const bool* use = checked(good, "good", { people, joints });
  py::array_t<double> stature(people), stature_weight(people);
  py::array_t<double> bones({ people, kind_count }), bone_weights({ people, kind_count });
  std::copy_n(checked(sizes[0], "stature", { people }), people, stature.mutable_data());
  std::copy_n(checked(sizes[1], "stature_weight", { people }), people, stature_weight.mutable_data());
  std::copy_n(checked(sizes[2], "bones", { people, kind_count }), bones.size(), bones.mutable_data());
  std::copy_n(checked(sizes[3], "bone_weights", { people, kind_count }), bones.size(), bone_weights.mutable_data());
  std::vector<double> scratch;
  for (py::ssize_t p = 0; p < people; ++p)
  {
    addFrame(at + p * joints * 3, use + p * joints, settings, scratch,
             { stature.mutable_data()[p], stature_weight.mutable_data()[p], bones.mutable_data() + p * kind_count,
               bone_weights.mutable_data() + p * kind_count });
  }
  return py::make_tuple(stature, stature_weight, bones, bone_weights);
}

py::tuple estimateHeadPose(const Doubles& rays, const Doubles& scores, const Doubles& root, const Doubles& scale,
                           const Doubles& shoulder_cosine, const Integers& head, const Doubles& points,
                           const Doubles& offsets, const std::array<double, 3>& axes, double ahead, double error,
                           double cosine_spread, double sine_spread)
{
  const py::ssize_t people = sizeOf(rays, "rays", 3, 0), joints = rays.shape(1), count = sizeOf(head, "joints", 1, 0);
  checkWithin(head.data(), count, joints, "joints");
  const HeadSettings settings{ head.data(), checked(points, "points", { count, 3 }),
                               checked(offsets, "offsets", { count }), static_cast<int>(count), axes, ahead, error,
                               cosine_spread, sine_spread };
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const double* score = checked(scores, "scores", { people, joints });
  const double* trunk = checked(root, "root", { people });
  const double* size = checked(scale, "scale", { people });
  const double* cosine = checked(shoulder_cosine, "shoulder_cosine", { people });
  py::array_t<double> to_head({ people, py::ssize_t{ 3 } }), depths({ people, count }), surface({ people, count });
  py::array_t<bool> known(people);
  for (py::ssize_t p = 0; p < people; ++p)
  {
    known.mutable_data()[p] = headPose(
        ray + p * joints * 3, score + p * joints, trunk[p], size[p], cosine[p], settings,
        to_head.mutable_data() + 3 * p, depths.mutable_data() + p * count, surface.mutable_data() + p * count);
  }
  return py::make_tuple(to_head, depths, surface, known);
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

py::tuple measureOf(const Doubles& rays, const Doubles& scores, const Flags& known, const Doubles& depth,
                    const Doubles& z, const Doubles& offsets, const Doubles& own, const std::optional<Flags>& foreign,
                    const Floats& upper, const Floats& lower, const Doubles& weights, const Doubles& thicknesses,
                    const Integers& head, const Integers& chains, const Flags& legs, double agreement,
                    double least_support, double against_front, double least_own, double shortest, double longest,
                    double bone_error, double sure_end, double unsure_end, double folded)
{
  const py::ssize_t people = sizeOf(depth, "depth", 3, 0), joints = depth.shape(1), samples = depth.shape(2);
  const JointRules rules{ checked(thicknesses, "thicknesses", { joints }), head.data(), static_cast<int>(head.size()),
                          checked(chains, "chains", { 3 * LIMBS }), checked(legs, "legs", { LIMBS }), agreement,
                          least_support, against_front, least_own, shortest, longest, bone_error, sure_end, unsure_end,
                          folded };
  checkWithin(rules.chains, 3 * LIMBS, joints, "chains");
  const double* ray = checked(rays, "rays", { people, joints, 3 });
  const double* score = checked(scores, "scores", { people, joints });
  const bool* found = checked(known, "known", { people, joints });
  const double* at = checked(z, "z", { people, joints });
  const double* offset = checked(offsets, "offsets", { people, joints });
  const double* likely_own = checked(own, "own", { people, joints });
  const bool* others = checked(foreign, "foreign", { people, joints, samples });
  const float* upper_length = checked(upper, "upper", { people, LIMBS });
  const float* lower_length = checked(lower, "lower", { people, LIMBS });
  Window window(checked(weights, "weights", { samples }), samples);
  py::array_t<double> xyz({ people, joints, py::ssize_t{ 3 } }), surface({ people, joints, py::ssize_t{ 3 } });
  py::array_t<bool> measured({ people, joints }), plausible({ people, joints });
  for (py::ssize_t p = 0; p < people; ++p)
  {
    const py::ssize_t row = p * joints;
    measure({ ray + 3 * row, score + row, found + row, depth.data() + row * samples, at + row, offset + row,
              likely_own + row, others == nullptr ? nullptr : others + row * samples, upper_length + p * LIMBS,
              lower_length + p * LIMBS },
            joints, samples, window, rules,
            { xyz.mutable_data() + 3 * row, surface.mutable_data() + 3 * row, measured.mutable_data() + row,
              plausible.mutable_data() + row });
  }
  return py::make_tuple(xyz, surface, measured, plausible);
}

py::array_t<float> withMemory(const Floats& costs, const Doubles& root, const Doubles& depth, const Doubles& sigma,
                              const Doubles& deltas, double limit)
{
  const py::ssize_t people = sizeOf(costs, "costs", 3, 0), joints = costs.shape(1), steps = costs.shape(2);
  const double* trunk = checked(root, "root", { people });
  const double* before = checked(depth, "depth", { people, joints });
  const double* deviation = checked(sigma, "sigma", { people, joints });
  const double* delta = checked(deltas, "deltas", { steps });
  py::array_t<float> result({ people, joints, steps });
  std::copy_n(costs.data(), costs.size(), result.mutable_data());
  for (py::ssize_t row = 0; row < people * joints; ++row)
  {
    addMemory(trunk[row / joints], before[row], deviation[row], delta, steps, limit,
              result.mutable_data() + row * steps);
  }
  return result;
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

std::optional<std::array<double, 5>> fitPinhole(const Doubles& points, const Integers& pixels, std::size_t least_points,
                                                double least_square)
{
  const py::ssize_t count = sizeOf(points, "points", 2, 1);
  const double *x = checked(points, "points", { 3, count }), *y = x + count, *z = y + count;
  const std::int64_t *u = checked(pixels, "pixels", { 2, count }), *v = u + count;
  std::array<std::vector<double>, 2> slopes, at;
  for (py::ssize_t i = 0; i < count; ++i)
  {
    if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]) && z[i] > 0.0)
    {
      slopes[0].push_back(x[i] / z[i]);
      slopes[1].push_back(y[i] / z[i]);
      at[0].push_back(static_cast<double>(u[i]));
      at[1].push_back(static_cast<double>(v[i]));
    }
  }
  const auto all_alike = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [&values](double value) { return value == values.front(); });
  };
  if (slopes[0].size() < least_points || all_alike(at[0]) || all_alike(at[1]))
  {
    return std::nullopt;
  }
  const Line horizontal = fitLine(slopes[0], at[0], least_square), vertical = fitLine(slopes[1], at[1], least_square);
  return { { horizontal.slope, vertical.slope, horizontal.offset, vertical.offset,
             std::max(horizontal.error, vertical.error) } };
}
}  // namespace skeleton_extract_3d

PYBIND11_MODULE(skeleton_extract_3d_lifting, module)
{
  using namespace skeleton_extract_3d;
  module.doc() = "Compiled twins of functions of skeleton_extract_3d, of the same names: the arguments of those, then "
                 "the constants of their modules.";
  module.def("infer_depths", &inferDepths, "Twin of depth_inference.infer_depths: (joints, head, left).",
             py::arg("costs"), py::arg("head_costs"), py::arg("rays"), py::arg("head_ray"), py::arg("root"),
             py::arg("bones"), py::arg("stature"), py::arg("left_before"), py::arg("steps"),
             py::arg("half"), py::arg("step"), py::arg("mode"), py::arg("nearest"), py::arg("length_limit"),
             py::arg("direction_limit"), py::arg("turn_limit"), py::arg("turn_spread"), py::arg("pair_error"),
             py::arg("level"), py::arg("least_length"), py::arg("adult_stature"), py::arg("sides"),
             py::arg("upper_directions"), py::arg("lower_directions"));
  module.def("read_depths", &readDepths, "Twin of depth_inference.read_depths.", py::arg("beliefs"),
             py::arg("steps"), py::arg("half"), py::arg("step"), py::arg("mode"));
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
  module.def("others_depths", &othersDepthsOf, "Twin of occluders.others_depths.", py::arg("uv"),
             py::arg("joint_depths"), py::arg("focal"), py::arg("parts"), py::arg("radii"),
             py::arg("least_square"));
  module.def("foreign_samples", &foreignSamplesOf, "Twin of occluders.foreign_samples.", py::arg("depth"),
             py::arg("others"), py::arg("expected"), py::arg("reach"), py::arg("lead"), py::arg("skin"));
  module.def("covered_by_self", &coveredBySelfOf, "Twin of occluders.covered_by_self.", py::arg("uv"), py::arg("root"),
             py::arg("focal"), py::arg("parts"), py::arg("radii"), py::arg("covering"), py::arg("share"),
             py::arg("least_square"));
  module.def("fit_pinhole", &fitPinhole, "Twin of camera.fit_pinhole.", py::arg("points"), py::arg("pixels"),
             py::arg("least_points"), py::arg("least_square"));
  module.def("lower_median", &lowerMedianOf, "Twin of surfaces.lower_median.", py::arg("values"));
  module.def("size_evidence", &sizeEvidenceOf, "Twin of surfaces.size_evidence.", py::arg("size"), py::arg("spread"),
             py::arg("depths"), py::arg("foreshortening"), py::arg("weight"), py::arg("limit"));
  module.def("size_depth", &sizeDepthOf, "Twin of surfaces.size_depth.", py::arg("rays"), py::arg("scores"),
             py::arg("pairs"), py::arg("lengths"), py::arg("least_score"), py::arg("bias"));
  module.def("mean_within", &meanWithinOf, "Twin of surfaces.mean_within.", py::arg("depth"), py::arg("offsets"),
             py::arg("middle"), py::arg("reach"), py::arg("known"), py::arg("foreign"), py::arg("joints"),
             py::arg("weights"));
  module.def("doubtful_surfaces", &doubtfulSurfacesOf, "Twin of occluders.doubtful_surfaces.", py::arg("uv"),
             py::arg("depth"), py::arg("root"), py::arg("covered"), py::arg("focal"), py::arg("arms"),
             py::arg("in_front"), py::arg("limb_to"), py::arg("beside"), py::arg("shortest"));
  module.def("predict", &predictOf, "Twin of joint_filter.JointFilter.predict.", py::arg("state"), py::arg("elapsed"),
             py::arg("acceleration"));
  module.def("correct", &correctOf, "Twin of joint_filter.JointFilter.correct.", py::arg("state"), py::arg("rows"),
             py::arg("measured"), py::arg("covariance"), py::arg("mask"), py::arg("trusted_deviations"));
  module.def("satisfy_lengths", &satisfyLengthsOf, "Twin of bone_constraints.satisfy_lengths.", py::arg("xyz"),
             py::arg("covariance"), py::arg("lengths"), py::arg("spreads"), py::arg("usable"), py::arg("bones"),
             py::arg("change"), py::arg("most_violation"));
  module.def("with_frame", &withFrame, "Twin of body_measures.with_frame.", py::arg("sizes"), py::arg("xyz"),
             py::arg("good"), py::arg("sized_pairs"), py::arg("sized_lengths"), py::arg("least_bones"),
             py::arg("adult_stature"), py::arg("stature_limits"), py::arg("adult_lengths"), py::arg("neck"),
             py::arg("hips"), py::arg("pairs"), py::arg("kinds"), py::arg("prior_frames"), py::arg("most_frames"),
             py::arg("most_change"));
  module.def("estimate_head_pose", &estimateHeadPose, "Twin of head_pose.estimate_head_pose.", py::arg("rays"),
             py::arg("scores"), py::arg("root"), py::arg("scale"), py::arg("shoulder_cosine"), py::arg("joints"),
             py::arg("points"), py::arg("offsets"), py::arg("axes"), py::arg("ahead"), py::arg("error"),
             py::arg("cosine_spread"), py::arg("sine_spread"));
  module.def("distances_across", &distancesAcrossOf, "Twin of identity.distances_across.", py::arg("position"),
             py::arg("has"), py::arg("rays"), py::arg("known"));
  module.def("evidence_against", &evidenceAgainstOf, "Twin of identity.evidence_against.", py::arg("evidence"),
             py::arg("size"), py::arg("scale"), py::arg("spread"), py::arg("z"), py::arg("same_depth"), py::arg("most"),
             py::arg("depths"), py::arg("foreshortening"), py::arg("weight"), py::arg("limit"));
  module.def("with_memory", &withMemory, "Twin of pose_lifting.with_memory.", py::arg("costs"), py::arg("root"),
             py::arg("depth"), py::arg("sigma"), py::arg("deltas"), py::arg("limit"));
  module.def("measure", &measureOf, "Twin of pose_lifting.measure.", py::arg("rays"), py::arg("scores"),
             py::arg("known"), py::arg("depth"), py::arg("z"), py::arg("offsets"), py::arg("own"), py::arg("foreign"),
             py::arg("upper"), py::arg("lower"), py::arg("weights"), py::arg("thicknesses"), py::arg("head"),
             py::arg("chains"), py::arg("legs"), py::arg("agreement"), py::arg("least_support"),
             py::arg("against_front"), py::arg("least_own"), py::arg("shortest"), py::arg("longest"),
             py::arg("bone_error"), py::arg("sure_end"), py::arg("unsure_end"), py::arg("folded"));
}
