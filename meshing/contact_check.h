// Whether a contact shape is that of a surface and a cage, by other means than those it was made by:
// distances measured at some nodes, and what must hold at all nodes and samples.
#pragma once

#include <string>

#include "core/contact_shape.h"
#include "core/mesh.h"

namespace limber::meshing {

struct ContactCheck {
  int nodes = 0;           // of the field that were measured, all over it and next to the surface
  double field_cells = 0;  // the most that one of them is off, in cells
  int wrong_sides = 0;     // of them: inside by the field and outside by the winding number, or the other way
  double steepest = 0;  // change of the field between neighbouring nodes, over their distance; 1 or a little
                        // more; not measured of open surfaces, 0
  double off_surface_m = 0, misplaced_m = 0;  // the farthest of a sample from the surface, and from where its
                                              // weights put it
  double area_share = 0;                      // that the samples stand for, of the surface that is seen
  // Of points of the surface to one of the nearest samples, over the side of a square of that sample's area.
  double widest_gap = 0;
  int wrong_least_weights = 0;  // tets whose min_weight does not follow from the field

  std::string field_fault, sample_fault;  // "" where all of that is as it must be
};

// Of a shape that is usable; both meshes must pass validate().
ContactCheck check_contact_shape(const ContactShape&, const SurfaceMesh&, const TetMesh& cage);

}  // namespace limber::meshing
