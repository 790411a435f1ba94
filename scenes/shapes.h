// Models that limber makes itself. All are closed, face outward, and are the same bytes every time. Their
// middle is the origin, z is up. Sizes in metres; triangle_m > 0 is the longest edge on a flat face (the true
// edges may be shorter). Method and figures: docs/scene.md.
#pragma once

#include "core/appearance.h"
#include "core/mesh.h"
#include "scenes/scene.h"

namespace limber::scenes {

// Faces cut in squares, and each square in two triangles; edges and corners rounded with radius bevel_m (0:
// sharp).
SurfaceMesh make_box(const BoxModel&);

// With a hole: rings of points round the hole from its wall over one face, the rim, and the other face.
SurfaceMesh make_plate(const PlateModel&);

// Blocks, their edges rounded with radius bevel_m where they stand out; in the coordinates of the model. A
// millionth of its size inside its cage.
SurfaceMesh make_blocks(const BlocksModel&);

// The cells between all faces of solids and holes, those in holes left out, five tets each; no cell is longer
// than cell_m, and there are two at least through a solid.
TetMesh make_blocks_cage(const BlocksModel&, double cell_m);

// What keeps blocks from being one closed manifold, in a few words; empty when nothing does.
std::string fault_of(const BlocksModel&);

// A geodesic sphere: an icosahedron whose faces are cut in four until no edge is longer than triangle_m.
SurfaceMesh make_sphere(const SphereModel&);

// A sphere of 1 m, and what is painted on it: panels of colors between two caps, welded along grooves.
SurfaceMesh make_beach_ball();
Appearance beach_ball_appearance(const SurfaceMesh& ball);  // whose vertices are those of the sphere

// Something like a sitting rabbit that looks along +x, out of ellipsoids that flow into one another; 1 m
// high, about 1 m long and 0.7 m wide, about 35,000 triangles.
SurfaceMesh make_bunny();

// The others out of ellipsoids, 1 m high too: a serpent on four feet, and the organs of body_parts and torso.
SurfaceMesh make_dragon();
SurfaceMesh make_heart();
SurfaceMesh make_lung(double side);  // 1: the left one, −1: the right one
SurfaceMesh make_liver();
SurfaceMesh make_spine();
SurfaceMesh make_ribcage();  // twenty ribs and the breastbone, each a tube of its own

// A tube with round rims, or a rod with round ends, swept along a smooth curve through the points.
SurfaceMesh make_tube(const TubeModel&);

// That surface's cage: of a tube `cells` round it (even, at least 6), through its wall and along it; of a rod
// across it (twice the same number) and along it. Five tets each. Throws InputError where cells fold or
// would fill the lumen.
TetMesh make_tube_cage(const TubeModel&, const Eigen::Vector3i& cells);

bool is_closed(const std::vector<Vec3>& path_m);  // ends where it begins: a ring
double min_bend_radius_m(const TubeModel&);       // of its middle line
double length_m(const TubeModel&);                // likewise

// nx × ny × nz cells of five tets each, cut in alternate ways so that neighbours share their faces: 3 × 3 × 3
// cells are 64 nodes and 135 tets. Nodes in x-fastest order.
TetMesh make_box_cage(const Vec3& size_m, const Eigen::Vector3i& cells);

}  // namespace limber::scenes
