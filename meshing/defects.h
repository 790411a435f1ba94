// What is wrong with a surface, counted, with the first places where.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/json.h"
#include "core/mesh.h"

namespace limber::meshing {

struct Defect {
  std::int64_t count = 0;
  std::vector<std::string> places;  // the first five, as "triangle 17 at (0.1 0 2)"; rows counted from 0

  explicit operator bool() const { return count > 0; }
};

// Edge figures leave out degenerate faces whose corners fall together.
struct Defects {
  std::int64_t vertices = 0, triangles = 0;
  std::int64_t components = 0;  // of triangles joined over edges

  // As the file has them; zero in a cleaned mesh.
  Defect n_gons;               // faces of more than three corners
  Defect non_finite_vertices;  // infinite, not a number, or above 1e30
  Defect duplicate_vertices;   // at the place of an earlier one: the rule in STL, a seam elsewhere
  Defect isolated_vertices;    // in no face

  Defect degenerate_faces;  // flatter than the weld tolerance
  Defect duplicate_faces;   // the same three vertices as an earlier one, whichever way round

  Defect boundary_edges;           // of one triangle
  Defect non_manifold_edges;       // of more than two
  Defect non_manifold_vertices;    // whose triangles form more than one fan
  Defect misoriented_edges;        // of two triangles that both run along it the same way
  Defect inward_components;        // closed, with negative volume: inside out, or a cavity
  Defect inner_components;         // closed or nearly so, inside another: a cavity, or a solid in a solid
  Defect self_intersecting_pairs;  // of triangles
  bool self_intersections_counted = false;
  bool all_self_intersections_counted = false;  // false: the count is where counting stopped

  bool closed() const { return boundary_edges.count == 0 && non_manifold_edges.count == 0; }
};

// Those that triangles and positions show. Vertices are the same when their rows are, so weld first.
// Faces flatter than tolerance_m are degenerate. Self-intersections and inner components are not counted
// here.
Defects find_defects(const SurfaceMesh& welded, double tolerance_m);
// Adds the self-intersecting pairs; as quick as the surface is clean (about 1 µs a triangle).
void count_self_intersections(const SurfaceMesh&, Defects&);

// One sentence a kind that occurs: "12 boundary edges, the first: …".
std::vector<std::string> sentences(const Defects&);
Json to_json(const Defects&);

}  // namespace limber::meshing
