// The modes that do not enclose: paper and conform.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <map>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/decompose.h"
#include "meshing/quality.h"
#include "meshing/surface_tree.h"
#include "tests/meshing/cage_models.h"

namespace limber::meshing {
namespace {

using testing::Contains;
using testing::HasSubstr;

ConvexShell shell_of(const SurfaceMesh& m) { return {m.positions, m.triangles}; }

Cage conformed(const SurfaceMesh& m, int tets) {
  return build_cage(m, {}, {.mode = CageMode::conform, .tets = tets});
}

// The corner of one box in the middle of a face of the other, and faces that gape by a thousandth.
TEST(PaperMode, ShellsThatMeetAreJoinedThroughTheCornersOfBoth) {
  const ConvexShell large = shell_of(moved(box_at_origin({1, 2, 2}), {-0.5, 0, 0})),
                    small = shell_of(moved(box_at_origin({1, 1, 1}), {0.501, 0.5, 0.5}));
  const Cage cage = build_cage(box_at_origin({2, 2, 2}), {large, small}, {.mode = CageMode::paper});
  EXPECT_EQ(cage.components, 1);
  EXPECT_EQ(cage.mesh.positions.rows(), 16) << "no corner of one coincides with one of the other";
  EXPECT_NEAR(volume(cage.mesh), 4 + 1, 0.01);
  EXPECT_THAT(cage.notes, Contains(HasSubstr("1 of the 1 pairs of shells that share corners share a face")));
  // Farther apart than the stated distance they stay two.
  const Cage apart = build_cage(box_at_origin({2, 2, 2}),
                                {large, shell_of(moved(box_at_origin({1, 1, 1}), {0.55, 0.5, 0.5}))},
                                {.mode = CageMode::paper});
  EXPECT_EQ(apart.components, 2);
}

TEST(PaperMode, ADecomposedModelIsOnePiece) {
  const SurfaceMesh ring = made_ring(0.3, 48, 12);
  const Decomposition parts = decompose(ring, {.max_shells = 10});
  const Cage cage = build_cage(ring, parts.shells, {.mode = CageMode::paper});
  validate(cage.mesh, "paper");
  EXPECT_EQ(cage.components, 1);
  EXPECT_NEAR(cage.volume_ratio, volume(cage.mesh) / volume(ring), 1e-12);
  EXPECT_GT(cage.volume_ratio, 0.95);
  EXPECT_LT(cage.volume_ratio, 1.5);
}

// Where shells overlap, one of two tets is left out: no face has two on one side. None is flat, and there are
// no more than are asked for, of fewer corners the fewer they are.
TEST(PaperMode, TetsOfShellsFitTogether) {
  const SurfaceMesh ring = made_ring(0.3, 48, 12);
  const Decomposition parts = decompose(ring, {.max_shells = 6});
  Eigen::Index nodes = 1'000'000;
  for (const int most : {2000, 400, 100}) {
    SCOPED_TRACE(most);
    const Cage cage = build_cage(ring, parts.shells, {.mode = CageMode::paper, .tets = most});
    validate(cage.mesh, "paper");
    EXPECT_LE(cage.mesh.tets.rows(), most);
    EXPECT_GT(cage.mesh.tets.rows(), most / 4);
    EXPECT_LT(cage.mesh.positions.rows(), nodes);
    nodes = cage.mesh.positions.rows();
    std::map<std::array<int, 3>, std::vector<double>>
        sides;  // of each face: volumes to the tets' fourth corners
    for (const auto& tet : cage.mesh.tets.rowwise())
      for (int k = 0; k < 4; ++k) {
        std::array<int, 3> face{tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]};
        std::sort(face.begin(), face.end());
        const auto at = [&](int v) { return Vec3(cage.mesh.positions.row(v)); };
        sides[face].push_back(signed_volume(at(face[0]), at(face[1]), at(face[2]), at(tet[k])));
        const double area = 0.5 * (at(face[1]) - at(face[0])).cross(at(face[2]) - at(face[0])).norm();
        EXPECT_GT(3 * std::abs(sides[face].back()) / area, 1e-3 * bounding_box(ring.positions).diagonal());
      }
    for (const auto& [face, volumes] : sides) {
      ASSERT_LE(volumes.size(), 2u);
      EXPECT_LT(volumes[0] * (volumes.size() == 2 ? volumes[1] : -volumes[0]), 0);
    }
  }
}

TEST(ConformMode, MeetsTheBudgetAndFollowsTheSurface) {
  for (const auto& [name, m] :
       {std::pair{"ball", made_sphere(24)}, std::pair{"ring", made_ring(0.3, 48, 16)}}) {
    double volume_missed[2];
    for (const int i : {0, 1}) {
      const int tets = i == 0 ? 300 : 2000;
      SCOPED_TRACE(fmt::format("{} {}", name, tets));
      const Cage cage = conformed(m, tets);
      validate(cage.mesh, name);
      EXPECT_NEAR(double(cage.mesh.tets.rows()), tets, 0.1 * tets);
      EXPECT_EQ(cage.components, 1);
      EXPECT_GT(measure_quality(cage.mesh).min_dihedral_deg, 5);
      // The boundary's nodes lie on the surface.
      const SurfaceTree tree(m.positions, m.triangles);
      for (const int v : vertices_of(boundary_triangles(cage.mesh.tets))) {
        const Vec3 p = cage.mesh.positions.row(v);
        EXPECT_LT((tree.closest_point(p) - p).norm(), 0.02);
      }
      // And what it does not promise is told as it is.
      const Certificate c = certify(m, cage.mesh);
      EXPECT_GT(c.vertices_outside, 0);
      EXPECT_FALSE(c.holds());
      volume_missed[i] = std::abs(cage.volume_ratio - 1);
    }
    // Chords miss a round surface by the square of their length: here by a factor of (2000 / 300)^(2/3), 3.5.
    EXPECT_LT(volume_missed[0], 0.25) << name;
    EXPECT_LT(volume_missed[1], volume_missed[0] / 2) << name;
  }
}

TEST(ConformMode, KeepsSharpEdges) {
  const SurfaceMesh box = box_at_origin({2, 1, 1});
  const Cage cage = conformed(box, 600);
  EXPECT_NEAR(volume(cage.mesh), 2, 1e-6) << "flat faces and kept edges leave nothing out";
  EXPECT_THAT(cage.notes, Contains(HasSubstr("12 sharp edge lines are kept")));
}

TEST(ConformMode, WrapsWhatIsNotFitAndSaysWhy) {
  const auto note_of = [](const SurfaceMesh& m) { return conformed(m, 300).notes; };
  EXPECT_THAT(note_of(made_sphere(12)), Not(Contains(HasSubstr("alpha wrap"))));
  EXPECT_THAT(note_of(made_hemisphere(12)),
              Contains(HasSubstr("the model is not closed, so the tets fill CGAL's alpha wrap")));
  EXPECT_THAT(note_of(joined(made_sphere(12), moved(made_sphere(12), {0.5, 0.1, 0}))),
              Contains(HasSubstr("the model passes through itself")));
  SurfaceMesh three = box_at_origin({1, 1, 1});  // a fin: an edge of three triangles
  three.positions.conservativeResize(9, 3);
  three.positions.row(8) << 0, 0, 1.3;
  three.triangles.conservativeResize(13, 3);
  three.triangles.row(12) << three.triangles(0, 0), three.triangles(0, 1), 8;
  EXPECT_THAT(note_of(three), Contains(HasSubstr("alpha wrap")));
}

TEST(ConformMode, SameInputSameBytes) {
  const SurfaceMesh m = made_ring(0.3, 24, 10);
  const Cage once = conformed(m, 200);
  const std::vector<std::vector<double>> between(100,
                                                 std::vector<double>(1000));  // so that memory lies elsewhere
  EXPECT_EQ(hash_of(once.mesh), hash_of(conformed(m, 200).mesh));
}

TEST(ConformMode, ASignalStopsItAtOnce) {
  request_stop(SIGINT);
  EXPECT_THROW(conformed(made_sphere(12), 300), Interrupted);
  request_stop(0);
}

}  // namespace
}  // namespace limber::meshing
