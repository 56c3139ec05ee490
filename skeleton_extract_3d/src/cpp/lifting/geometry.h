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

inline Direction operator*(const Direction& v, double factor)
{
  return { v.x * factor, v.y * factor, v.z * factor };
}

inline Direction operator+(const Direction& a, const Direction& b)
{
  return { a.x + b.x, a.y + b.y, a.z + b.z };
}

inline Direction operator-(const Direction& a, const Direction& b)
{
  return { a.x - b.x, a.y - b.y, a.z - b.z };
}

inline Direction cross(const Direction& a, const Direction& b)
{
  return { a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x };
}

constexpr double LEAST_LENGTH = 1e-3;  ///< of a vector with a direction [m]

/** Return a vector of length 1, or a shorter one if it had less than the least length. */
inline Direction unit(const Direction& v)
{
  const double length = std::max(std::sqrt(dot(v, v)), LEAST_LENGTH);
  return { v.x / length, v.y / length, v.z / length };
}

inline Direction at(const double* values)
{
  return { values[0], values[1], values[2] };
}

inline void store(const Direction& v, double* values)
{
  values[0] = v.x;
  values[1] = v.y;
  values[2] = v.z;
}

inline double distanceBetween(const Direction& a, const Direction& b)
{
  const Direction along = a - b;
  return std::sqrt(dot(along, along));
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

inline Direction operator*(const Matrix& a, const Direction& v)
{
  return { a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
           a[6] * v.x + a[7] * v.y + a[8] * v.z };
}

inline Matrix operator*(const Matrix& a, const Matrix& b)
{
  Matrix result;
  for (int i = 0; i < 9; ++i)
  {
    const double* row = a.data() + i / 3 * 3;
    result[i] = row[0] * b[i % 3] + row[1] * b[3 + i % 3] + row[2] * b[6 + i % 3];
  }
  return result;
}

/** Return a + factor * b. */
inline Matrix sum(const Matrix& a, double factor, const Matrix& b)
{
  Matrix result;
  std::transform(a.begin(), a.end(), b.begin(), result.begin(), [=](double x, double y) { return x + factor * y; });
  return result;
}

inline Matrix inverse(const Matrix& m)
{
  Matrix result = { m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                    m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                    m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3] };
  const double determinant = m[0] * result[0] + m[1] * result[3] + m[2] * result[6];
  std::for_each(result.begin(), result.end(), [=](double& value) { value /= determinant; });
  return result;
}
}  // namespace skeleton_extract_3d
