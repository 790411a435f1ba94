// What contact on the fine surface needs of a body (core/contact_shape.h), from its surface and its cage.
// Method, figures, traps: docs/contact.md.
#pragma once

#include <string>
#include <vector>

#include "core/contact_shape.h"
#include "core/mesh.h"

namespace limber::meshing {

// "Size" is the longest edge of the surface's box. What is aimed at is a share of the smaller of that and
// 6 V / A: a ball's diameter, three times a plate's thickness.
struct ContactShapeSettings {
  int cells = 64;                      // of the field along the longest edge, to begin with; 8 … 1000
  int max_cells = 160;                 // where that is not good enough
  std::int64_t max_nodes = 3'000'000;  // of the field; 1,000 or more
  double field_error = 0.0015;         // distance that the field may have on 99 % of the surface
  double missed_depth = 0.0035;        // d, where a face bends: a plane goes s²/2R = 2d deeper than samples
  double min_spacing = 0.012;          // of samples, over 6 V / A or a third of size, what is more
  double max_spacing = 0.04;           // where the surface bends
  double max_flat_spacing = 0.08;      // in flat faces
  // Samples at most: so many for each square of the characteristic size that the surface has, within these
  // ends.
  double samples_a_square = 200;
  int fewest_most_samples = 1500, max_samples = 6000;
  double max_tips = 0.7;  // tips besides, over the most samples
};

struct ContactShapeReport {
  int cells = 0;  // along the longest edge of the surface's box
  std::int64_t nodes = 0;
  double characteristic_m = 0;  // min(size, 6 V / A)
  double error_p99_m = 0;       // of the field, at samples by their area
  double error_max_m = 0;
  double open_share = 0;  // of the surface: where what is inside is a matter of degree
  double memory_mb = 0;   // of the field
  double cpu_s = 0;
  std::vector<std::string> warnings;
};

// Both meshes must pass validate(); the surface may be open, doubled, self-intersecting: inside is where the
// winding number is above a half. Same input, same bytes on any number of threads.
ContactShape make_contact_shape(const SurfaceMesh& surface, const TetMesh& cage,
                                const ContactShapeSettings& = {}, ContactShapeReport* = nullptr);

// What follows from other parts of a shape. (T × 4): ContactShape::min_weight.
Weights min_weights(const DistanceField&, const TetMesh& cage);
// The field where it should be 0: on 99 % of the samples' area, and at the worst of them.
struct FieldErrors {
  double p99_m = 0, max_m = 0;
};
FieldErrors field_errors(const ContactShape&);

}  // namespace limber::meshing
