/**
 * Tables of the costs of pairs of candidates, what fills them, and the messages that pass through them.
 *
 * Loops over candidates run over contiguous floats and without branches, so that compilers make vector instructions of
 * them.
 */
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry.h"

namespace skeleton_extract_3d
{
constexpr float INFINITE = std::numeric_limits<float>::infinity();

constexpr int LANES = 8;  ///< numbers that are compared side by side; rows of tables are filled up to a multiple of it

inline int filledUp(int count)
{
  return (count + LANES - 1) / LANES * LANES;
}

inline float lesser(float a, float b)
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

/** Least sum of a row of a table and a message. */
inline float leastSum(const float* row, const float* message, int stride)
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
inline void passToRows(const Table& table, const Message& message, float* result)
{
  for (int i = 0; i < table.rows(); ++i)
  {
    result[i] = leastSum(table.row(i), message.data(), table.stride());
  }
}

/** For each column, the least sum with a message to the rows. */
inline void passToColumns(const Table& table, const float* message, float* result)
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
inline void lengthCosts(const float* z_start, const Ray& start, const float* z_end, const Ray& end, float length,
                        float sigma, float limit, Table& table)
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
inline void addDirectionCosts(const float* z, const Ray& start, const Ray& end, const Direction& outwards,
                              const Direction& forward, const double* mean, const double* sigma, double scale,
                              float limit, Table& table)
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
}  // namespace skeleton_extract_3d
