#include "meshing/simplify.h"

#include <gtest/gtest.h>

#include "core/hash.h"
#include "meshing/import.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

TEST(Simplify, KeepsVolumeAndAreaOfASphereWithATenthOfItsTriangles) {
  const SurfaceMesh fine = made_sphere(24);
  const int triangles = int(fine.triangles.rows() / 10);
  const SurfaceMesh coarse = simplify(fine, triangles);
  validate(coarse, "coarse");
  EXPECT_LE(std::abs(coarse.triangles.rows() - triangles), 2);
  EXPECT_NEAR(volume(coarse), volume(fine),
              0.005 * volume(fine));  // the policies keep volume, in closed form
  EXPECT_NEAR(area(coarse), area(fine), 0.01 * area(fine));
  EXPECT_TRUE(clean(coarse).left.closed());
  EXPECT_EQ(hash_of(coarse), hash_of(simplify(fine, triangles)));
}

TEST(Simplify, LeavesAsItIsWhatHasNoMore) {
  const SurfaceMesh mesh = made_sphere(8);
  EXPECT_EQ(hash_of(simplify(mesh, int(mesh.triangles.rows()))), hash_of(mesh));
}

// A third face at an edge: no manifold.
TEST(Simplify, TakesWhatIsNoManifold) {
  SurfaceMesh mesh = made_sphere(16);
  const Eigen::Index faces = mesh.triangles.rows();
  mesh.triangles.conservativeResize(faces + 1, 3);
  mesh.triangles.row(faces) << mesh.triangles(0, 0), mesh.triangles(0, 1), mesh.triangles(faces - 1, 2);
  const SurfaceMesh coarse = simplify(mesh, int(faces / 4));
  validate(coarse, "coarse");
  EXPECT_LT(coarse.triangles.rows(), faces / 2);
}

}  // namespace
}  // namespace limber::meshing
