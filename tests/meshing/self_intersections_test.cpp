#include "meshing/self_intersections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace limber::meshing {
namespace {

SurfaceMesh mesh_of(std::vector<Vec3> positions, std::vector<std::array<int, 3>> triangles) {
  SurfaceMesh m{Points(positions.size(), 3), Triangles(triangles.size(), 3)};
  for (std::size_t v = 0; v < positions.size(); ++v) m.positions.row(v) = positions[v];
  for (std::size_t t = 0; t < triangles.size(); ++t)
    m.triangles.row(t) << triangles[t][0], triangles[t][1], triangles[t][2];
  return m;
}

TEST(SelfIntersections, NeighboursThatOnlyShareTheirEdgeOrVertexDoNotMeet) {
  const SurfaceMesh tetrahedron =
      mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
  EXPECT_TRUE(self_intersections(tetrahedron).pairs.empty());
  const SurfaceMesh fan =
      mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
  EXPECT_TRUE(self_intersections(fan).pairs.empty());
}

TEST(SelfIntersections, EachWayToMeetIsFound) {
  const std::vector<std::array<int, 2>> first_two{{0, 1}};
  const SurfaceMesh crossing = mesh_of(
      {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {.3, .3, -1}, {.3, .3, 1}, {3, 3, 1}}, {{0, 1, 2}, {3, 4, 5}});
  EXPECT_EQ(self_intersections(crossing).pairs, first_two);
  const SurfaceMesh through_a_shared_vertex =
      mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {.5, .5, -1}, {.5, .5, 1}}, {{0, 1, 2}, {0, 3, 4}});
  EXPECT_EQ(self_intersections(through_a_shared_vertex).pairs, first_two);
  SurfaceMesh other_way_round = through_a_shared_vertex;
  other_way_round.triangles.row(0).swap(other_way_round.triangles.row(1));
  EXPECT_EQ(self_intersections(other_way_round).pairs, first_two);
  const SurfaceMesh folded = mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 0, 3}});
  EXPECT_EQ(self_intersections(folded).pairs, first_two);
  const SurfaceMesh unfolded = mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, -1, 0}}, {{0, 1, 2}, {1, 0, 3}});
  EXPECT_TRUE(self_intersections(unfolded).pairs.empty());
}

// ── a second way: whole numbers, so that every sign is exact
// ───────────────────────────────────────────────────────

using Whole = Eigen::Matrix<std::int64_t, 3, 1>;
using WholeTriangle = std::array<Whole, 3>;

int sign(std::int64_t x) { return (x > 0) - (x < 0); }
int side(const WholeTriangle& t, const Whole& p) {
  return sign((t[1] - t[0]).cross(t[2] - t[0]).dot(p - t[0]));
}

// p lies in the plane of t: inside or on the rim.
bool holds(const WholeTriangle& t, const Whole& p) {
  const Whole normal = (t[1] - t[0]).cross(t[2] - t[0]);
  for (int i = 0; i < 3; ++i)
    if ((t[(i + 1) % 3] - t[i]).cross(p - t[i]).dot(normal) < 0) return false;
  return true;
}

// Closed segment and closed triangle.
bool meet(const Whole& p, const Whole& q, const WholeTriangle& t) {
  const int sp = side(t, p), sq = side(t, q);
  if (sp == 0 && sq == 0) {  // in one plane: an end inside, or the segment meets a side
    if (holds(t, p) || holds(t, q)) return true;
    const Whole normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const auto turn = [&](const Whole& a, const Whole& b, const Whole& c) {
      return sign((b - a).cross(c - a).dot(normal));
    };
    for (int i = 0; i < 3; ++i) {
      const Whole &a = t[i], &b = t[(i + 1) % 3];
      if (turn(p, q, a) * turn(p, q, b) <= 0 && turn(a, b, p) * turn(a, b, q) <= 0 &&
          !(turn(p, q, a) == 0 && turn(p, q, b) == 0))
        return true;
    }
    return false;  // along one line with a side, and beyond it: no end inside, and none of the side's (below)
  }
  if (sp * sq > 0) return false;
  int signs[3];
  for (int i = 0; i < 3; ++i) signs[i] = sign((q - p).cross(t[i] - p).dot(t[(i + 1) % 3] - p));
  const auto [low, high] = std::minmax({signs[0], signs[1], signs[2]});
  return low >= 0 || high <= 0;
}

