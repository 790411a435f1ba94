// The checker's own readers. They share no code with limber's: a fault in those must not hide itself here.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace check {

using Point = std::array<double, 3>;
using Triangle = std::array<int, 3>;  // rows of points
using Tet = std::array<int, 4>;

// A file that cannot be judged: unreadable, of an unknown form, or with an index out of range.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Surface {
  std::vector<Point> points;
  std::vector<Triangle> triangles;  // polygons are cut by ear clipping in the plane of their Newell normal
};
// .off (also COFF, NOFF), .obj, .ply (ASCII or binary), .stl (ASCII or binary). Points at exactly the same
// place become one, then all coordinates are multiplied by `scale`.
Surface read_surface(const std::string& file, double scale = 1);

struct TetMesh {
  std::vector<Point> points;
  std::vector<Tet> tets;
};
// .msh (Gmsh 2 ASCII), .mesh (Medit ASCII), .ele with the .node beside it (TetGen); linear tets, others are
// passed over. Points stay as they are: two at one place may be meant.
TetMesh read_tets(const std::string& file);

// An OBJ with one group (g or o) a convex shell; its faces as triangles.
std::vector<Surface> read_shells(const std::string& file);

}  // namespace check
