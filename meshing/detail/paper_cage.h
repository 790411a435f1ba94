// The cage as Rodriguez, Lien and Amato (ICRA 2006) made it: the tets of each convex shell by themselves.
#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"

namespace limber::meshing::detail {

// Over the model's diagonal. A corner of another shell that is closer to a shell than this becomes one of its
// own, and corners closer to one of those before them become that one: then neighbours know the same points
// where they meet. The second distance grows until there are as few tets as are asked for.
constexpr double paper_weld = 0.005, paper_max_weld = 0.25;
// Over what corners are welded by. Tets that are thinner hardly have a volume, and none in float32.
constexpr double paper_thinnest = 0.2;

struct PaperCage {
  TetMesh mesh;
  std::vector<int> shell_from_tet;
  std::vector<std::string> notes;  // what matches where shells meet, and what does not
};

// The Delaunay tets of each shell's corners after that, but for thin ones, and for those that would lie on
// the same side of a face as one that is there, or be the third at it: no face is of more than two, and the
// two lie on either side. `diagonal` is the model's.
PaperCage paper_cage(const std::vector<ConvexShell>&, double diagonal, int max_tets);

}  // namespace limber::meshing::detail
