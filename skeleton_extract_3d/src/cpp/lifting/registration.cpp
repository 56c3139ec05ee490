/**
 * Registration of a body with depths: the points on it in an earlier frame are moved onto those of this one, see
 * lift/registration.py. A body are the thirteen places of robust.py and ten parts: four upper limbs, four
 * lower ones, trunk, head. A point is attached to the places of its part by weights, and turns with it.
 */
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "body_parts.h"
#include "normal_equations.h"
#include "steps.h"

namespace skeleton_extract_3d
{
namespace
{
constexpr double FLAT = 0.04;  ///< neighbours of a point on one surface differ by less in depth [m]

std::vector<Body> bodiesOf(const Doubles& others, const double* radii)
{
  const double* values = checked(others, "others", { countOf(others), BODY_PLACES, 3 });
  std::vector<Body> bodies;
  for (py::ssize_t i = 0; i < countOf(others); ++i)
  {
    bodies.emplace_back(placesAt(values + i * SIZE), radii);
  }
  return bodies;
}

bool nearerToOthers(const Direction& point, double own, const std::vector<Body>& others)
{
  Attachment where;
  return std::any_of(others.begin(), others.end(),
                     [&](const Body& other) { return other.near(point, ROUND) && other.distance(point, where) < own; });
}

Direction towardsCamera(const Direction& normal, const Direction& point)
{
  return dot(normal, point) > 0 ? normal * -1 : normal;
}

/** Return the normal of the surface at a pixel by its neighbours; on limbs, and at edges, by the axis of the part. */
Direction normalAt(const Grid& grid, int row, int column, const Attachment& where, const Places& places)
{
  const Direction point = grid.point(row, column);
  Direction flat = { 0, 0, 0 };
  if (row > 0 && column > 0 && row + 1 < grid.height && column + 1 < grid.width)
  {
    const std::array<Direction, 4> around = { grid.point(row, column + 1), grid.point(row, column - 1),
                                              grid.point(row + 1, column), grid.point(row - 1, column) };
    if (std::all_of(around.begin(), around.end(),
                    [&](const Direction& one) { return std::abs(one.z - point.z) < FLAT; }))
    {
      flat = cross(around[0] - around[1], around[2] - around[3]);
      flat = towardsCamera(flat * (1 / std::sqrt(std::max(dot(flat, flat), 1e-18))), point);
    }
  }
  if (dot(flat, flat) > 0 && where.part >= LIMB_PARTS)
  {
    return flat;
  }
  Direction outwards = point - where.on(places);
  outwards = outwards - point * (std::max(dot(outwards, point), 0.0) / dot(point, point));  // never away from the camera
  return unit(unit(outwards) + flat);
}

struct Sample
{
  Direction point, normal;
};

constexpr int FIXED_LENGTHS[][2] = { { 0, 1 }, { 2, 3 }, { 0, 2 }, { 1, 3 },  { 0, 3 },  { 1, 2 },  { 0, 4 },  { 1, 5 },
                             { 2, 6 }, { 3, 7 }, { 4, 8 }, { 5, 9 }, { 6, 10 }, { 7, 11 }, { 12, 0 }, { 12, 1 } };

/** How the places are expected: means [m], and inverse covariances. */
struct Prior
{
  Places mean;
  std::array<Matrix, BODY_PLACES> information;
};

class Registration
{
public:
  Registration(const Constants& method, const Grid& grid, const Body& before, const Prior& prior,
               const std::vector<Body>& others)
    : constants_(method.registration)
    , grid_(grid)
    , before_(before)
    , prior_(prior)
    , others_(others)
    , expected_(prior.mean, before.radii)
    , now_(expected_)
  {
  }

  void attach(const Direction& point, const Direction& normal, int part)
  {
    Held held;
    before_.distance(point, part, held.where);
    held.offset = point - held.where.on(before_.places);
    held.normal = normal;
    points_.push_back(held);
  }

  /** Iterate; return whether the equations could be solved. */
  bool run()
  {
    for (int iteration = 0; iteration <= constants_.iterations; ++iteration)
    {
      const bool rigid = iteration < constants_.rigid_iterations;
      now_ = Body(now_.places, before_.radii);
      matchPoints(rigid ? constants_.rigid_reach : constants_.reach);
      system_ = System();
      addPrior(rigid ? 1.0 / BODY_PLACES : 1.0);
      addBones();
      addPoints();
      if (rigid)
      {
        moveAll();
        continue;
      }
      if (!system_.factorize())
      {
        return false;
      }
      if (iteration < constants_.iterations)
      {
        system_.solve(system_.right.data());
        for (int i = 0; i < BODY_PLACES; ++i)
        {
          now_.places[i] = now_.places[i] + at(&system_.right[3 * i]);
        }
      }
    }
    return true;
  }

  const Places& places() const
  {
    return now_.places;
  }

  /** Write the covariances of the places, (13, 3, 3). */
  void covariances(double* out)
  {
    for (int row = 0; row < SIZE; ++row)
    {
      std::array<double, SIZE> unit_vector = {};
      unit_vector[row] = 1;
      system_.solve(unit_vector.data());
      std::copy_n(unit_vector.begin() + row / 3 * 3, 3, out + 3 * row);
    }
  }

