// Meshes and folders that the render tests share.
#pragma once

#include <unistd.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "core/file.h"
#include "core/mesh.h"

namespace limber::render {

inline SurfaceMesh box_mesh(const Vec3& lower, const Vec3& upper) {
  SurfaceMesh mesh{Points(8, 3), Triangles(12, 3)};
  for (int i = 0; i < 8; ++i)
    mesh.positions.row(i) = lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(upper - lower);
  mesh.triangles << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6,
      1, 3, 5, 3, 7, 5;
  return mesh;
}

// a b c d counter-clockwise.
inline SurfaceMesh quad_mesh(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  SurfaceMesh mesh{Points(4, 3), Triangles(2, 3)};
  mesh.positions << a.transpose(), b.transpose(), c.transpose(), d.transpose();
  mesh.triangles << 0, 1, 2, 0, 2, 3;
  return mesh;
}

inline SurfaceMesh sphere_mesh(const Vec3& center, double radius, int rings) {
  const int around = 2 * rings;
  SurfaceMesh mesh{Points((rings - 1) * around + 2, 3), Triangles(2 * (rings - 1) * around, 3)};
  const auto vertex = [&](int ring, int k) {
    return ring == 0       ? 0
           : ring == rings ? int(mesh.positions.rows()) - 1
                           : 1 + (ring - 1) * around + k % around;
  };
  int t = 0;
  for (int ring = 0; ring <= rings; ++ring)
    for (int k = 0; k < (ring == 0 || ring == rings ? 1 : around); ++k) {
      const double a = std::numbers::pi * ring / rings, b = 2 * std::numbers::pi * k / around;
      mesh.positions.row(vertex(ring, k)) =
          center + radius * Vec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
  for (int ring = 0; ring < rings; ++ring)
    for (int k = 0; k < around; ++k) {
      if (ring + 1 < rings)
        mesh.triangles.row(t++) << vertex(ring, k), vertex(ring + 1, k), vertex(ring + 1, k + 1);
      if (ring > 0) mesh.triangles.row(t++) << vertex(ring, k), vertex(ring + 1, k + 1), vertex(ring, k + 1);
    }
  return mesh;
}

// A folder of its own, gone at the end.
struct Folder {
  Folder()
      : path(fs::temp_directory_path() /
             ("limber-render-test-" + std::to_string(::getpid()) + "-" + std::to_string(count()++))) {
    make_folder(path);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path operator/(const std::string& name) const { return path / name; }
  static int& count() {
    static int n = 0;
    return n;
  }
  fs::path path;
};

}  // namespace limber::render
