// unite_bench [RINGS]: what docs/imaging.md tells of elements that are united. CPU seconds for two spheres of
// RINGS bands (160 unless said) that overlap, are mirror images, touch nothing, and coincide.
#include <fmt/format.h>

#include <string>

#include "core/hash.h"
#include "core/progress.h"
#include "meshing/unite.h"
#include "tests/meshing/made_meshes.h"

using namespace limber;
using namespace limber::meshing;

namespace {

SurfaceMesh moved(SurfaceMesh mesh, const Vec3& by) {
  mesh.positions.rowwise() += by.transpose();
  return mesh;
}
SurfaceMesh mirrored(SurfaceMesh mesh) {
  mesh.positions.col(0) *= -1;
  mesh.triangles.col(0).swap(mesh.triangles.col(1));
  return mesh;
}

void measure(const char* name, const SurfaceMesh& a, const SurfaceMesh& b) {
  const double began = cpu_seconds();
  const United united = unite({a, b});
  fmt::print("{:14} {:7} + {:7} triangles: {:7}, {:6.2f} CPU s, {}, {}\n", name, a.triangles.rows(),
             b.triangles.rows(), united.surface.triangles.rows(), cpu_seconds() - began,
             united.together.empty() ? "apart" : "one", hex(hash_of(united.surface)));
}

}  // namespace

int main(int argc, char** argv) {
  const int rings = argc > 1 ? std::stoi(argv[1]) : 160;
  const SurfaceMesh sphere = made_sphere(rings);
  measure("overlap", sphere, moved(sphere, {0.9876, 0.1234, 0}));
  measure("mirror images", moved(sphere, {0.7, 0, 0}), mirrored(moved(sphere, {0.7, 0, 0})));
  measure("apart", sphere, moved(sphere, {1.5, 1.5, 0.1}));
  measure("coincide", sphere, sphere);
}
