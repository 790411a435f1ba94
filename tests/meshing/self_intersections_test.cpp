#include "meshing/self_intersections.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

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
