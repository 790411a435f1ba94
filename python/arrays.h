// Arrays between numpy and the library. What comes in is copied and checked; what goes out is a read-only
// view of numbers that the library's object, or the array, keeps.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "limber/limber.h"

namespace limber_python {

namespace py = pybind11;

// Rows of what the caller gave; a copy.
template <class T, std::size_t columns>
std::vector<std::array<T, columns>> rows_of(const py::handle& given, const char* what) {
  constexpr bool is_index = std::is_integral_v<T>;
  const py::array any = py::array::ensure(given);
  if (!any) {
    PyErr_Clear();
    throw limber::InputError(std::string(what) + ": is no array");
  }
  const char kind = any.dtype().kind();
  if (is_index ? kind != 'i' && kind != 'u' : kind != 'f' && kind != 'i' && kind != 'u')
    throw limber::InputError(std::string(what) + ": its numbers are of the type " +
                             py::str(py::object(any.dtype())).cast<std::string>() + "; give " +
                             (is_index ? "integers" : "numbers"));
  if (any.ndim() != 2 || any.shape(1) != py::ssize_t(columns))
    throw limber::InputError(std::string(what) + ": has the shape " +
                             py::str(any.attr("shape")).cast<std::string>() + "; it must be (n, " +
                             std::to_string(columns) + ")");
  using Wide = std::conditional_t<is_index, std::int64_t, T>;
  const auto wide = py::array_t<Wide, py::array::c_style | py::array::forcecast>::ensure(any);
  if (!wide) throw py::error_already_set();
  std::vector<std::array<T, columns>> rows(std::size_t(wide.shape(0)));
  const Wide* from = wide.data();
  for (auto& row : rows)
    for (T& x : row) {
      if constexpr (is_index)
        if (*from < std::numeric_limits<T>::min() || *from > std::numeric_limits<T>::max())
          throw limber::InputError(std::string(what) + ": the index " + std::to_string(*from) +
                                   " is too large");
      x = T(*from++);
    }
  return rows;
}

inline limber::Mesh mesh_of(const py::handle& vertices, const py::handle& faces) {
  return {rows_of<double, 3>(vertices, "vertices"), rows_of<int, 3>(faces, "faces")};
}

template <class T>
py::array read_only(py::array_t<T> array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

// A view of numbers that `owner` keeps.
template <class T>
py::array view(const T* data, std::vector<py::ssize_t> shape, const py::object& owner) {
  return read_only(py::array_t<T>(std::move(shape), data, owner));
}
template <class T, std::size_t columns>
py::array view(const std::vector<std::array<T, columns>>& rows, const py::object& owner) {
  return view(reinterpret_cast<const T*>(rows.data()), {py::ssize_t(rows.size()), py::ssize_t(columns)},
              owner);
}
template <class T>
py::array view(const std::vector<T>& row, const py::object& owner) {
  return view(row.data(), {py::ssize_t(row.size())}, owner);
}

// Numbers that the array owns.
template <class Numbers>
py::array owned(Numbers numbers) {
  auto* kept = new Numbers(std::move(numbers));
  const py::capsule owner(kept, [](void* p) { delete static_cast<Numbers*>(p); });
  return view(*kept, owner);
}
inline py::array owned(std::vector<float> numbers, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<float>(std::move(numbers));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<float>*>(p); });
  return view(kept->data(), std::move(shape), owner);
}

inline py::list pairs_of(const std::vector<limber::Mesh>& hulls) {
  py::list list;
  for (const limber::Mesh& hull : hulls) list.append(py::make_tuple(owned(hull.vertices), owned(hull.faces)));
  return list;
}

}  // namespace limber_python
