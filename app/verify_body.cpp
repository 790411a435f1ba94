#include "app/verify_body.h"

#include <cmath>

#include "core/error.h"
#include "core/hash.h"
#include "core/mesh_files.h"
#include "meshing/cage.h"
#include "meshing/contact_check.h"
#include "meshing/contact_shape.h"
#include "meshing/shell_check.h"
#include "meshing/surface_tree.h"

namespace limber::app {

namespace {

constexpr double rounding = 1e-9;  // of the size, or of a figure

// The first figure of `facts` that the report has otherwise, "" where there is none.
std::string first_wrong(const Json& facts, const Json& report) {
  if (facts.is_object()) {
    for (const auto& [key, value] : facts.items()) {
      if (!report.is_object() || !report.contains(key)) return key;
      if (const std::string within = first_wrong(value, report.at(key)); !within.empty())
        return within == "." ? key : key + "." + within;
    }
    return "";
  }
  if (facts.is_array()) {
    if (!report.is_array() || report.size() != facts.size()) return ".";
    for (std::size_t i = 0; i < facts.size(); ++i)
      if (!first_wrong(facts[i], report[i]).empty()) return ".";
    return "";
  }
  if (!facts.is_number_float()) return facts == report ? "" : ".";
  if (!report.is_number()) return ".";
  const double here = facts.get<double>(), there = report.get<double>();
  return std::abs(here - there) <= rounding * std::abs(here) ? "" : ".";
}

bool in_a_tet(const TetMesh& cage, const Vec3& p) {
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto corner = [&](int k) { return Vec3(cage.positions.row(cage.tets(t, k))); };
    if (meshing::tet_holds(corner(0), corner(1), corner(2), corner(3), p)) return true;
  }
  return false;
}

void check_cage(const std::string& name, const PreparedBody& body, const meshing::Certificate& c,
                Promises& table) {
  table.row(name + ": no vertex outside the cage", c.vertices_outside == 0,
            fmt::format("{} of {}", c.vertices_outside, c.vertices));
  table.row(name + ": no triangle crosses its boundary", c.triangles_crossing == 0,
            fmt::format("{} of {}", c.triangles_crossing, c.triangles));
  table.row(name + ": boundary of the cage is a manifold", c.nonmanifold_edges + c.nonmanifold_vertices == 0,
            fmt::format("{} edges and {} vertices are not", c.nonmanifold_edges, c.nonmanifold_vertices));
  const Json& written = body.report.at("certificate");
  table.row(name + ": certificate is of these meshes",
            written.at("surface_hash") == hex(c.surface_hash) &&
                written.at("cage_hash") == hex(c.cage_hash) && written.at("holds") == c.holds(),
            fmt::format("dihedrals {:.1f} … {:.1f} degrees", c.min_dihedral_deg, c.max_dihedral_deg));
}

void check_shells(const std::string& name, const PreparedBody& body, const std::vector<ConvexShell>& shells,
                  Promises& table) {
  const meshing::ShellCheck c = meshing::check_shells(shells, body.surface);
  table.row(name + ": shells are convex", c.not_convex == 0 && !shells.empty(),
            fmt::format("{} of {} are not", c.not_convex, shells.size()));
  const Json& said = body.report.at("shells");
  table.row(name + ": shells cover the surface",
            c.vertices_uncovered <= said.value("vertices_uncovered", std::int64_t(0)) &&
                c.triangles_uncovered <= said.at("triangles_uncovered").get<std::int64_t>(),
            fmt::format("{} vertices and {} triangles not, {} by the report", c.vertices_uncovered,
                        c.triangles_uncovered, said.at("triangles_uncovered").get<std::int64_t>()));
  const auto is = [&](const char* key, double value) {
    return std::abs(said.at(key).get<double>() - value) <= rounding * value;
  };
  // Of inflated shells the report tells of those before.
  if (said.value("inflation", 0.0) == 0)
    table.row(name + ": shells stand off the surface by what is said",
              is("mean_overshoot", c.mean_overshoot) && is("max_overshoot", c.max_overshoot),
              fmt::format("mean {:.3f} %, largest {:.3f} % of the diagonal", 100 * c.mean_overshoot,
                          100 * c.max_overshoot));
  const std::string mode = body.report.at("cage").at("mode");
  bool labelled = body.shell_from_tet.size() == std::size_t(body.cage.tets.rows());
  if (mode == "cells")
    labelled = labelled && std::count(body.shell_from_tet.begin(), body.shell_from_tet.end(), 0) ==
                               std::ptrdiff_t(body.shell_from_tet.size());
  else if (mode != "paper")
    labelled = labelled && body.shell_from_tet == meshing::label_tets(body.cage, shells);
  for (const int shell : body.shell_from_tet) labelled = labelled && shell >= 0 && shell < int(shells.size());
  table.row(name + ": each tet of the cage is of its shell", labelled, "");
}

void check_binding(const std::string& name, const PreparedBody& body, Promises& table) {
  const ffd::Binding& binding = body.binding;
  const double size = bounding_box(body.surface.positions).diagonal();
  std::int64_t outside = 0, wrong = 0;
  double most = 0;
  for (Eigen::Index v = 0; v < body.surface.positions.rows(); ++v) {
    const Vec3 p = body.surface.positions.row(v);
    Vec3 there = Vec3::Zero();
    for (int k = 0; k < 4; ++k)
      there += binding.weights(v, k) *
               Vec3(body.cage.positions.row(body.cage.tets(binding.tet_from_vertex[v], k)));
    const bool inside = binding.weights.row(v).minCoeff() >= -rounding;
    const double off = (there - p).norm();
    if (inside && off <= rounding * size) continue;
    // What is in no tet hangs on the nearest, as far as a weight of −1 allows.
    if (const bool clamped = binding.weights.row(v).minCoeff() < -1 + 1e-6;
        !inside && (clamped || off <= rounding * size) && !in_a_tet(body.cage, p))
      ++outside;
    else
      ++wrong, most = std::max(most, off);
  }
  table.row(name + ": binding brings back the surface at rest, each vertex in its tet", wrong == 0,
            wrong == 0 ? fmt::format("{} vertices outside the cage", outside)
                       : fmt::format("{} of {} vertices not, off by up to {:.2g} m", wrong,
                                     body.surface.positions.rows(), most));
  const ffd::Binding again = ffd::bind(body.surface, body.cage);
  table.row(name + ": bound again: the same binding",
            again.tet_from_vertex == binding.tet_from_vertex && again.weights == binding.weights &&
                again.outside == binding.outside &&
                again.farthest_outside_vertex == binding.farthest_outside_vertex &&
                again.max_outside_distance_m == binding.max_outside_distance_m,
            "");
}

void check_contact(const std::string& name, const PreparedBody& body, Promises& table) {
  if (!body.contact.usable) {
    const ContactShape again = meshing::make_contact_shape(body.surface, body.cage);
    table.row(name + ": contact is by the cage, for its surface has no inside to speak of", !again.usable,
              "");
    return;
  }
  const meshing::ContactCheck c = meshing::check_contact_shape(body.contact, body.surface, body.cage);
  table.row(name + ": distances for contact are the surface's", c.field_fault.empty(),
            c.field_fault.empty()
                ? fmt::format("{} nodes measured, off by at most {:.2f} cells", c.nodes, c.field_cells)
                : c.field_fault);
  table.row(name + ": samples for contact lie on the surface, and stand for all of it",
            c.sample_fault.empty(),
            c.sample_fault.empty() ? fmt::format("{} samples", body.contact.samples.area_m2.size())
                                   : c.sample_fault);
}

}  // namespace

void check_body(const std::string& name, const PreparedBody& body, const fs::path& folder, Promises& table) {
  const std::vector<ConvexShell> shells = read_obj_shells(folder / "shells.obj");
  for (const ConvexShell& shell : shells) validate(shell, (folder / "shells.obj").string());
  const meshing::Certificate certificate = meshing::certify(body.surface, body.cage);
  check_cage(name, body, certificate, table);
  check_shells(name, body, shells, table);
  check_binding(name, body, table);
  check_contact(name, body, table);
  const std::string wrong = first_wrong(
      facts_of_body(body.surface, shells, body.cage, body.binding, body.contact, certificate), body.report);
  table.row(name + ": report.json tells of these files", wrong.empty(),
            wrong.empty() ? "" : wrong + " is another's");
}

void check_origin(const std::string& name, const Origin& origin, Promises& table) {
  table.row(name + ": made as the scene says", origin.placed_so, "");
  if (origin.same_surface)
    table.row(name + ": surface is the scene's model", *origin.same_surface, "");
  else
    table.measured(name + ": surface", "its model file is not here to be compared with");
}

}  // namespace limber::app
