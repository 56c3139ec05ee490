/** Vectors and matrices of three dimensions. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace skeleton_extract_3d
{
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

inline Direction scaled(const Direction& v, double factor)
{
  return { v.x * factor, v.y * factor, v.z * factor };
}

inline Direction sum(const Direction& a, const Direction& b)
{
  return { a.x + b.x, a.y + b.y, a.z + b.z };
}

inline Direction difference(const Direction& a, const Direction& b)
{
  return { a.x - b.x, a.y - b.y, a.z - b.z };
}

inline Direction unit(const Direction& v, double least_length)
{
  const double length = std::max(std::sqrt(dot(v, v)), least_length);
  return { v.x / length, v.y / length, v.z / length };
}

inline double distanceBetween(const double* a, const double* b)
{
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

/** A matrix of 3 x 3, row by row. */
using Matrix = std::array<double, 9>;

inline Matrix matrixAt(const double* values)
{
  Matrix result;
  std::copy_n(values, result.size(), result.begin());
  return result;
}

inline Matrix transposed(const Matrix& m)
{
  return { m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8] };
}

inline Matrix product(const Matrix& a, const Matrix& b)
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

inline Direction product(const Matrix& a, const Direction& v)
{
  return { a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
           a[6] * v.x + a[7] * v.y + a[8] * v.z };
}

/** Return a + factor * b. */
inline Matrix sum(const Matrix& a, double factor, const Matrix& b)
{
  Matrix result;
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    result[i] = a[i] + factor * b[i];
  }
  return result;
}

inline Matrix symmetric(const Matrix& m)
{
  const Matrix other = transposed(m);
  Matrix result;
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    result[i] = (m[i] + other[i]) / 2;
  }
  return result;
}

inline Matrix inverse(const Matrix& m)
{
  const Matrix adjugate = { m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                            m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                            m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3] };
  const double determinant = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
  Matrix result;
  std::transform(adjugate.begin(), adjugate.end(), result.begin(), [=](double value) { return value / determinant; });
  return result;
}
}  // namespace skeleton_extract_3d
