/** The compiled steps of module.cpp, with the constants of the method as their first argument. */
#pragma once

#include <array>
#include <optional>
#include <tuple>

#include "arrays.h"
#include "constants.h"

namespace skeleton_extract_3d
{
/** Rays, scores, known and samples of ObservedPeople. */
using SeenArrays = std::tuple<Doubles, Doubles, Flags, Doubles>;
using FilterArrays = std::array<Doubles, 5>;

// surfaces.cpp
py::array_t<double> rootEvidence(const Constants& method, const Doubles& samples, const Doubles& scores,
                                 const std::optional<Flags>& foreign);
py::array_t<float> depthCosts(const Constants& method, const Doubles& samples, const Doubles& scores,
                              const Doubles& root, const Doubles& offsets, const Doubles& gaps, const Doubles& own,
                              const Flags& covered, const std::optional<Flags>& foreign);
// occluders.cpp
py::array_t<double> othersDepths(const Constants& method, const Doubles& uv, const Doubles& joint_depths, double focal);
py::array_t<bool> coveredBySelf(const Constants& method, const Doubles& uv, const Doubles& root, double focal);
// measuring.cpp
py::tuple measure(const Constants& method, const SeenArrays& seen, const Doubles& z, const Doubles& offsets,
                  const Doubles& own, const std::optional<Flags>& foreign, const Floats& lengths);
// head_pose.cpp
py::tuple estimateHeadPose(const Constants& method, const Doubles& rays, const Doubles& scores, const Doubles& root,
                           const Doubles& scale, const Doubles& shoulder_cosine);
// depth_inference.cpp
py::tuple inferDepths(const Constants& method, const Floats& costs, const Floats& rays, const Doubles& root,
                      const Floats& lengths, const Floats& sigmas, const Doubles& stature, const Doubles& left_before);
py::tuple readDepths(const Constants& method, const Floats& beliefs);
// bones.cpp
py::tuple withFrame(const Constants& method, const std::array<Doubles, 4>& sizes, const Doubles& xyz,
                    const Flags& good);
py::array_t<double> satisfyLengths(const Constants& method, const Doubles& xyz, const Doubles& covariance,
                                   const Doubles& lengths, const Doubles& spreads, const Flags& usable);
// camera.cpp
std::optional<std::array<double, 5>> fitPinhole(const Constants& method, const Doubles& points, const Integers& pixels);
// joint_filter.cpp
py::tuple correct(const Constants& method, const FilterArrays& state, const Doubles& measured, const Doubles& covariance,
                  const Flags& mask);
}  // namespace skeleton_extract_3d
