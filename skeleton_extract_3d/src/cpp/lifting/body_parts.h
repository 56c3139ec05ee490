/** The body that registration.cpp moves: its places and parts, and where the points on them are attached. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "geometry.h"
#include "steps.h"

namespace skeleton_extract_3d
{
constexpr double ROUND = 0.3;  ///< no part reaches further from the places [m]
constexpr int BODY_PLACES = 13, HEAD_PLACE = 12, LIMB_PARTS = 8, TRUNK_PART = 8, BODY_PARTS = 10, SIZE = 3 * BODY_PLACES;
using Places = std::array<Direction, BODY_PLACES>;

inline Places placesAt(const double* values)
{
  Places result;
  for (int i = 0; i < BODY_PLACES; ++i)
  {
    result[i] = at(values + 3 * i);
  }
  return result;
}

/** Depths [m] of a grid of pixels, not positive or not finite where missing, and the affine map from column and row to x and y of the ray. */
class Grid
{
public:
  explicit Grid(const DepthGrid& grid)
    : height(static_cast<int>(countOf(std::get<0>(grid))))
    , width(height > 0 && std::get<0>(grid).ndim() == 2 ? static_cast<int>(std::get<0>(grid).shape(1)) : 0)
    , depth_(checked(std::get<0>(grid), "depth", { height, width }))
    , ray_(checked(std::get<1>(grid), "rays", { 2, 3 }))
    , determinant_(ray_[0] * ray_[4] - ray_[1] * ray_[3])
  {
  }

  double at(int row, int column) const
  {
    return depth_[row * width + column];
  }

  Direction point(int row, int column) const
  {
    const double z = at(row, column);
    return { (ray_[0] * column + ray_[1] * row + ray_[2]) * z, (ray_[3] * column + ray_[4] * row + ray_[5]) * z, z };
  }

  /** Return whether a point is in front of the grid, and set the nearest row and column. */
  bool pixel(const Direction& point, int& row, int& column) const
  {
    const double x = point.x / point.z - ray_[2], y = point.y / point.z - ray_[5];
    const double u = std::floor((ray_[4] * x - ray_[1] * y) / determinant_ + 0.5);
    const double v = std::floor((ray_[0] * y - ray_[3] * x) / determinant_ + 0.5);
    if (!(point.z > 0 && u >= 0 && v >= 0 && u < width && v < height))
    {
      return false;
    }
    row = static_cast<int>(v);
    column = static_cast<int>(u);
    return true;
  }

  /** Return the size of a cell at a depth of 1 m [m]. */
  double cell() const
  {
    return std::sqrt(std::abs(determinant_));
  }

  const int height, width;

private:
  const float* depth_;
  const double* ray_;
  double determinant_;
};

/** Where a point is held: weights of the places of its part. */
struct Attachment
{
  int part = 0, count = 0;
  std::array<int, 4> place = {};
  std::array<double, 4> weight = {};

  Direction on(const Places& places) const
  {
    Direction sum = { 0, 0, 0 };
    for (int i = 0; i < count; ++i)
    {
      sum = sum + places[place[i]] * weight[i];
    }
    return sum;
  }
};

struct Body
{
  Body(const Places& places_of, const double* radii_of) : places(places_of), radii(radii_of)
  {
    top = (places[0] + places[1]) * 0.5;
    down = (places[2] + places[3]) * 0.5 - top;
    length = std::max(std::sqrt(dot(down, down)), LEAST_LENGTH);
    down = unit(down);
    left = (places[0] - places[1]) + (places[2] - places[3]);
    left = unit(left - down * dot(left, down));
    out = cross(down, left);
    width = std::max(distanceBetween(places[0], places[1]), 0.1);
    low = high = places[0];
    for (const Direction& place : places)
    {
      low = { std::min(low.x, place.x), std::min(low.y, place.y), std::min(low.z, place.z) };
      high = { std::max(high.x, place.x), std::max(high.y, place.y), std::max(high.z, place.z) };
    }
  }

