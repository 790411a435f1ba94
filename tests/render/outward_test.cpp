// Backs that nobody can see are not drawn; nothing else is left out.
#include "render/detail/outward.h"

#include <gtest/gtest.h>

#include "render/renderer.h"
#include "tests/render/shapes.h"

namespace limber::render {
namespace {

SurfaceMesh turned_inside_out(SurfaceMesh mesh) {
  mesh.triangles.col(1).swap(mesh.triangles.col(2));
  return mesh;
}
SurfaceMesh both(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh all{Points(a.positions.rows() + b.positions.rows(), 3),
                  Triangles(a.triangles.rows() + b.triangles.rows(), 3)};
  all.positions << a.positions, b.positions;
  all.triangles << a.triangles, (b.triangles.array() + int(a.positions.rows())).matrix();
  return all;
}
bool outward(const SurfaceMesh& mesh) { return detail::looks_outward(mesh.positions, mesh.triangles); }

Image seen_from(const Vec3& eye, const SurfaceMesh& mesh, const std::vector<Plane>& planes = {}) {
  RenderSettings settings;
  settings.width = 160, settings.height = 120, settings.transparent_background = true;
  Renderer renderer(settings);
  renderer.set_clip_planes(renderer.add_mesh(mesh.triangles, mesh.positions, {}), planes);
  Camera camera;
  camera.eye = eye, camera.target = eye + Vec3(0, 1, 0);
  return renderer.draw(camera);
}
float alpha_of_the_middle(const Image& image) {
  return image.rgba[4 * (std::size_t(image.height / 2) * std::size_t(image.width) + image.width / 2) + 3];
}

TEST(Outward, OnlyWhatIsClosedAndTurnedOutwardPieceByPiece) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 12), other = sphere_mesh({2, 0, 0}, 0.1, 8);
  EXPECT_TRUE(outward(ball));
  EXPECT_TRUE(outward(both(ball, other)));
  EXPECT_TRUE(outward(sphere_mesh({1e6, -1e6, 1e6}, 0.01, 8)));
  EXPECT_FALSE(outward(turned_inside_out(ball)));
  EXPECT_FALSE(outward(both(ball, turned_inside_out(other))));
  SurfaceMesh open = ball;
  open.triangles.conservativeResize(open.triangles.rows() - 1, 3);
  EXPECT_FALSE(outward(open));
}

// A lone triangle within the ball makes it one whose back may be seen.
TEST(Outward, ThePictureIsTheOneWithItsBack) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 40);
  SurfaceMesh splinter{Points(3, 3), Triangles(1, 3)};
  splinter.positions << 0, 0, 0, 0.01, 0, 0, 0, 0, 0.01;
  splinter.triangles << 0, 1, 2;
  ASSERT_FALSE(outward(both(ball, splinter)));
  const Image without = seen_from({0, -2, 0}, ball), with = seen_from({0, -2, 0}, both(ball, splinter));
  EXPECT_EQ(without.rgba, with.rgba);
  EXPECT_EQ(alpha_of_the_middle(without), 1);
}

TEST(Outward, TheInsideIsSeenByAnEyeWithinAndWhereABodyIsCutOpen) {
  const SurfaceMesh ball = sphere_mesh({0, 0, 0}, 0.5, 40);
  EXPECT_EQ(alpha_of_the_middle(seen_from({0, 0, 0}, ball)), 1);
  EXPECT_EQ(alpha_of_the_middle(seen_from({0, -2, 0}, ball, {{0, 1, 0, 0}})), 1);
}

}  // namespace
}  // namespace limber::render
