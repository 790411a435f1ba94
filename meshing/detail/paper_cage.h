// The cage as Rodriguez, Lien and Amato (ICRA 2006) made it: the tets of each convex shell by themselves.
#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// Over the model's diagonal. Corners closer to each other than this become one, and a corner of another shell
// that is closer to a shell than this becomes one of its own: then neighbours know the same points where they
// meet.
constexpr double paper_weld = 0.005;

struct PaperCage {
  TetMesh mesh;
  std::vector<int> shell_from_tet;
  std::vector<std::string> notes;  // what matches where shells meet, and what does not
};

// The Delaunay tets of each shell's corners after that. `diagonal` is the model's.
PaperCage paper_cage(const std::vector<ConvexShell>&, double diagonal);

}  // namespace limber::meshing::detail
