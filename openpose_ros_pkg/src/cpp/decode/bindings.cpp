/** The interface to Python: arrays in, arrays out. */
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "types.h"

namespace py = pybind11;

namespace openpose_ros_decode
{
namespace
{
template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/** Read the settings from instances of DecodeParams and DecodeConstants. */
Settings asSettings(const py::object& params, const py::object& constants)
{
  const auto count = [&](const char* name) { return constants.attr(name).cast<int>(); };
  const auto constant = [&](const char* name) { return constants.attr(name).cast<double>(); };
  return { count("peaks_per_joint"),
           count("peaks"),
           count("limb_samples"),
           static_cast<float>(constant("sample_threshold")),
           constant("limb_support"),
           count("person_joints"),
           params.attr("person_min_score").cast<double>(),
           constant("foreshortened_limb"),
           constant("long_limb"),
           static_cast<float>(constant("peak_weight")) };
}

Maps asMaps(const Array<float>& array)
{
  const auto maps = array.unchecked<3>();  // throws unless there are three axes
  return { array.data(), static_cast<int>(maps.shape(0)), static_cast<int>(maps.shape(1)),
           static_cast<int>(maps.shape(2)) };
}

template <typename T>
std::vector<T> asVector(const Array<T>& array)
{
  return std::vector<T>(array.data(), array.data() + array.size());
}

/** Refuse records of Python with an index that is not there: the steps read their memory by these. */
void checkIndices(bool right, const char* what)
{
  if (!right)
  {
    throw std::invalid_argument(std::string(what) + " that is not there");
  }
}

bool isIndex(long index, std::size_t count)
{
  return index >= 0 && static_cast<std::size_t>(index) < count;
}

void checkPeaks(const std::vector<Peak>& peaks, int joints)
{
  checkIndices(joints >= 0, "a negative number of joints names a joint");
  checkIndices(std::all_of(peaks.begin(), peaks.end(),
                           [=](const Peak& peak) { return isIndex(peak.joint, joints); }),
               "a peak names a joint");
}

void checkLimbs(const std::vector<Limb>& limbs, int joints)
{
  checkIndices(std::all_of(limbs.begin(), limbs.end(),
                           [=](const Limb& limb) { return isIndex(limb.start, joints) && isIndex(limb.end, joints); }),
               "a limb names a joint");
}

template <typename T>
py::array_t<T> asArray(const std::vector<T>& values)
{
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/** Compute while other threads of Python run. */
template <typename Compute>
auto withoutLock(const Compute& compute)
{
  py::gil_scoped_release release;
  return compute();
}

py::array_t<Peak> findPeaksOf(const Array<float>& maps, double scale, double max_x, double max_y, float threshold,
                              const Settings& settings)
{
  const Maps framed = asMaps(maps);
  return asArray(withoutLock([&] { return findPeaks(framed, scale, max_x, max_y, threshold, settings); }));
}

py::array_t<LimbCandidate> scoreLimbsOf(const Array<float>& pafs, const Array<Peak>& peaks, int joints,
                                        const Array<Limb>& limbs, float stride, const Settings& settings)
{
  const Maps fields = asMaps(pafs);
  const auto ends = asVector(peaks);
  const auto kinds = asVector(limbs);
  checkPeaks(ends, joints);
  checkLimbs(kinds, joints);
  checkIndices(std::is_sorted(ends.begin(), ends.end(), [](const Peak& a, const Peak& b) { return a.joint < b.joint; }),
               "peaks that are not sorted by joint name a place");
  checkIndices(std::all_of(kinds.begin(), kinds.end(),
                           [&](const Limb& limb) {
                             return isIndex(limb.paf_x, fields.count) && isIndex(limb.paf_y, fields.count);
                           }) &&
                   (kinds.empty() || (fields.height > 0 && fields.width > 0)),
               "a limb names a channel");
  return asArray(withoutLock([&] { return scoreLimbs(fields, ends, joints, kinds, stride, settings); }));
}

py::tuple assembleOf(const Array<LimbCandidate>& candidates, const Array<Peak>& peaks, int joints,
                     const Array<Limb>& limbs, const Settings& settings)
{
  const auto ends = asVector(peaks);
  const auto kinds = asVector(limbs);
  const auto pairs = asVector(candidates);
  checkPeaks(ends, joints);
  checkLimbs(kinds, joints);
  checkIndices(std::all_of(pairs.begin(), pairs.end(),
                           [&](const LimbCandidate& pair) {
                             return isIndex(pair.limb, kinds.size()) && isIndex(pair.start, ends.size()) &&
                                    isIndex(pair.end, ends.size());
                           }),
               "a candidate names a limb or a peak");
  const auto people = assemble(pairs, ends, joints, kinds, settings);
  py::array_t<int> peak_of_joint({ people.size(), static_cast<std::size_t>(joints) });
  py::array_t<double> scores(static_cast<py::ssize_t>(people.size()));
  for (std::size_t i = 0; i < people.size(); ++i)
  {
    scores.mutable_at(i) = people[i].score;
    std::copy_n(people[i].peak_of_joint.begin(), joints, peak_of_joint.mutable_data(i, 0));
  }
  return py::make_tuple(peak_of_joint, scores);
}
}  // namespace
}  // namespace openpose_ros_decode

PYBIND11_MODULE(openpose_ros_decode, module)
{
  using namespace openpose_ros_decode;
  module.doc() = "Steps of the decoder of part affinity fields; openpose_ros_pkg.decode.paf explains them.";
  PYBIND11_NUMPY_DTYPE(Limb, start, end, paf_x, paf_y, starts_person);
  PYBIND11_NUMPY_DTYPE(Peak, joint, x, y, score);
  PYBIND11_NUMPY_DTYPE(LimbCandidate, limb, start, end, score);
  module.attr("LIMB") = py::dtype::of<Limb>();
  module.attr("PEAK") = py::dtype::of<Peak>();
  module.attr("LIMB_CANDIDATE") = py::dtype::of<LimbCandidate>();
  py::class_<Settings>(module, "Settings").def(py::init(&asSettings), py::arg("params"), py::arg("constants"));
  module.def("find_peaks", &findPeaksOf, py::arg("maps"), py::arg("scale"), py::arg("max_x"), py::arg("max_y"),
             py::arg("threshold"), py::arg("settings"));
  module.def("score_limbs", &scoreLimbsOf, py::arg("pafs"), py::arg("peaks"), py::arg("joints"), py::arg("limbs"),
             py::arg("stride"), py::arg("settings"));
  module.def("assemble", &assembleOf, py::arg("candidates"), py::arg("peaks"), py::arg("joints"), py::arg("limbs"),
             py::arg("settings"));
}
