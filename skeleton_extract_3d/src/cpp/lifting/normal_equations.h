/** Least squares for the displacements of the places of a body. */
#pragma once

#include <array>
#include <cmath>

#include "body_parts.h"

namespace skeleton_extract_3d
{
/** Normal equations of the displacements of all places. */
struct System
{
  std::array<double, SIZE * SIZE> matrix = {};
  std::array<double, SIZE> right = {};

  double& at(int row, int column)
  {
    return matrix[row * SIZE + column];
  }

  /** Add a residual along a unit vector, of a point that places move by their weights. */
  void add(const Attachment& where, const Direction& along, double residual, double weight)
  {
    const double g[3] = { along.x, along.y, along.z };
    for (int i = 0; i < 3 * where.count; ++i)
    {
      const double here = weight * where.weight[i / 3] * g[i % 3];
      const int row = 3 * where.place[i / 3] + i % 3;
      right[row] += here * residual;
      for (int j = 0; j < 3 * where.count; ++j)
      {
        at(row, 3 * where.place[j / 3] + j % 3) += here * where.weight[j / 3] * g[j % 3];
      }
    }
  }

  /** Replace the matrix by its Cholesky factor; return whether it is positive definite. */
  bool factorize()
  {
    for (int j = 0; j < SIZE; ++j)
    {
      for (int i = j; i < SIZE; ++i)
      {
        double rest = at(i, j);
        for (int k = 0; k < j; ++k)
        {
          rest -= at(i, k) * at(j, k);
        }
        if (i == j && !(rest > 0))
        {
          return false;
        }
        at(i, j) = i == j ? std::sqrt(rest) : rest / at(j, j);
      }
    }
    return true;
  }

  /** Solve with the factor, in place. */
  void solve(double* values)
  {
    for (int i = 0; i < SIZE; ++i)
    {
      for (int k = 0; k < i; ++k)
      {
        values[i] -= at(i, k) * values[k];
      }
      values[i] /= at(i, i);
    }
    for (int i = SIZE - 1; i >= 0; --i)
    {
      for (int k = i + 1; k < SIZE; ++k)
      {
        values[i] -= at(k, i) * values[k];
      }
      values[i] /= at(i, i);
    }
  }
};
}  // namespace skeleton_extract_3d
