/**
 * Compiled twins of hot functions of the Python modules skeleton_extract_3d.{depth_inference, surfaces, occluders},
 * which explain what is done and why; they are the reference, and every constant comes from them.
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

void othersDepths(const double* uv, const double* joint_depths, double focal, int people, int joints,
                  const std::int64_t* parts, const double* radii, int part_count, double least_square, double* result)
{
  BodyParts body(parts, part_count);
  std::fill_n(result, people * joints * people, std::numeric_limits<double>::infinity());
  for (int other = 0; other < people; ++other)
  {
    body.place(uv + other * joints * 2, least_square);
    const double* depths = joint_depths + other * joints;
    for (int row = 0; row < people * joints; ++row)
    {
      if (row / joints == other || !std::isfinite(uv[2 * row]))
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
}
