/** What shows the twins of each Python module to Python. */
#pragma once

#include <pybind11/pybind11.h>

namespace skeleton_extract_3d
{
void bindBodyMeasures(pybind11::module& module);
void bindBoneConstraints(pybind11::module& module);
void bindCamera(pybind11::module& module);
void bindDepthInference(pybind11::module& module);
void bindHeadPose(pybind11::module& module);
void bindIdentity(pybind11::module& module);
void bindJointFilter(pybind11::module& module);
void bindOccluders(pybind11::module& module);
void bindPoseLifting(pybind11::module& module);
void bindSurfaces(pybind11::module& module);
}  // namespace skeleton_extract_3d
