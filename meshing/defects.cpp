#include "meshing/defects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/error.h"
#include "meshing/detail/edges.h"
#include "meshing/repair.h"
#include "meshing/self_intersections.h"

namespace limber::meshing {

using detail::EdgeUse;

namespace {

constexpr std::size_t max_places = 5;
constexpr double min_volume = 1e-9;  // of area^1.5: below, a flake, and the sign of its volume is rounding

std::string at(const Vec3& p) { return fmt::format("at ({:.6g} {:.6g} {:.6g})", p.x(), p.y(), p.z()); }

Vec3 center(const SurfaceMesh& mesh, int t) {
  return (mesh.positions.row(mesh.triangles(t, 0)) + mesh.positions.row(mesh.triangles(t, 1)) +
          mesh.positions.row(mesh.triangles(t, 2))) /
         3;
}

template <class Place>
void note(Defect& defect, Place place) {
  ++defect.count;
  if (defect.places.size() < max_places) defect.places.push_back(place());
}

class Finder {
 public:
  Finder(const SurfaceMesh& mesh, double tolerance_m) : mesh_(mesh), uses_(detail::edge_uses(kept(mesh))) {
    found_.vertices = mesh.positions.rows();
    found_.triangles = mesh.triangles.rows();
    find_flat_faces(tolerance_m);
    find_duplicate_faces();
    find_edges();
    find_fans();
    find_components();
  }
  Defects take() { return std::move(found_); }

 private:
  // Without the sides of triangles whose corners fall together: they join nothing.
  static Triangles kept(const SurfaceMesh& mesh) {
    Triangles triangles = mesh.triangles;
    for (int t = 0; t < triangles.rows(); ++t)
      if (collapsed(triangles, t)) triangles.row(t).setConstant(triangles(t, 0));
    return triangles;
  }
  static bool collapsed(const Triangles& triangles, int t) {
    const int a = triangles(t, 0), b = triangles(t, 1), c = triangles(t, 2);
    return a == b || b == c || c == a;
  }

  void note_triangle(Defect& defect, int t) {
    note(defect, [&] { return fmt::format("triangle {} {}", t, at(center(mesh_, t))); });
  }
  void note_vertex(Defect& defect, int v) {
    note(defect, [&] { return fmt::format("vertex {} {}", v, at(mesh_.positions.row(v))); });
  }
  void note_edge(Defect& defect, const EdgeUse& e) {
    note(defect, [&] {
      return fmt::format("edge {}–{} {}", e.lower, e.upper,
                         at(0.5 * (mesh_.positions.row(e.lower) + mesh_.positions.row(e.upper))));
    });
  }

  void find_flat_faces(double tolerance_m) {
    for (int t = 0; t < mesh_.triangles.rows(); ++t)
      if (thinness(mesh_, t) <= tolerance_m) note_triangle(found_.degenerate_faces, t);
  }

  void find_duplicate_faces() {
    std::vector<std::array<int, 4>> faces;  // sorted corners, then the triangle
    for (int t = 0; t < mesh_.triangles.rows(); ++t) {
      if (collapsed(mesh_.triangles, t)) continue;
      std::array<int, 4> face{mesh_.triangles(t, 0), mesh_.triangles(t, 1), mesh_.triangles(t, 2), t};
      std::sort(face.begin(), face.begin() + 3);
      faces.push_back(face);
    }
    std::sort(faces.begin(), faces.end());
    std::vector<int> copies;
    for (std::size_t i = 1; i < faces.size(); ++i)
      if (std::equal(faces[i].begin(), faces[i].begin() + 3, faces[i - 1].begin()))
        copies.push_back(faces[i][3]);
    std::sort(copies.begin(), copies.end());
    for (const int t : copies) note_triangle(found_.duplicate_faces, t);
  }

  void find_edges() {
    detail::for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      if (edge.size() == 1) note_edge(found_.boundary_edges, edge[0]);
      if (edge.size() > 2) note_edge(found_.non_manifold_edges, edge[0]);
      if (edge.size() == 2 && edge[0].forward == edge[1].forward)
        note_edge(found_.misoriented_edges, edge[0]);
    });
  }