bool meet_beyond_what_they_share(const SurfaceMesh& mesh, int s, int t) {
  const auto corner = [&](int f, int c) { return mesh.triangles(f, c); };
  const auto at = [&](int v) { return Whole(mesh.positions.row(v).transpose().cast<std::int64_t>()); };
  const WholeTriangle a{at(corner(s, 0)), at(corner(s, 1)), at(corner(s, 2))},
      b{at(corner(t, 0)), at(corner(t, 1)), at(corner(t, 2))};
  std::vector<std::array<int, 2>> shared;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (corner(s, i) == corner(t, j)) shared.push_back({i, j});
  if (shared.size() == 3) return true;
  if (shared.size() == 2) {
    const Whole &p = a[3 - shared[0][0] - shared[1][0]], &q = b[3 - shared[0][1] - shared[1][1]];
    const Whole &e = a[shared[0][0]], &f = a[shared[1][0]];
    return side(a, q) == 0 && (f - e).cross(p - e).dot((f - e).cross(q - e)) > 0;
  }
  if (shared.size() == 1) {
    const auto [i, j] = shared[0];
    return meet(a[(i + 1) % 3], a[(i + 2) % 3], b) || meet(b[(j + 1) % 3], b[(j + 2) % 3], a);
  }
  for (int i = 0; i < 3; ++i)
    if (meet(a[i], a[(i + 1) % 3], b) || meet(b[i], b[(i + 1) % 3], a)) return true;
  return false;
}

// A soup on a small grid, full of coplanar, touching and shared things; moved far away it is the same.
TEST(SelfIntersections, AreThoseOfAllPairsInWholeNumbers) {
  for (const int grid : {3, 5, 9})
    for (const int seed : {1, 2, 3}) {
      Rng rng{std::uint64_t(seed), std::uint64_t(grid)};
      SurfaceMesh mesh{Points(grid * grid * grid, 3), Triangles(160, 3)};
      for (int v = 0; v < mesh.positions.rows(); ++v)
        mesh.positions.row(v) << v % grid, v / grid % grid, v / grid / grid;
      for (int t = 0; t < mesh.triangles.rows();) {
        for (int c = 0; c < 3; ++c) mesh.triangles(t, c) = rng.below(int(mesh.positions.rows()));
        const auto p = [&](int c) { return Vec3(mesh.positions.row(mesh.triangles(t, c))); };
        if ((p(1) - p(0)).cross(p(2) - p(0)).norm() > 0) ++t;
      }
      std::vector<std::array<int, 2>> expected;
      for (int s = 0; s < mesh.triangles.rows(); ++s)
        for (int t = s + 1; t < mesh.triangles.rows(); ++t)
          if (meet_beyond_what_they_share(mesh, s, t)) expected.push_back({s, t});
      SCOPED_TRACE(fmt::format("grid {} seed {}", grid, seed));
      EXPECT_GT(expected.size(), 100u);
      EXPECT_EQ(self_intersections(mesh).pairs, expected);
      mesh.positions.rowwise() += Eigen::RowVector3d(1 << 30, -(1 << 29), 12345678);
      EXPECT_EQ(self_intersections(mesh).pairs, expected) << "far away";
    }
}

TEST(SelfIntersections, StopsAtItsLimitAndSaysSo) {
  std::vector<Vec3> positions;
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i < 10; ++i) {  // ten blades round the z axis, apart in z by nothing: all 45 pairs meet
    const double angle = 0.3 * i;
    for (const double r : {-1.0, 1.0})
      positions.emplace_back(r * std::cos(angle), r * std::sin(angle), 0.01 * i);
    positions.emplace_back(0, 0, 1);
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const SurfaceMesh blades = mesh_of(positions, triangles);
  EXPECT_EQ(self_intersections(blades).pairs.size(), 45u);
  EXPECT_TRUE(self_intersections(blades).complete);
  EXPECT_EQ(self_intersections(blades, 7).pairs.size(), 7u);
  EXPECT_FALSE(self_intersections(blades, 7).complete);
}

}  // namespace
}  // namespace limber::meshing