  /** Return the share of the points in view that are on a surface, and of all points that are in view. */
  std::array<double, 2> fit() const
  {
    double on = 0, in_view = 0;
    for (const Held& held : points_)
    {
      on += held.kind == ON;
      in_view += held.kind == ON || held.kind == BESIDE || held.kind == LOST;
    }
    return { on / std::max(in_view, 1.0), in_view / std::max<double>(points_.size(), 1.0) };
  }

private:
  /** ON a surface; BESIDE the body, which is near; LOST: nothing is near; HIDDEN, or without a depth. */
  enum Kind
  {
    ON,
    BESIDE,
    LOST,
    HIDDEN
  };
  struct Held
  {
    Attachment where;
    Direction offset, normal;                     // in the earlier frame
    Direction here, facing, target = { 0, 0, 0 };  // in this one
    Kind kind = HIDDEN;
  };

  void matchPoints(double reach)
  {
    std::array<Matrix, BODY_PARTS> turns;
    for (int part = 0; part < BODY_PARTS; ++part)
    {
      turns[part] = now_.turned(before_, part);
    }
    counts_ = {};
    for (Held& held : points_)
    {
      const Matrix& turn = turns[held.where.part];
      held.here = held.where.on(now_.places) + turn * held.offset;
      held.facing = turn * held.normal;
      held.kind = kindOf(held, reach);
      ++counts_[held.where.part][held.kind];
    }
  }

  Kind kindOf(Held& held, double reach) const
  {
    int row, column;
    if (!grid_.pixel(held.here, row, column) || !(grid_.at(row, column) > 0))
    {
      return HIDDEN;
    }
    const double behind = grid_.at(row, column) - held.here.z;
    if (behind < -constants_.agreement)
    {
      return HIDDEN;
    }
    const Kind kind = behind <= constants_.agreement ? ON : nearest(held, row, column, reach);
    if (kind == ON)
    {
      held.target = grid_.point(row, column);
    }
    if (kind == LOST || others_.empty())
    {
      return kind;
    }
    Attachment where;
    return nearerToOthers(held.target, expected_.distance(held.target, where), others_) ? HIDDEN : kind;
  }

  /** The background is seen where the point should be: look for the nearest surface around. */
  Kind nearest(Held& held, int row, int column, double reach) const
  {
    const int cells = std::clamp(static_cast<int>(reach / (grid_.cell() * held.here.z)), 1, MOST_CELLS);
    const int step = std::max(1, cells / 5);
    double least = reach * reach;
    Kind kind = LOST;
    for (int v = row - cells; v <= row + cells; v += step)
    {
      for (int u = column - cells; u <= column + cells; u += step)
      {
        if (v < 0 || u < 0 || v >= grid_.height || u >= grid_.width || !(grid_.at(v, u) > 0))
        {
          continue;
        }
        const Direction off = grid_.point(v, u) - held.here;
        const double square = dot(off, off);
        if (square < least)
        {
          least = square;
          held.target = grid_.point(v, u);
          kind = BESIDE;
        }
      }
    }
    return kind;
  }

  void addPrior(double share)
  {
    for (int i = 0; i < BODY_PLACES; ++i)
    {
      const Direction pull = prior_.information[i] * (prior_.mean[i] - now_.places[i]);
      const double values[3] = { pull.x, pull.y, pull.z };
      for (int a = 0; a < 3; ++a)
      {
        system_.right[3 * i + a] += share * values[a];
        for (int b = 0; b < 3; ++b)
        {
          system_.at(3 * i + a, 3 * i + b) += share * prior_.information[i][3 * a + b];
        }
      }
    }
  }

  void addBones()
  {
    for (const auto& bone : FIXED_LENGTHS)
    {
      const Direction along = now_.places[bone[1]] - now_.places[bone[0]];
      const double length = std::sqrt(dot(along, along));
      if (length > LEAST_LENGTH)
      {
        const double wanted = distanceBetween(before_.places[bone[0]], before_.places[bone[1]]);
        // the neck bends
        const double error = (bone[0] == HEAD_PLACE ? 2 : 1) * constants_.bone_error;
        const Attachment ends = { 0, 2, { bone[0], bone[1] }, { -1, 1 } };
        system_.add(ends, along * (1 / length), wanted - length, 1 / (error * error));
      }
    }
  }

  void addPoints()
  {
    for (const Held& held : points_)
    {
      if (held.kind != ON && held.kind != BESIDE)
      {
        continue;
      }
      const Direction off = held.target - held.here;
      const double parts = held.where.part == TRUNK_PART ? 2 : 1, most = parts * constants_.independent / (1 + held.kind);
      const double share = std::min(1.0, most / counts_[held.where.part][held.kind]);
      if (held.kind == ON)
      {
        const double residual = dot(held.facing, off), ratio = residual / constants_.outlier;
        const double robust = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
        system_.add(held.where, held.facing, residual,
                    share * robust / (constants_.surface_error * constants_.surface_error));
      }
      else
      {
        const double distance = std::max(std::sqrt(dot(off, off)), LEAST_LENGTH);
        system_.add(held.where, off * (1 / distance), distance,
                    share / (constants_.edge_error * constants_.edge_error));
      }
    }
  }

