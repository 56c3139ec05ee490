/** Arrays of Python: their types, and checks of their shapes and numbers. */
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
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

/** Return the data of an array that must have a shape. */
template <typename T>
const T* checked(const Array<T>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim()))
  {
    const py::str sizes = py::str("{}, got {}").format(py::tuple(py::cast(Shape(shape))), array.attr("shape"));
    throw std::invalid_argument(std::string(name) + " must have shape " + std::string(sizes));
  }
  return array.data();
}

/** Return the data of an array that may be missing, or null. */
template <typename T>
const T* checked(const std::optional<Array<T>>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  return array ? checked(*array, name, shape) : nullptr;
}

/** Return a copy of an array that must have a shape. */
template <typename T>
py::array_t<T> copyOf(const Array<T>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  py::array_t<T> result{ Shape(shape) };
  std::copy_n(checked(array, name, shape), array.size(), result.mutable_data());
  return result;
}

/** Return the size of the first axis: people, tracks or rows. */
inline py::ssize_t countOf(const py::array& array)
{
  return array.ndim() > 0 ? array.shape(0) : 0;
}

inline void checkWithin(const std::int64_t* values, std::size_t count, std::int64_t end, const char* name)
{
  if (!std::all_of(values, values + count, [end](std::int64_t value) { return value >= 0 && value < end; }))
  {
    throw std::invalid_argument(std::string(name) + " must lie in 0.." + std::to_string(end - 1));
  }
}
}  // namespace skeleton_extract_3d
