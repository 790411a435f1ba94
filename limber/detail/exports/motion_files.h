// A planned motion as files for other programs. What is in them, and what reads them: docs/files.md.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "core/state.h"
#include "fem/world.h"
#include "limber/detail/body/body.h"
#include "limber/detail/world/surface_at.h"
#include "limber/work_folder.h"
#include "scenes/scene.h"

namespace limber::detail {

struct PlannedMotion {
  const scenes::Scene& scene;
  const std::vector<PreparedBody>& bodies;
  const fem::World& world;
  const std::vector<State>& frames;
  double frames_per_second;
  std::vector<int> wanted;  // of the frames, ascending, at least one
  double time_s(int frame) const { return frame / frames_per_second; }
};

// (V × 3), metres: the fine surface of a body as it is drawn in that frame.
Points surface_at(const PlannedMotion&, int body, int frame);

// What the scene shows of the colors that a body's model has; empty: the scene's color.
const Appearance& appearance_shown(const PlannedMotion&, int body);

// Each writes into the folder, which is there, and throws DiskError, or Interrupted between two frames.

// motion.glb: binary glTF 2.0, y up. Each deformable body is a mesh with a skin: the joints are its cage's
// nodes, a vertex' weights its barycentric ones, so that Σ wᵢ (x + pᵢ − pᵢ⁰) = Σ wᵢ pᵢ, the very binding;
// where it is deformed by Phong Deformation, two joints a node hold ½ Fᵢ as well. Skins know no negative
// weights: those of vertices outside their tet are set to 0, with a warning that says how far they end up at
// most.
WrittenFiles write_gltf(const PlannedMotion&, const fs::path& folder);

// motion.usda: meshes with their points at each frame; textures/: the images that they show.
WrittenFiles write_usd(const PlannedMotion&, const fs::path& folder);

// pc2/: NAME.obj at rest, NAME.pc2 with its points at each frame, what loads them into Blender. Throws
// InputError when the frames are not evenly apart.
WrittenFiles write_point_caches(const PlannedMotion&, const fs::path& folder);

// vtu/: cages.pvd and surfaces.pvd, each with a .vtu a frame.
WrittenFiles write_vtu_series(const PlannedMotion&, const fs::path& folder);

}  // namespace limber::detail
