// limber._limber: the library's interface for Python, arrays in numpy. What users see is limber/__init__.py.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <limits>
#include <mutex>
#include <thread>

#include "limber/limber.h"

namespace py = pybind11;
using namespace py::literals;

namespace {

// ---- Calls that take long
// ----------------------------------------------------------------------------------

// Hears what a call tells, and hands it to Python.
class PythonWatcher final : public limber::Watcher {
 public:
  explicit PythonWatcher(py::object progress) : progress_(std::move(progress)) {}

  void progress(const std::string& stage, std::int64_t done, std::int64_t total,
                const std::string& note) override {
    if (stop_ || progress_.is_none()) return;
    const py::gil_scoped_acquire gil;
    try {
      progress_(stage, done, total, note);
    } catch (py::error_already_set& error) {
      keep(error);
    }
  }
  void warn(const std::string& text) override { warnings_.push_back(text); }
  bool stop() override { return stop_; }

  // Needs the GIL. What Python raised; the call is to end.
  void keep(py::error_already_set& error) {
    if (!raised_) raised_.emplace(error);
    stop_ = true;
  }
  // Needs the GIL, when the call has ended.
  void tell_warnings() const {
    for (const std::string& text : warnings_)
      if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 2) != 0) throw py::error_already_set();
  }
  bool has_raised() const { return raised_.has_value(); }
  void raise_what_was_raised() {
    if (raised_) throw *raised_;
  }

 private:
  py::object progress_;
  std::vector<std::string> warnings_;
  std::atomic<bool> stop_{false};
  std::optional<py::error_already_set> raised_;
};

// Works in a thread of its own, without the GIL, while this one listens for Ctrl-C. `keep` is called with
// what there is, where a call ends by what Python raised and still has a result.
template <class F>
auto call(const py::object& progress, int threads, F&& work, const py::object& keep = py::none()) {
  using Result = decltype(work(limber::Context{}));
  PythonWatcher watcher(progress);
  std::optional<Result> result;
  std::exception_ptr failure;
  std::mutex mutex;
  std::condition_variable ended;
  bool has_ended = false;
  std::thread worker([&] {
    try {
      result.emplace(work(limber::Context{&watcher, threads}));
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    has_ended = true;
    ended.notify_one();
  });
  {
    const py::gil_scoped_release no_gil;
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return has_ended; })) {
      lock.unlock();
      {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) {
          py::error_already_set error;
          watcher.keep(error);
        }
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (watcher.has_raised() && result && !keep.is_none()) keep(py::cast(std::move(*result)));
  watcher.raise_what_was_raised();
  if (failure) std::rethrow_exception(failure);
  watcher.tell_warnings();
  return std::move(*result);
}

// ---- Arrays
// ------------------------------------------------------------------------------------------------

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

limber::Mesh mesh_of(const py::handle& vertices, const py::handle& faces) {
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
py::array owned(std::vector<float> numbers, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<float>(std::move(numbers));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<float>*>(p); });
  return view(kept->data(), std::move(shape), owner);
}

py::list pairs_of(const std::vector<limber::Mesh>& hulls) {
  py::list list;
  for (const limber::Mesh& hull : hulls) list.append(py::make_tuple(owned(hull.vertices), owned(hull.faces)));
  return list;
}

// positions (B, N, 3), velocities (B, N, 3), steps (B), sound (B)
py::tuple tuple_of(limber::States states) {
  const std::vector<py::ssize_t> shape{states.count, states.nodes, 3};
  std::vector<bool> sound(states.sound.begin(), states.sound.end());
  py::array_t<bool> is_sound(py::ssize_t(sound.size()));
  for (std::size_t i = 0; i < sound.size(); ++i) is_sound.mutable_at(py::ssize_t(i)) = sound[i];
  return py::make_tuple(owned(std::move(states.positions), shape), owned(std::move(states.velocities), shape),
                        owned(std::move(states.steps)), read_only(std::move(is_sound)));
}

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Steps = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

