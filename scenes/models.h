// From the body that a scene describes to meshes in the world.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "core/appearance.h"
#include "core/mesh.h"
#include "scenes/scene.h"

namespace limber::scenes {

// The fine surface of a model that limber makes itself, in the model's own frame, z up and x to the front;
// nothing for a file without a fall-back. Of a box whose cage is cells, it is a millionth smaller, so that it
// lies inside that cage.
std::optional<SurfaceMesh> made_surface(const BodySpec&);

// What that surface shows beyond its shape; empty where that is nothing.
Appearance made_appearance(const BodySpec&, const SurfaceMesh& made);

// The cage of a body with cage.cells, in the model's own frame; nothing for other bodies.
std::optional<TetMesh> made_cage(const BodySpec&);

// The bounding box at the start, where it follows from the scene alone: boxes, plates, blocks and spheres.
std::optional<Box> start_box(const BodySpec&);
// What is in the body's own box at the start, for sure: that box, of a tube its path, else position_m alone.
Box surely_occupied(const BodySpec&);

// Where a model goes at the start: p_world = world_from_model * p_model. `bounds` is the bounding box of the
// model as it was made or read from its file. `made` says that it was made (in metres, z up), also as the
// fall-back of a file.
Eigen::Affine3d world_from_model(const BodySpec&, const Points& model_positions, bool made);
// The same but for position_m: turned as in the world, the anchor at 0. So bodies that are the same but for
// where they are are the same here.
Eigen::Affine3d own_from_model(const BodySpec&, const Points& model_positions, bool made);

// The two longer axes of a plate, in the order x, y, z (0, 1, 2); the hole goes along the third.
std::array<int, 2> plate_plane(const Vec3& size_m);

// positions ← map * positions, row by row.
void transform(const Eigen::Affine3d& map, Points& positions);

// Rows of `cage_positions` (in the world, at the start) that the scene holds fixed, ascending; all of a rigid
// obstacle. Throws InputError naming the body when it asks for fixed nodes and no node is where it says.
std::vector<int> fixed_nodes(const BodySpec&, const Box& bounds_m, const Points& cage_positions);

// Rows of `positions` in the box, ascending; as fixed_nodes, a millionth of the bounds beyond it too.
std::vector<int> nodes_in(const Box& box_m, const Box& bounds_m, const Points& positions);

}  // namespace limber::scenes
