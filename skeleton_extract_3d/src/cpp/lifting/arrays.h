/** Arrays of Python: their types, and their data. Shapes are those that Python gives, see steps.h. */
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace py = pybind11;

namespace skeleton_extract_3d
{
template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;
using Floats = Array<float>;
using Doubles = Array<double>;
using Integers = Array<std::int64_t>;
using Flags = Array<bool>;

using Shape = std::vector<py::ssize_t>;

/** Return the data of an array that may be missing, or null. */
template <typename T>
const T* dataOf(const std::optional<Array<T>>& array)
{
  return array ? array->data() : nullptr;
}

template <typename T>
py::array_t<T> copyOf(const Array<T>& array)
{
  py::array_t<T> result(Shape(array.shape(), array.shape() + array.ndim()));
  std::copy_n(array.data(), array.size(), result.mutable_data());
  return result;
}

/** Return the size of the first axis: people, tracks or rows. */
inline py::ssize_t countOf(const py::array& array)
{
  return array.ndim() > 0 ? array.shape(0) : 0;
}
}  // namespace skeleton_extract_3d