  /** Move all places alike. */
  void moveAll()
  {
    Matrix sum = {};
    std::array<double, 3> right = {};
    for (int row = 0; row < SIZE; ++row)
    {
      right[row % 3] += system_.right[row];
      for (int column = 0; column < SIZE; ++column)
      {
        sum[3 * (row % 3) + column % 3] += system_.at(row, column);
      }
    }
    const Direction step = inverse(sum) * at(right.data());
    for (Direction& place : now_.places)
    {
      place = place + step;
    }
  }

  static constexpr int MOST_CELLS = 25;
  const Constants::Registration& constants_;
  const Grid& grid_;
  const Body& before_;
  const Prior& prior_;
  const std::vector<Body>& others_;
  const Body expected_;
  Body now_;
  std::vector<Held> points_;
  std::array<std::array<int, 4>, BODY_PARTS> counts_ = {};
  System system_;
};
}  // namespace

py::tuple sampleSurface(const Constants& method, const DepthGrid& depths, const Doubles& places, const Flags& usable,
                        const Doubles& others, const Doubles& radii)
{
  const Constants::Registration& constants = method.registration;
  const Grid grid(depths);
  const double* radius = checked(radii, "radii", { BODY_PLACES });
  const Body body(placesAt(checked(places, "places", { BODY_PLACES, 3 })), radius);
  const bool* use = checked(usable, "usable", { BODY_PARTS });
  const std::vector<Body> rest = bodiesOf(others, radius);
  std::array<std::vector<Sample>, BODY_PARTS> found;
  Attachment where;
  for (int row = 0; row < grid.height; row += 2)
  {
    for (int column = 0; column < grid.width; column += 2)
    {
      const Direction point = grid.point(row, column);
      const double away = body.near(point, ROUND) ? body.distance(point, where) : constants.thickness;
      if (away < constants.thickness && use[where.part] && !nearerToOthers(point, away, rest))
      {
        found[where.part].push_back({ point, normalAt(grid, row, column, where, body.places) });
      }
    }
  }
  std::vector<double> points, normals;
  std::vector<Index> parts;
  for (int part = 0; part < BODY_PARTS; ++part)
  {
    const std::size_t count = found[part].size(), most = constants.most_points * (part == TRUNK_PART ? 2 : 1);
    const std::size_t kept = std::min(count, most);
    for (std::size_t i = 0; i < kept; ++i)
    {
      const Sample& sample = found[part][(2 * i + 1) * count / (2 * kept)];
      points.insert(points.end(), { sample.point.x, sample.point.y, sample.point.z });
      normals.insert(normals.end(), { sample.normal.x, sample.normal.y, sample.normal.z });
      parts.push_back(part);
    }
  }
  const py::ssize_t count = parts.size();
  return py::make_tuple(Doubles({ count, py::ssize_t(3) }, points.data()),
                        Doubles({ count, py::ssize_t(3) }, normals.data()), Integers(count, parts.data()));
}

py::tuple registerSurface(const Constants& method, const DepthGrid& depths, const SurfaceArrays& surface,
                          const Doubles& before, const std::tuple<Doubles, Doubles>& expected, const Doubles& others,
                          const Doubles& radii)
{
  const Grid grid(depths);
  const double* radius = checked(radii, "radii", { BODY_PLACES });
  const Body body(placesAt(checked(before, "before", { BODY_PLACES, 3 })), radius);
  const std::vector<Body> rest = bodiesOf(others, radius);
  Prior prior{ placesAt(checked(std::get<0>(expected), "places", { BODY_PLACES, 3 })), {} };
  const double* covariance = checked(std::get<1>(expected), "covariance", { BODY_PLACES, 3, 3 });
  for (int i = 0; i < BODY_PLACES; ++i)
  {
    prior.information[i] = inverse(matrixAt(covariance + 9 * i));
  }
  const py::ssize_t count = countOf(std::get<0>(surface));
  const double* points = checked(std::get<0>(surface), "points", { count, 3 });
  const double* normals = checked(std::get<1>(surface), "normals", { count, 3 });
  const Index* parts = checked(std::get<2>(surface), "parts", { count });
  checkWithin(parts, count, BODY_PARTS, "parts");
  Registration registration(method, grid, body, prior, rest);
  for (py::ssize_t i = 0; i < count; ++i)
  {
    registration.attach(at(points + 3 * i), at(normals + 3 * i), static_cast<int>(parts[i]));
  }
  Doubles places({ BODY_PLACES, 3 }), covariances({ BODY_PLACES, 3, 3 });
  std::array<double, 2> fit = { 0, 0 };
  if (registration.run())
  {
    registration.covariances(covariances.mutable_data());
    fit = registration.fit();
  }
  for (int i = 0; i < BODY_PLACES; ++i)
  {
    store(registration.places()[i], places.mutable_data() + 3 * i);
  }
  return py::make_tuple(places, covariances, fit);
}
}  // namespace skeleton_extract_3d
