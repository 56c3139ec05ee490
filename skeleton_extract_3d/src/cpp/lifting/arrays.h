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

namespace py = pybind11;

namespace skeleton_extract_3d
{
template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;
using Floats = Array<float>;
using Doubles = Array<double>;
using Integers = Array<std::int64_t>;
using Flags = Array<bool>;

/** Return the data of an array that must have a shape. */
template <typename T>
const T* checked(const Array<T>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim()))
  {
    const auto text = [](const py::ssize_t* begin, const py::ssize_t* end) {
      std::string result = "(";
      for (const py::ssize_t* size = begin; size != end; ++size)
      {
        result += (size == begin ? "" : ", ") + std::to_string(*size);
      }
      return result + ")";
    };
    throw std::invalid_argument(std::string(name) + " must have shape " + text(shape.begin(), shape.end()) + ", got " +
                                text(array.shape(), array.shape() + array.ndim()));
  }
  return array.data();
}

template <typename T>
const T* checked(const std::optional<Array<T>>& array, const char* name, std::initializer_list<py::ssize_t> shape)
{
  return array ? checked(*array, name, shape) : nullptr;
}

/** Return the size of an axis of an array with a number of axes. */
template <typename T>
py::ssize_t sizeOf(const Array<T>& array, const char* name, py::ssize_t axes, py::ssize_t axis)
{
  if (array.ndim() != axes)
  {
    throw std::invalid_argument(std::string(name) + " must have " + std::to_string(axes) + " dimensions, got " +
                                std::to_string(array.ndim()));
  }
  return array.shape(axis);
}

inline void checkWithin(const std::int64_t* values, py::ssize_t count, std::int64_t end, const char* name)
{
  if (!std::all_of(values, values + count, [end](std::int64_t value) { return value >= 0 && value < end; }))
  {
    throw std::invalid_argument(std::string(name) + " must lie in 0.." + std::to_string(end - 1));
  }
}

/** Return the number of parts, after a look at their ends. */
inline py::ssize_t partCount(const Integers& parts, py::ssize_t joints)
{
  const py::ssize_t count = sizeOf(parts, "parts", 2, 0);
  checkWithin(checked(parts, "parts", { count, 2 }), 2 * count, joints, "parts");
  return count;
}
}  // namespace skeleton_extract_3d
