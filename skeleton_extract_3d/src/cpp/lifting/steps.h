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
/** Depths (h, w) [m], not positive or not finite where missing, and the affine map (2, 3) from column, row, 1 to x and y of the ray. */
using DepthGrid = std::tuple<Floats, Doubles>;
/** Points (N, 3) [m], normals (N, 3) and parts (N,) of registration.cpp. */
using SurfaceArrays = std::tuple<Doubles, Doubles, Integers>;

// surfaces.cpp
/**
 * Log likelihood of the depths of each person's trunk given the surfaces, (P, depths): sum over the joints of
 * log(near + front + behind + floor) of the weights of the samples (P, 18, 25) on a body there, before and behind it.
 */
py::array_t<double> rootEvidence(const Constants& method, const Doubles& samples, const Doubles& scores,
                                 const std::optional<Flags>& foreign);
/**
 * Costs of each joint at depths root + CostConstants.deltas, (P, 18, steps): -2 log likelihoods, the least of each joint
 * being 0; all are 0 without a keypoint or samples. root: depth of the trunk [m]; offsets: depths of joints under their
 * surface; gaps: how much further in front a surface hides them [m]; own, covered: see occluders.ownership.
 */
py::array_t<float> depthCosts(const Constants& method, const Doubles& samples, const Doubles& scores,
                              const Doubles& root, const Doubles& offsets, const Doubles& gaps, const Doubles& own,
                              const Flags& covered, const std::optional<Flags>& foreign);
// occluders.cpp
/**
 * Depths of the bodies of other people, cylinders of `BodyConstants.parts`, at the keypoints (P, 18, 2) [px] of each
 * person, (P, 18, P) [m]; infinite where the body of the last axis is not at that pixel, or is the same person.
 */
py::array_t<double> othersDepths(const Constants& method, const Doubles& uv, const Doubles& joint_depths, double focal);
/** Which joints (P, 18) lie on another part of the same body; root: (P,) depth of the trunk [m]. */
py::array_t<bool> coveredBySelf(const Constants& method, const Doubles& uv, const Doubles& root, double focal);
// measuring.cpp
py::tuple measure(const Constants& method, const SeenArrays& seen, const Doubles& z, const Doubles& offsets,
                  const std::optional<Flags>& foreign, const Floats& lengths);
// head_pose.cpp
/**
 * Fit rigid heads to their keypoints, seen from afar: least squares for the place and for cosine and sine of the yaw;
 * see HeadPose. rays: (P, 18, 3) with z = 1, NaN where unknown; shoulder_cosine: (P,) of their yaw, 1 faces the camera.
 */
py::tuple estimateHeadPose(const Constants& method, const Doubles& rays, const Doubles& scores, const Doubles& root,
                           const Doubles& scale, const Doubles& shoulder_cosine);
// depth_inference.cpp
/**
 * Min-marginals of the depths of the thirteen places of robust.py, (P, 13, steps), and unit vectors to the
 * left of the people, (P, 3). costs: of the places alone; rays: z = 1, a guess for joints without a keypoint; root:
 * depth of the trunk [m]; left_before: as long as its weight, NaN where unknown.
 */
py::tuple inferDepths(const Constants& method, const Floats& costs, const Floats& rays, const Doubles& root,
                      const Floats& lengths, const Floats& sigmas, const Doubles& stature, const Doubles& left_before);
/** Mean around the cheapest of (..., steps) beliefs and deviation of all of them, from the depth of the trunk [m]. */
py::tuple readDepths(const Constants& method, const Floats& beliefs);
// bones.cpp
py::tuple withFrame(const Constants& method, const std::array<Doubles, 4>& sizes, const Doubles& xyz,
                    const Flags& good);
/**
 * Joints (P, 18, 3) [m] moved towards the lengths of bones, each as far as it is uncertain: a length is one more
 * measurement of both ends of its bone (a Kalman update), bone after bone from the trunk outwards. lengths [m] and
 * spreads, as shares: (P, 8) in the order of body.BONES; usable: joints that take part.
 */
py::array_t<double> satisfyLengths(const Constants& method, const Doubles& xyz, const Doubles& covariance,
                                   const Doubles& lengths, const Doubles& spreads, const Flags& usable);
// registration.cpp
/** Points on a body, SurfaceArrays; usable: (10,) parts, others: (Q, 13, 3) bodies, radii: (13,) [m]. */
py::tuple sampleSurface(const Constants& method, const DepthGrid& depths, const Doubles& places, const Flags& usable,
                        const Doubles& others, const Doubles& radii);
/**
 * Places (13, 3) [m], their covariances (13, 3, 3) and the shares of the points in view that fit, and of all points
 * that are in view; both 0: no solution. before: places when the surface was sampled; expected: places now, and their
 * covariances.
 */
py::tuple registerSurface(const Constants& method, const DepthGrid& depths, const SurfaceArrays& surface,
                          const Doubles& before, const std::tuple<Doubles, Doubles>& expected, const Doubles& others,
                          const Doubles& radii);
// completion.cpp
/**
 * Positions (P, 18, 3) [m], velocities, deviations (P, 18) [m] of people, and which joints are placed, (P, 18), with
 * joints placed by the others that are not yet. joints: these before; before: joints (P, 18) that had a place, and their
 * times without a keypoint [s]; trunks: left and down (P, 3), stature (P,) in statures of an adult; elapsed: since the
 * frame before [s]; timeout: greatest time without a keypoint [s].
 */
py::tuple complete(const Constants& method, const std::tuple<Doubles, Doubles, Doubles, Flags>& joints,
                   const std::tuple<Flags, Doubles>& before, const std::tuple<Doubles, Doubles, Doubles>& trunks,
                   double elapsed, double timeout);
// joint_filter.cpp
py::tuple correct(const Constants& method, const FilterArrays& state, const Doubles& measured, const Doubles& covariance,
                  const Flags& mask);
}  // namespace skeleton_extract_3d
