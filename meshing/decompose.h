// A model as a union of few convex shells that cover it. Method and sources: docs/decomposition.md.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing {

struct DecomposeOptions {
  int max_shells = 32;       // ≥ 1
  double max_concavity = 0;  // stop when no shell stands off the model by more than this share of the model's
                             // bounding-box diagonal; 0: only the count rules
  int max_vertices = 64;     // of a shell, ≥ 8
  double inflation =
      0;  // at last every shell takes in all that is this share of the diagonal away from it, 0 … 1
  bool exact = false;  // the exact convex parts of a small closed model instead, as many as it takes
};

struct Decomposition {
  std::vector<ConvexShell> shells;
  std::vector<std::array<int, 2>> neighbours;  // rows of shells, lower first, ascending: they share a cut
  // What ruled: "concavity", the bound is met; "count"; "gain", no further cut gains anything; "exact".
  std::string stopped_by;
  double sum_of_hull_volumes = 0;  // m³
  double model_volume = 0;         // m³, holes closed by fans
  // Distance from the boundary of the union of shells to the model, over its diagonal, at about 20,000 points
  // spread evenly over that boundary (the same points each time). Before the shells are inflated.
  double mean_overshoot = 0, percentile_99_overshoot = 0, max_overshoot = 0;
  std::vector<double> overshoot_of_shell;  // the largest of each shell's points
  // Exact. A vertex that no triangle uses does not count; a triangle is covered when each piece that the cuts
  // made of it lies in one shell.
  std::int64_t vertices_uncovered = 0, triangles_uncovered = 0;
};

// Takes any soup, open or closed; a flat one gets shells of a ten-thousandth of the diagonal to either side.
// Throws InputError for a mesh that validate() refuses, one without extent, and options out of range; with
// `exact` also for one that is open, not 2-manifold, intersects itself, or is too large.
Decomposition decompose(const SurfaceMesh&, const DecomposeOptions&);

}  // namespace limber::meshing
