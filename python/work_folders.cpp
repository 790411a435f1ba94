// What is done with a work folder, for Python: verify, render, export, report.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "limber/limber.h"
#include "python/call.h"
#include "python/module.h"

namespace limber_python {

using namespace py::literals;

namespace {

void add_verify(py::module_& m) {
  m.def(
      "verify",
      [](const std::filesystem::path& folder, const limber::Scene* scene, const std::filesystem::path& model,
         const py::object& progress, int threads) {
        py::list rows;
        for (const limber::Promise& p : call(progress, threads, [&](const limber::Context& context) {
               if (!model.empty()) return limber::verify_body(folder, model, context);
               return scene ? limber::verify(folder, *scene, context) : limber::verify(folder, "", context);
             }))
          rows.append(py::make_tuple(p.name, p.kept, p.value));
        return rows;
      },
      "folder"_a, py::kw_only(), "scene"_a.none(true), "model"_a, "progress"_a, "threads"_a);
}

void add_render(py::module_& m) {
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
}

void add_export_and_report(py::module_& m) {
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

}  // namespace

void add_work_folders(py::module_& m) {
  add_verify(m);
  add_render(m);
  add_export_and_report(m);
}

}  // namespace limber_python