limber::States states_of(const Floats& positions, const Floats& velocities, const Steps& steps,
                         const Flags& sound) {
  const auto require = [](bool holds, const std::string& text) {
    if (!holds) throw limber::InputError("states: " + text);
  };
  require(positions.ndim() == 3 && positions.shape(2) == 3, "positions must have the shape (b, n, 3)");
  require(velocities.ndim() == 3 && velocities.shape(0) == positions.shape(0) &&
              velocities.shape(1) == positions.shape(1) && velocities.shape(2) == 3,
          "velocities must have the shape of positions");
  require(steps.ndim() == 1 && steps.shape(0) == positions.shape(0), "steps must have the shape (b,)");
  require(sound.ndim() == 1 && sound.shape(0) == positions.shape(0), "sound must have the shape (b,)");
  limber::States states;
  states.count = int(positions.shape(0)), states.nodes = int(positions.shape(1));
  states.positions.assign(positions.data(), positions.data() + positions.size());
  states.velocities.assign(velocities.data(), velocities.data() + velocities.size());
  states.steps.assign(steps.data(), steps.data() + steps.size());
  states.sound.assign(sound.data(), sound.data() + sound.size());
  return states;
}

// As Push has it in memory.
py::dtype push_dtype() {
  const auto field = [](const char* name, const char* format, std::size_t offset) {
    return std::tuple(name, format, offset);
  };
  py::list names, formats, offsets;
  for (const auto& [name, format, offset] :
       {field("kind", "<i4", offsetof(limber::Push, kind)),
        field("force_n", "(3,)<f4", offsetof(limber::Push, force_n)),
        field("node", "<i4", offsetof(limber::Push, node)),
        field("radius_m", "<f4", offsetof(limber::Push, radius_m)),
        field("target_m", "(3,)<f4", offsetof(limber::Push, target_m)),
        field("max_force_n", "<f4", offsetof(limber::Push, max_force_n)),
        field("steps", "<i4", offsetof(limber::Push, steps)),
        field("second_node", "<i4", offsetof(limber::Push, second_node)),
        field("second_force_n", "(3,)<f4", offsetof(limber::Push, second_force_n))}) {
    names.append(name), formats.append(format), offsets.append(offset);
  }
  return py::dtype::from_args(py::dict("names"_a = names, "formats"_a = formats, "offsets"_a = offsets,
                                       "itemsize"_a = sizeof(limber::Push)));
}

std::vector<limber::Push> pushes_of(const py::array& given) {
  if (!given.dtype().equal(push_dtype()) || given.ndim() != 1)
    throw limber::InputError("pushes: must be one row of limber.push_dtype; limber.pushes() makes one");
  const py::array whole = py::module_::import("numpy").attr("ascontiguousarray")(given);
  const auto* first = static_cast<const limber::Push*>(whole.data());
  return {first, first + whole.shape(0)};
}

py::array array_of(const std::vector<limber::Push>& pushes) {
  return py::array(push_dtype(), {py::ssize_t(pushes.size())}, {py::ssize_t(sizeof(limber::Push))},
                   pushes.data());
}

