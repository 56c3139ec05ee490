/**
 * The module skeleton_extract_3d_lifting: the steps of the 3D method whose loops take at least 0.1 ms per frame longer
 * in NumPy at five people. Each is explained where Python calls it. NaN means missing, so no -ffast-math.
 */
#include "steps.h"

PYBIND11_MODULE(skeleton_extract_3d_lifting, module)
{
  using namespace skeleton_extract_3d;
  module.doc() = "Compiled steps of skeleton_extract_3d.";
  const auto arg = [](const char* name) { return py::arg(name); };
  py::class_<Constants>(module, "Method", "The compiled steps, with the constants of a MethodConstants.")
      .def(py::init<const py::object&>(), arg("constants"))
      .def("root_evidence", &rootEvidence, "See surfaces.root_evidence.", arg("samples"), arg("scores"),
           arg("foreign"))
      .def("depth_costs", &depthCosts, "See surfaces.depth_costs.", arg("samples"), arg("scores"), arg("root"),
           arg("offsets"), arg("gaps"), arg("own"), arg("covered"), arg("foreign"))
      .def("others_depths", &othersDepths, "See occluders.others_depths.", arg("uv"), arg("joint_depths"),
           arg("focal"))
      .def("covered_by_self", &coveredBySelf, "See occluders.covered_by_self.", arg("uv"), arg("root"), arg("focal"))
      .def("measure", &measure, "See robust.lift_together.", arg("seen"), arg("z"), arg("offsets"), arg("own"),
           arg("foreign"), arg("lengths"))
      .def("estimate_head_pose", &estimateHeadPose, "See head_pose.estimate_head_pose.", arg("rays"), arg("scores"),
           arg("root"), arg("scale"), arg("shoulder_cosine"))
      .def("infer_depths", &inferDepths, "See depth_inference.infer_depths.", arg("costs"), arg("rays"), arg("root"),
           arg("lengths"), arg("sigmas"), arg("stature"), arg("left_before"))
      .def("read_depths", &readDepths, "See depth_inference.read_depths.", arg("beliefs"))
      .def("with_frame", &withFrame, "See measures.with_frame.", arg("sizes"), arg("xyz"), arg("good"))
      .def("satisfy_lengths", &satisfyLengths, "See bone_constraints.satisfy_lengths.", arg("xyz"), arg("covariance"),
           arg("lengths"), arg("spreads"), arg("usable"))
      .def("fit_pinhole", &fitPinhole, "See camera.fitted_camera.", arg("points"), arg("pixels"))
      .def("correct", &correct, "See joint_filter.JointFilter.correct.", arg("state"), arg("measured"),
           arg("covariance"), arg("mask"));
}