  /** Return whether a point is within a distance of the box around the places. */
  bool near(const Direction& point, double reach) const
  {
    return point.x > low.x - reach && point.x < high.x + reach && point.y > low.y - reach &&
           point.y < high.y + reach && point.z > low.z - reach && point.z < high.z + reach;
  }

  /** Return the distance of a point from a part in radii, and set where it is attached. */
  double distance(const Direction& point, int part, Attachment& where) const
  {
    where.part = part;
    if (part < LIMB_PARTS)
    {
      return fromLimb(point, where);
    }
    if (part == TRUNK_PART)
    {
      return fromTrunk(point, where);
    }
    where.count = 1;
    where.place[0] = HEAD_PLACE;
    where.weight[0] = 1;
    return distanceBetween(point, places[HEAD_PLACE]) / radii[HEAD_PLACE];
  }

  /** Return the distance from the nearest part. */
  double distance(const Direction& point, Attachment& where) const
  {
    double least = std::numeric_limits<double>::infinity();
    Attachment one;
    for (int part = 0; part < BODY_PARTS; ++part)
    {
      const double radii_away = distance(point, part, one);
      if (radii_away < least)
      {
        least = radii_away;
        where = one;
      }
    }
    return least;
  }

  /** Return the rotation of a part from where it is in another pose of this body. */
  Matrix turned(const Body& before, int part) const
  {
    if (part >= LIMB_PARTS)
    {
      return axes() * transposed(before.axes());
    }
    const Direction a = unit(before.places[part + 4] - before.places[part]);
    const Direction b = unit(places[part + 4] - places[part]), v = cross(a, b);
    const double c = dot(a, b), k = 1 / std::max(1 + c, 0.05);
    return { c + v.x * v.x * k,   v.x * v.y * k - v.z, v.x * v.z * k + v.y, v.x * v.y * k + v.z, c + v.y * v.y * k,
             v.y * v.z * k - v.x, v.x * v.z * k - v.y, v.y * v.z * k + v.x, c + v.z * v.z * k };
  }

  Places places;
  const double* radii;

private:
  double fromLimb(const Direction& point, Attachment& where) const
  {
    const int start = where.part, end = start + 4;
    const Direction along = places[end] - places[start];
    const double raw = dot(point - places[start], along) / std::max(dot(along, along), LEAST_LENGTH * LEAST_LENGTH);
    // hands and feet go on beyond wrists and ankles
    const double share = std::clamp(raw, 0.0, start >= LIMBS ? 1.3 : 1.0);
    where.count = 2;
    where.place = { start, end };
    where.weight = { 1 - share, share };
    const double radius = radii[start] + (radii[end] - radii[start]) * std::min(share, 1.0);
    return distanceBetween(point, places[start] + along * share) / radius;
  }

  double fromTrunk(const Direction& point, Attachment& where) const
  {
    const Direction off = point - top;
    const double v = dot(off, down) / length, u = 0.5 - dot(off, left) / width, n = dot(off, out);
    const double across = std::max({ 0.0, -0.1 - u, u - 1.1 }) * width;
    const double along = std::max({ 0.0, -0.05 - v, v - 1.05 }) * length;
    const double right = std::clamp(u, 0.0, 1.0), low = std::clamp(v, 0.0, 1.0);
    where.count = 4;
    where.place = { 0, 1, 2, 3 };
    where.weight = { (1 - right) * (1 - low), right * (1 - low), (1 - right) * low, right * low };
    // a trunk is broader than deep: beside it, distances count twice
    return std::sqrt(n * n + 4 * (across * across + along * along)) / (radii[0] + (radii[2] - radii[0]) * low);
  }

  Matrix axes() const
  {
    return { left.x, down.x, out.x, left.y, down.y, out.y, left.z, down.z, out.z };
  }

  Direction top, down, left, out, low, high;
  double width, length;
};
}  // namespace skeleton_extract_3d
