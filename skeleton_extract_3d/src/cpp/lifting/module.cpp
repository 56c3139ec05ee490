/**
 * The module skeleton_extract_3d_lifting: compiled twins of hot functions of the Python modules of skeleton_extract_3d,
 * each in the file with the Python module's name. Those explain what is done and why; they are the reference, and every
 * constant comes from them.
 *
 * Operations have the reference's precision and mostly its order; sums of many numbers are added up in another one, and
 * exponentials and logarithms may differ in the last bit. NaN means missing, so no -ffast-math.
 */
#include <pybind11/pybind11.h>

#include "bindings.h"

PYBIND11_MODULE(skeleton_extract_3d_lifting, module)
{
  using namespace skeleton_extract_3d;
  module.doc() = "Compiled twins of functions of skeleton_extract_3d, of the same names: the arguments of those, then "
                 "the constants of their modules.";
  bindBodyMeasures(module);
  bindBoneConstraints(module);
  bindCamera(module);
  bindDepthInference(module);
  bindHeadPose(module);
  bindIdentity(module);
  bindJointFilter(module);
  bindOccluders(module);
  bindPoseLifting(module);
  bindSurfaces(module);
}