limber::PrepareOptions prepare_options(int shells, double concavity, double threshold, double inflate,
                                       int max_hull_vertices, bool exact, int tets, const std::string& mode) {
  return {shells, concavity, threshold, inflate, max_hull_vertices, exact, tets, mode};
}

}  // namespace

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
  m.attr("push_dtype") = push_dtype();

  // ---- Meshes
  m.def(
      "load_mesh",
      [](const std::filesystem::path& file, double scale, bool y_up, const py::object& progress) {
        limber::ImportedMesh mesh = call(progress, 0, [&](const limber::Context& context) {
          return limber::load_mesh(file, {scale, y_up}, context);
        });
        return py::make_tuple(owned(std::move(mesh.mesh.vertices)), owned(std::move(mesh.mesh.faces)),
                              mesh.mended, mesh.warnings);
      },
      "file"_a, py::kw_only(), "scale"_a, "y_up"_a, "progress"_a);
  m.def(
      "decompose",
      [](const py::object& vertices, const py::object& faces, int max_convex_hull, double threshold,
         double concavity, int max_hull_vertices, double inflate, bool exact, const py::object& progress,
         int threads) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        const limber::Decomposition d = call(progress, threads, [&](const limber::Context& context) {
          return limber::decompose(
              mesh, {max_convex_hull, threshold, concavity, max_hull_vertices, inflate, exact}, context);
        });
        return py::dict("hulls"_a = pairs_of(d.hulls), "neighbours"_a = owned(d.neighbours),
                        "stopped_by"_a = d.stopped_by, "mean_overshoot"_a = d.mean_overshoot,
                        "max_overshoot"_a = d.max_overshoot, "vertices_uncovered"_a = d.vertices_uncovered,
                        "triangles_uncovered"_a = d.triangles_uncovered);
      },
      "vertices"_a, "faces"_a, py::kw_only(), "max_convex_hull"_a, "threshold"_a, "concavity"_a,
      "max_hull_vertices"_a, "inflate"_a, "exact"_a, "progress"_a, "threads"_a);

  py::class_<limber::Certificate>(
      m, "Certificate", "Whether a cage encloses a surface: exact, proved from the two meshes alone.")
      .def_readonly("holds", &limber::Certificate::holds,
                    "every point of every triangle is in the cage, whose boundary is a manifold")
      .def_readonly("vertices_outside", &limber::Certificate::vertices_outside, "of the surface")
      .def_readonly("triangles_crossing", &limber::Certificate::triangles_crossing,
                    "of the surface, that leave the cage")
      .def_readonly("nonmanifold_edges", &limber::Certificate::nonmanifold_edges, "of the cage's boundary")
      .def_readonly("nonmanifold_vertices", &limber::Certificate::nonmanifold_vertices,
                    "of the cage's boundary")
      .def_readonly("inverted_tets", &limber::Certificate::inverted_tets, "tets without a positive volume")
      .def_readonly("min_dihedral_deg", &limber::Certificate::min_dihedral_deg,
                    "smallest dihedral angle of a tet, degrees")
      .def_readonly("max_dihedral_deg", &limber::Certificate::max_dihedral_deg,
                    "largest dihedral angle of a tet, degrees");
  py::class_<limber::Cage>(m, "Cage", "A coarse tetrahedral mesh that encloses a surface.")
      .def(py::init([](const py::object& vertices, const py::object& tets) {
             return limber::Cage{rows_of<double, 3>(vertices, "vertices"), rows_of<int, 4>(tets, "tets"), {}};
           }),
           "vertices"_a, "tets"_a)
      .def_property_readonly(
          "vertices",
          [](const py::object& self) { return view(self.cast<const limber::Cage&>().nodes, self); },
          "(N, 3) float64, metres")
      .def_property_readonly(
          "tets", [](const py::object& self) { return view(self.cast<const limber::Cage&>().tets, self); },
          "(T, 4) int32, of positive volume")
      .def_property_readonly(
          "hull_from_tet",
          [](const py::object& self) { return view(self.cast<const limber::Cage&>().hull_from_tet, self); },
          "(T,) int32; empty where no hulls were given")
      .def_readonly("volume_ratio", &limber::Cage::volume_ratio,
                    "the cage's volume over the model's; 0 of an open one")
      .def_readonly("notes", &limber::Cage::notes, "what the user should know, as sentences");
  m.def(
      "build_cage",
      [](const py::object& vertices, const py::object& faces, const py::sequence& hulls, int tets,
         const std::string& mode, const py::object& progress, int threads) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        std::vector<limber::Mesh> shells;
        for (const py::handle& hull : hulls) {
          const auto pair = py::reinterpret_borrow<py::sequence>(hull);
          shells.push_back(mesh_of(pair[0], pair[1]));
        }
        return call(progress, threads, [&](const limber::Context& context) {
          return limber::build_cage(mesh, shells, {tets, mode}, context);
        });
      },
      "vertices"_a, "faces"_a, "hulls"_a, py::kw_only(), "tets"_a, "mode"_a, "progress"_a, "threads"_a);
  m.def(
      "certify",
      [](const py::object& vertices, const py::object& faces, const limber::Cage& cage) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        return call(py::none(), 0,
                    [&](const limber::Context& context) { return limber::certify(mesh, cage, context); });
      },
      "vertices"_a, "faces"_a, "cage"_a);
  py::class_<limber::Binding>(m, "Binding", "Barycentric weights of a surface in a cage.")
      .def_property_readonly(
          "tet_from_vertex",
          [](const py::object& self) {
            return view(self.cast<const limber::Binding&>().tet_from_vertex, self);
          },
          "(V,) int32")
      .def_property_readonly(
          "weights",
          [](const py::object& self) { return view(self.cast<const limber::Binding&>().weights, self); },
          "(V, 4) float64, each row sums to 1")
      .def_readonly("outside", &limber::Binding::outside,
                    "vertices in no tet, bound to the nearest by extrapolation")
      .def_readonly("max_outside_distance_m", &limber::Binding::max_outside_distance_m,
                    "of those, the farthest from its tet, metres")
      .def(
          "deform",
          [](const limber::Binding& self, const py::object& tets, const py::object& nodes) {
            return owned(
                limber::deform(self, rows_of<int, 4>(tets, "tets"), rows_of<double, 3>(nodes, "nodes")));
          },
          "tets"_a, "nodes"_a,
          "(V, 3): where the surface is when the cage's nodes are at `nodes`, (N, 3) metres");
  m.def(
      "bind",
      [](const py::object& vertices, const py::object& faces, const limber::Cage& cage) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        return call(py::none(), 0,
                    [&](const limber::Context& context) { return limber::bind(mesh, cage, context); });
      },
      "vertices"_a, "faces"_a, "cage"_a);

  py::class_<limber::Body>(m, "Body", "A model with its hulls, cage, certificate and binding; never changes.")
      .def_static("load", &limber::Body::load, "folder"_a)
      .def("save", &limber::Body::save, "folder"_a, py::call_guard<py::gil_scoped_release>(),
           "writes the files of docs/files.md; DiskError where the disk refuses")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            return view(self.cast<const limber::Body&>().surface().vertices, self);
          },
          "(V, 3) float64, metres")
      .def_property_readonly(
          "faces",
          [](const py::object& self) { return view(self.cast<const limber::Body&>().surface().faces, self); },
          "(F, 3) int32, counter-clockwise seen from outside")
      .def_property_readonly(
          "hulls", [](const limber::Body& self) { return pairs_of(self.hulls()); },
          "list of (vertices, faces), convex")
      .def_property_readonly("cage", &limber::Body::cage, py::return_value_policy::reference_internal,
                             "the Cage")
      .def_property_readonly("certificate", &limber::Body::certificate,
                             py::return_value_policy::reference_internal, "the Certificate")
      .def_property_readonly("binding", &limber::Body::binding, py::return_value_policy::reference_internal,
                             "the Binding")
      .def("report_json", &limber::Body::report_json, "report.json of docs/files.md, as text")
      .def(
          "picture_png",
          [](const limber::Body& self) {
            return py::bytes(call(py::none(), 0,
                                  [&](const limber::Context& context) { return self.picture_png(context); }));
          },
          "the cage over the surface, small: bytes of a PNG")
      .def(
          "deform",
          [](const limber::Body& self, const py::object& nodes) {
            return owned(self.deform(rows_of<double, 3>(nodes, "nodes")));
          },
          "nodes"_a, "(V, 3): where the surface is when the cage's nodes are at `nodes`, (N, 3) metres");
  m.def(
      "prepare",
      [](const py::object& model, const py::object& faces, int shells, double concavity, double threshold,
         double inflate, int max_hull_vertices, bool exact, int tets, const std::string& mode, double scale,
         bool y_up, const py::object& progress, int threads) {
        const limber::PrepareOptions options =
            prepare_options(shells, concavity, threshold, inflate, max_hull_vertices, exact, tets, mode);
        if (faces.is_none()) {
          const auto file = model.cast<std::filesystem::path>();
          return call(progress, threads, [&](const limber::Context& context) {
            return limber::prepare(file, options, {scale, y_up}, context);
          });
        }
        const limber::Mesh mesh = mesh_of(model, faces);
        return call(progress, threads,
                    [&](const limber::Context& context) { return limber::prepare(mesh, options, context); });
      },
      "model"_a, "faces"_a, py::kw_only(), "shells"_a, "concavity"_a, "threshold"_a, "inflate"_a,
      "max_hull_vertices"_a, "exact"_a, "tets"_a, "mode"_a, "scale"_a, "y_up"_a, "progress"_a, "threads"_a);

  // ---- Scenes and motions
  m.def("scene_names", &limber::scene_names);
  py::class_<limber::Scene>(m, "Scene")
      .def(py::init([](const std::string& file_or_name, const std::string& preset,
                       const std::vector<std::string>& sets, const std::vector<std::filesystem::path>& data) {
             return limber::read_scene(file_or_name, {preset, sets, data});
           }),
           "file_or_name"_a, py::kw_only(), "preset"_a, "sets"_a, "data"_a)
      .def_property_readonly("name", &limber::Scene::name)
      .def_property_readonly("text", &limber::Scene::text)
      .def_property_readonly("bodies", &limber::Scene::bodies)
      .def_property_readonly("robot", &limber::Scene::robot);

  py::class_<limber::Problem>(m, "World")
      .def(py::init([](const limber::Scene& scene, const std::filesystem::path& work_folder,
                       const py::object& progress, int threads) {
             return call(progress, threads, [&](const limber::Context& context) {
               return limber::Problem(scene, work_folder, context);
             });
           }),
           "scene"_a, "work_folder"_a, py::kw_only(), "progress"_a, "threads"_a)
      .def_property_readonly("scene", &limber::Problem::scene)
      .def_property_readonly("bodies", &limber::Problem::bodies)
      .def_property_readonly("dt_s", &limber::Problem::dt_s)
      .def_property_readonly("nodes", &limber::Problem::nodes)
      .def(
          "nodes_of",
          [](const limber::Problem& self, int body) {
            const limber::Problem::Range range = self.nodes_of(body);
            return py::make_tuple(range.first, range.count);
          },
          "body"_a)
      .def(
          "start", [](const limber::Problem& self, int copies) { return tuple_of(self.start(copies)); },
          "copies"_a)
      .def(
          "rollout",
          [](const limber::Problem& self, const Floats& positions, const Floats& velocities,
             const Steps& steps, const Flags& sound, const py::array& pushes, int threads) {
            const limber::States states = states_of(positions, velocities, steps, sound);
            const std::vector<limber::Push> each = pushes_of(pushes);
            return tuple_of(call(py::none(), threads, [&](const limber::Context& context) {
              return self.rollout(states, each, context);
            }));
          },
          "positions"_a, "velocities"_a, "steps"_a, "sound"_a, "pushes"_a, py::kw_only(), "threads"_a)
      .def(
          "robot_centers",
          [](const limber::Problem& self, const Floats& positions, const Floats& velocities,
             const Steps& steps, const Flags& sound) {
            return owned(self.robot_centers(states_of(positions, velocities, steps, sound)));
          },
          "positions"_a, "velocities"_a, "steps"_a, "sound"_a)
      .def(
          "plan",
          [](const limber::Problem& self, const std::optional<std::int64_t>& seed,
             const std::optional<std::int64_t>& iterations, double time_limit_s,
             const std::optional<std::int64_t>& rounds, const std::string& cost, bool improve,
             const limber::Plan* earlier, const py::object& keep, const py::object& progress, int threads) {
            constexpr std::int64_t most = std::numeric_limits<int>::max();
            std::optional<int> shortcut_rounds;  // one that is too large is refused as what it is cut to
            if (rounds) shortcut_rounds = int(std::clamp(*rounds, -most, most));
            const limber::SolveOptions options{seed, iterations, time_limit_s, shortcut_rounds,
                                               cost, improve};
            const auto search = [&](const limber::Context& context) {
              return earlier ? self.resume(*earlier, options, context) : self.solve(options, context);
            };
            return call(progress, threads, search, keep);
          },
          py::kw_only(), "seed"_a, "iterations"_a, "time_limit_s"_a, "shortcut_rounds"_a, "cost"_a,
          "improve"_a, "earlier"_a.none(true), "keep"_a, "progress"_a, "threads"_a)
      .def(
          "simulate",
          [](const limber::Problem& self, double duration_s, const py::object& progress, int threads) {
            return call(progress, threads,
                        [&](const limber::Context& context) { return self.simulate(duration_s, context); });
          },
          "duration_s"_a, py::kw_only(), "progress"_a, "threads"_a);

  py::class_<limber::Plan>(m, "Plan")
      .def_static("load", &limber::Plan::load, "folder"_a)
      .def_property_readonly("solved", &limber::Plan::solved)
      .def_property_readonly("explanation", &limber::Plan::explanation)
      .def_property_readonly("iterations", &limber::Plan::iterations)
      .def_property_readonly("nodes_in_tree", &limber::Plan::nodes_in_tree)
      .def_property_readonly("duration_s", &limber::Plan::duration_s)
      .def_property_readonly("frames_per_second", &limber::Plan::frames_per_second)
      .def_property_readonly("frame_count", &limber::Plan::frame_count)
      .def_property_readonly("tree_hash", &limber::Plan::tree_hash)
      .def_property_readonly("trajectory_hash", &limber::Plan::trajectory_hash)
      .def_property_readonly("world", &limber::Plan::problem)
      .def("states", [](const limber::Plan& self) { return tuple_of(self.frames()); })
      .def_property_readonly("pushes", [](const limber::Plan& self) { return array_of(self.pushes()); })
      .def(
          "surface",
          [](const limber::Plan& self, int body, int frame) { return owned(self.surface(body, frame)); },
          "body"_a, "frame"_a)
      .def("summary_json",
           [](const limber::Plan& self) {
             return call(py::none(), 0,
                         [&](const limber::Context& context) { return self.summary_json(context); });
           })
      .def(
          "save",
          [](const limber::Plan& self, const std::filesystem::path& folder) {
            call(py::none(), 0, [&](const limber::Context& context) {
              self.save(folder, context);
              return true;
            });
          },
          "folder"_a);

  // ---- Work folders
  m.def(
      "verify",
      [](const std::filesystem::path& folder, const std::string& scene, const std::filesystem::path& model,
         const py::object& progress, int threads) {
        py::list rows;
        for (const limber::Promise& p : call(progress, threads, [&](const limber::Context& context) {
               return model.empty() ? limber::verify(folder, scene, context)
                                    : limber::verify_body(folder, model, context);
             }))
          rows.append(py::make_tuple(p.name, p.kept, p.value));
        return rows;
      },
      "folder"_a, py::kw_only(), "scene"_a, "model"_a, "progress"_a, "threads"_a);
  m.def(
      "render",
      [](const std::filesystem::path& folder, int width, int height, const std::string& frames,
         const std::string& camera, const std::string& name, const std::vector<std::string>& sets,
         const std::filesystem::path& video, bool resume, const py::object& progress, int threads) {
        limber::FilmOptions options{
            .frames = frames, .resume = resume, .camera = camera, .sets = sets, .name = name};
        if (width != 0 || height != 0) options.size = std::to_string(width) + "x" + std::to_string(height);
        if (!video.empty()) options.video = video;
        const limber::RenderedFilm film = call(progress, threads, [&](const limber::Context& context) {
          return limber::render_film(folder, options, context);
        });
        return py::make_tuple(film.film.value_or(""), film.painted, film.failed);
      },
      "folder"_a, py::kw_only(), "width"_a, "height"_a, "frames"_a, "camera"_a, "name"_a, "sets"_a, "video"_a,
      "resume"_a, "progress"_a, "threads"_a);
  m.def(
      "export",
      [](const std::filesystem::path& folder, const std::vector<std::string>& formats,
         const std::filesystem::path& out, const py::object& progress, int threads) {
        return call(progress, threads, [&](const limber::Context& context) {
          return limber::export_motion(folder, formats, out, context);
        });
      },
      "folder"_a, "formats"_a, py::kw_only(), "out"_a, "progress"_a, "threads"_a);
  m.def(
      "report",
      [](const std::filesystem::path& folder, const std::filesystem::path& file, const py::object& progress,
         int threads) {
        return call(progress, threads, [&](const limber::Context& context) {
          return limber::write_report(folder, file.empty() ? std::nullopt : std::optional(file), context)
              .file;
        });
      },
      "folder"_a, py::kw_only(), "file"_a, "progress"_a, "threads"_a);
}
