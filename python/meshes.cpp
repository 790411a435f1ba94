// Meshes, hulls, cages, bindings and prepared bodies, for Python.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "limber/limber.h"
#include "python/arrays.h"
#include "python/call.h"
#include "python/module.h"

namespace limber_python {

using namespace py::literals;

namespace {

limber::PrepareOptions prepare_options(int shells, double concavity, double threshold, double inflate,
                                       int max_hull_vertices, bool exact, int tets, const std::string& mode) {
  return {shells, concavity, threshold, inflate, max_hull_vertices, exact, tets, mode};
}

void add_mesh_functions(py::module_& m) {
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
      "clean",
      [](const py::object& vertices, const py::object& faces, const py::object& progress) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        limber::ImportedMesh cleaned =
            call(progress, 0, [&](const limber::Context& context) { return limber::clean(mesh, context); });
        return py::make_tuple(owned(std::move(cleaned.mesh.vertices)), owned(std::move(cleaned.mesh.faces)),
                              cleaned.mended, cleaned.warnings);
      },
      "vertices"_a, "faces"_a, py::kw_only(), "progress"_a);
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
}

void add_certificate(py::module_& m) {
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
}

void add_cage(py::module_& m) {
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
}

void add_cage_functions(py::module_& m) {
  m.def(
      "build_cage",
      [](const py::object& vertices, const py::object& faces, const py::sequence& hulls, int tets,
         const std::string& mode, const py::object& progress, int threads) {
        const limber::Mesh mesh = mesh_of(vertices, faces);
        std::vector<limber::Mesh> shells;
        for (const py::handle& hull : hulls) {
          const auto pair = py::reinterpret_borrow<py::sequence>(hull);
          if (!py::isinstance<py::sequence>(hull) || pair.size() != 2)
            throw limber::InputError("hulls: each must be a pair, (vertices, faces)");
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
}

void add_binding(py::module_& m) {
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
}

void add_body(py::module_& m) {
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
}

void add_prepare(py::module_& m) {
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
}

}  // namespace

void add_meshes(py::module_& m) {
  add_mesh_functions(m);
  add_certificate(m);
  add_cage(m);
  add_cage_functions(m);
  add_binding(m);
  add_body(m);
  add_prepare(m);
}

}  // namespace limber_python
