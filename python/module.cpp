// limber._limber: the library's interface for Python, arrays in numpy. What users see is limber/__init__.py.
#include "python/module.h"

#include <exception>

#include "limber/limber.h"

namespace py = pybind11;

PYBIND11_MODULE(_limber, m) {
  m.attr("__version__") = limber::library_version();
  static py::exception<limber::InternalError> internal_error(m, "InternalError", PyExc_RuntimeError);
  py::register_exception<limber::InputError>(m, "InputError", PyExc_ValueError);
  py::register_exception<limber::DiskError>(m, "DiskError", PyExc_OSError);
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const limber::InternalError& error) {
      internal_error(error.what());
    } catch (const limber::Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
  limber_python::add_meshes(m);
  limber_python::add_scenes(m);
  limber_python::add_work_folders(m);
}
