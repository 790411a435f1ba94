// Scenes, worlds that are stepped in batches, and plans, for Python. Batched states are tuples of arrays.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>

#include "limber/limber.h"
#include "python/arrays.h"
#include "python/call.h"
#include "python/module.h"

namespace limber_python {

using namespace py::literals;

namespace {

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
        field("second_force_n", "(3,)<f4", offsetof(limber::Push, second_force_n)),
        field("pressure_pa", "<f4", offsetof(limber::Push, pressure_pa))}) {
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

void add_scene(py::module_& m) {
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
      .def_property_readonly("robot", &limber::Scene::robot)
      .def_property_readonly("goal",
                             [](const limber::Scene& self) -> py::object {
                               const std::optional<limber::Scene::Goal> goal = self.goal();
                               if (!goal) return py::none();
                               return py::make_tuple(goal->center_of_mass_m, goal->radius_m);
                             })
      .def_property_readonly("max_force_n", &limber::Scene::max_force_n);
}

void add_world(py::module_& m) {
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
}

void add_plan(py::module_& m) {
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
          [](const limber::Plan& self, const std::filesystem::path& folder, const std::string& keep_tree) {
            call(py::none(), 0, [&](const limber::Context& context) {
              self.save(folder, {keep_tree}, context);
              return true;
            });
          },
          "folder"_a, py::kw_only(), "keep_tree"_a);
}

}  // namespace

void add_scenes(py::module_& m) {
  m.attr("push_dtype") = push_dtype();
  add_scene(m);
  add_world(m);
  add_plan(m);
}

}  // namespace limber_python
