#include "meshing/shell_check.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace limber::meshing {
namespace {

// A tetrahedron in some turn, one of whose edges has a corner more near its middle, out by about the
// rounding: the face that closes the gap is a sliver whose plane is noise.
ConvexShell tetrahedron_with_a_sliver(double angle) {
  ConvexShell shell{Points(5, 3), Triangles(6, 3)};
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, 0, 1}};
  for (int v = 0; v < 4; ++v) shell.vertices.row(v) = (turn * corners[v]).transpose();
  const Vec3 out = turn * Vec3(0, -1, 1);
  shell.vertices.row(4) = 0.5 * (shell.vertices.row(0) + shell.vertices.row(1)) + 1e-16 * out.transpose();
  shell.triangles << 0, 2, 1, 0, 1, 4, 0, 4, 3, 4, 1, 3, 0, 3, 2, 1, 2, 3;
  return shell;
}

TEST(ShellCheck, AConvexShellCoversWhatIsWellWithinAndNothingBeyondWhateverItsSliversSay) {
  int convex = 0;
  for (int i = 0; i < 60; ++i) {
    const ConvexShell shell = tetrahedron_with_a_sliver(0.1 * i);
    const Eigen::RowVector3d middle = shell.vertices.topRows(4).colwise().mean();
    const auto scaled = [&](double by) {
      return SurfaceMesh{((shell.vertices.rowwise() - middle) * by).rowwise() + middle, shell.triangles};
    };
    const ShellCheck within = check_shells({shell}, scaled(0.9));
    EXPECT_EQ(check_shells({shell}, scaled(1.1)).triangles_uncovered, 6) << i;
    if (within.not_convex > 0) continue;
    ++convex;
    EXPECT_EQ(within.vertices_uncovered + within.triangles_uncovered, 0) << i;
  }
  EXPECT_GT(convex, 10);
}

}  // namespace
}  // namespace limber::meshing