  // Corners of triangles at a vertex belong to one fan when an edge at that vertex joins their triangles.
  void find_fans() {
    UnionFind fans(int(mesh_.triangles.size()));
    const auto corner_at = [&](const EdgeUse& use, int vertex) {
      return 3 * use.triangle +
             (mesh_.triangles(use.triangle, use.side) == vertex ? use.side : (use.side + 1) % 3);
    };
    detail::for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      for (const EdgeUse& use : edge)
        for (const int vertex : {edge[0].lower, edge[0].upper})
          fans.join(corner_at(edge[0], vertex), corner_at(use, vertex));
    });
    std::vector<int> fan_count(std::size_t(mesh_.positions.rows()), 0);
    for (int corner = 0; corner < mesh_.triangles.size(); ++corner)
      if (!collapsed(mesh_.triangles, corner / 3) && fans.root(corner) == corner)
        ++fan_count[mesh_.triangles(corner / 3, corner % 3)];
    for (int v = 0; v < int(fan_count.size()); ++v)
      if (fan_count[v] > 1) note_vertex(found_.non_manifold_vertices, v);
  }

  void find_components() {
    const std::vector<int> component = detail::components(mesh_.triangles, uses_);
    // A component is closed when along each of its edges as many triangles run one way as the other.
    std::vector<char> closed(component.size(), true);
    detail::for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      int balance = 0;
      for (const EdgeUse& use : edge) balance += use.forward ? 1 : -1;
      if (balance != 0) closed[component[edge[0].triangle]] = false;
    });
    std::vector<double> volume(component.size(), 0.0), area(component.size(), 0.0);
    for (int t = 0; t < mesh_.triangles.rows(); ++t) {
      const Vec3 a = mesh_.positions.row(mesh_.triangles(t, 0)),
                 b = mesh_.positions.row(mesh_.triangles(t, 1)),
                 c = mesh_.positions.row(mesh_.triangles(t, 2));
      const Vec3 near =
          mesh_.positions.row(mesh_.triangles(component[t], 0));  // far away, rounding drowns a flake
      volume[component[t]] += signed_volume(near, a, b, c);
      area[component[t]] += 0.5 * (b - a).cross(c - a).norm();
    }
    for (int t = 0; t < mesh_.triangles.rows(); ++t) {
      if (component[t] != t || collapsed(mesh_.triangles, t)) continue;
      ++found_.components;
      if (closed[t] && volume[t] < -min_volume * area[t] * std::sqrt(area[t]))
        note_triangle(found_.inward_components, t);
    }
  }

  const SurfaceMesh& mesh_;
  const std::vector<EdgeUse> uses_;
  Defects found_;
};

struct Kind {
  const char* key;
  const char* one;
  const char* many;
  Defect Defects::*defect;
};
constexpr std::array<Kind, 13> kinds{{
    {"n_gons", "face of more than three corners", "faces of more than three corners", &Defects::n_gons},
    {"non_finite_vertices", "vertex that is not finite", "vertices that are not finite",
     &Defects::non_finite_vertices},
    {"duplicate_vertices", "duplicate vertex", "duplicate vertices", &Defects::duplicate_vertices},
    {"isolated_vertices", "vertex in no face", "vertices in no face", &Defects::isolated_vertices},
    {"degenerate_faces", "face without area", "faces without area", &Defects::degenerate_faces},
    {"duplicate_faces", "duplicate face", "duplicate faces", &Defects::duplicate_faces},
    {"boundary_edges", "boundary edge", "boundary edges", &Defects::boundary_edges},
    {"non_manifold_edges", "non-manifold edge", "non-manifold edges", &Defects::non_manifold_edges},
    {"non_manifold_vertices", "non-manifold vertex", "non-manifold vertices",
     &Defects::non_manifold_vertices},
    {"misoriented_edges", "edge between triangles that face opposite ways",
     "edges between triangles that face opposite ways", &Defects::misoriented_edges},
    {"inward_components", "closed component that faces inward", "closed components that face inward",
     &Defects::inward_components},
    {"inner_components", "component inside another", "components inside another", &Defects::inner_components},
    {"self_intersecting_pairs", "self-intersecting pair of triangles", "self-intersecting pairs of triangles",
     &Defects::self_intersecting_pairs},
}};

}  // namespace

Defects find_defects(const SurfaceMesh& welded, double tolerance_m) {
  return Finder(welded, tolerance_m).take();
}

void count_self_intersections(const SurfaceMesh& mesh, Defects& defects) {
  const SelfIntersections found = self_intersections(mesh);
  defects.self_intersections_counted = true;
  defects.all_self_intersections_counted = found.complete;
  defects.self_intersecting_pairs = {};
  for (const auto& [s, t] : found.pairs)
    note(defects.self_intersecting_pairs, [&, first = s, second = t] {
      return fmt::format("triangles {} and {} {}", first, second, at(center(mesh, first)));
    });
}

std::vector<std::string> sentences(const Defects& defects) {
  std::vector<std::string> said;
  for (const Kind& kind : kinds) {
    const Defect& defect = defects.*kind.defect;
    if (!defect) continue;
    said.push_back(fmt::format("{} {}, the first: {}", defect.count, defect.count == 1 ? kind.one : kind.many,
                               defect.places.front()));
  }
  return said;
}

Json to_json(const Defects& defects) {
  Json json{
      {"vertices", defects.vertices}, {"triangles", defects.triangles}, {"components", defects.components}};
  for (const Kind& kind : kinds) {
    const Defect& defect = defects.*kind.defect;
    json[kind.key] = {{"count", defect.count}, {"first", defect.places}};
  }
  if (!defects.self_intersections_counted)
    json["self_intersecting_pairs"] = nullptr;
  else
    json["self_intersecting_pairs"]["complete"] = defects.all_self_intersections_counted;
  return json;
}

}  // namespace limber::meshing
