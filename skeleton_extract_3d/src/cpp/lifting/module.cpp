/**
 * The module skeleton_extract_3d_lifting: the steps of the 3D method whose loops take at least 0.1 ms per frame longer
 * in NumPy at five people. Each is explained where Python calls it. NaN means missing, so no -ffast-math.
 */
#include "steps.h"

PYBIND11_MODULE(skeleton_extract_3d_lifting, module)
{
  using namespace skeleton_extract_3d;
  module.doc() = "Compiled steps of skeleton_extract_3d.";
  py::class_<Constants>(module, "Method", "The compiled steps, see steps.h, with the constants of a MethodConstants.")
      .def(py::init<const py::object&>())
      .def("root_evidence", &rootEvidence)
      .def("depth_costs", &depthCosts)
      .def("others_depths", &othersDepths)
      .def("covered_by_self", &coveredBySelf)
      .def("measure", &measure)
      .def("estimate_head_pose", &estimateHeadPose)
      .def("infer_depths", &inferDepths)
      .def("read_depths", &readDepths)
      .def("with_frame", &withFrame)
      .def("satisfy_lengths", &satisfyLengths)
      .def("sample_surface", &sampleSurface)
      .def("register_surface", &registerSurface)
      .def("complete", &complete)
      .def("correct", &correct);
}
