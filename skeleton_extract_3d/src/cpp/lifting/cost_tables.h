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
// For processors with vectors of eight floats the compiler makes a second version, chosen when the module is loaded.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VECTORISED __attribute__((target_clones("avx2", "default"))) static
#else
#define VECTORISED static
#endif

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

/** One number per candidate; what rows are filled up with is 0 and has no effect. */
using Message = std::vector<float>;

/** Costs of the pairs of candidates of two places, row by row; rows are filled up with infinity. */
struct Table
{
  Table(int row_count, int column_count)
    : rows(row_count), columns(column_count), stride(filledUp(columns)), values(rows * stride, INFINITE)
  {
  }
  float* row(int index)
  {
    return values.data() + index * stride;
  }
  const float* row(int index) const
  {
    return values.data() + index * stride;
  }

  int rows, columns, stride;
  std::vector<float> values;
};

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

/** Lower each result to the sum of a row and a value. */
inline void lower(const float* row, float value, int columns, float* result)
{
  for (int i = 0; i < columns; ++i)
  {
    result[i] = lesser(row[i] + value, result[i]);
  }
}

/** For each row, the least sum with a message to the columns. */
VECTORISED void passToRows(const Table& table, const Message& message, float* result)
{
  for (int i = 0; i < table.rows; ++i)
  {
    result[i] = leastSum(table.row(i), message.data(), table.stride);
  }
}

/** For each column, the least sum with a message to the rows. */
VECTORISED void passToColumns(const Table& table, const Message& message, float* result)
{
  std::fill_n(result, table.columns, INFINITE);
  for (int i = 0; i < table.rows; ++i)
  {
    lower(table.row(i), message[i], table.columns, result);
  }
}

/** The candidates of a place: depths [m] along a ray. */
struct Candidates
{
  const Message& z;
  Ray ray;
};

struct Length
{
  float mean, sigma;  ///< [m]
};

/** Fill a table with the costs of a bone between candidates of its ends. */
VECTORISED void lengthCosts(const Candidates& start, const Candidates& end, const Length& length, float limit, Table& table)
{
  const int columns = table.columns;
  const float start_start = dot(start.ray, start.ray), end_end = dot(end.ray, end.ray);
  const float twice_both = 2 * dot(start.ray, end.ray), mean = length.mean, certainty = 1 / length.sigma;
  const float* z_end = end.z.data();
  for (int i = 0; i < table.rows; ++i)
  {
    const float start_square = start_start * start.z[i] * start.z[i], both = twice_both * start.z[i];
    float* row = table.row(i);
    for (int j = 0; j < columns; ++j)
    {
      const float square = start_square + end_end * z_end[j] * z_end[j] - both * z_end[j];
      const float off = (std::sqrt(square > 0.0f ? square : 0.0f) - mean) * certainty;
      row[j] = lesser(off * off, limit);
    }
  }
}

/** An axis of a body, and how far along it a limb leads, in standard deviations. */
struct Lead
{
  Direction axis;
  float mean;
  double sigma;  ///< [m]
};

/** Add the costs of where a limb points. */
VECTORISED void addDirectionCosts(const Candidates& start, const Candidates& end, const Lead& outwards, const Lead& forward,
                              float limit, Table& table)
{
  const int columns = table.columns;
  const auto along = [](const Ray& ray, const Lead& lead) {
    return static_cast<float>(dot(ray, lead.axis) / lead.sigma);
  };
  const float start_out = along(start.ray, outwards), start_forward = along(start.ray, forward);
  const float end_out = along(end.ray, outwards), end_forward = along(end.ray, forward);
  const float mean_out = outwards.mean, mean_forward = forward.mean;
  const float* z = end.z.data();
  for (int i = 0; i < table.rows; ++i)
  {
    const float from_out = start_out * start.z[i], from_forward = start_forward * start.z[i];
    float* row = table.row(i);
    for (int j = 0; j < columns; ++j)
    {
      const float out = end_out * z[j] - mean_out - from_out, ahead = end_forward * z[j] - mean_forward - from_forward;
      row[j] += lesser(out * out + ahead * ahead, limit);
    }
  }
}
}  // namespace skeleton_extract_3d
