#include "meshing/cage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "meshing/certificate.h"
#include "meshing/detail/lattice.h"
#include "meshing/quality.h"
#include "tests/core/node_order.h"
#include "tests/meshing/brute_force.h"
#include "tests/meshing/cage_models.h"
#include "tests/meshing/made_meshes.h"

namespace limber::meshing {
namespace {

Cage cage_of(const SurfaceMesh& m, int tets, CageMode mode = CageMode::lattice) {
  CageOptions options;
  options.mode = mode;
  options.tets = tets;
  return build_cage(m, {}, options);
}

TEST(Cage, EnclosesByBruteForceAndByCertificate) {
  for (const auto& [name, m] : models())
    for (int tets : {60, 300, 1000}) {
      SCOPED_TRACE(name + " " + std::to_string(tets));
      const Cage cage = cage_of(m, tets);
      const BruteEnclosure brute = brute_enclosure(m, cage.mesh);
      EXPECT_EQ(brute.vertices_outside, 0);
      EXPECT_EQ(brute.triangles_crossing, 0);
      const Certificate c = certify(m, cage.mesh);
      EXPECT_TRUE(c.holds());
      EXPECT_EQ(c.vertices, m.positions.rows());
      EXPECT_EQ(c.triangles, m.triangles.rows());
      validate(cage.mesh, name);
    }
}

TEST(Cage, MeetsTheBudgetWithinTenPercentOrSaysSo) {
  int noted = 0, asked = 0;
  for (const auto& [name, m] : models())
    for (int tets : {60, 120, 300, 1000, 3000}) {
      SCOPED_TRACE(name + " " + std::to_string(tets));
      const Cage cage = cage_of(m, tets, CageMode::fast);
      const bool missed = std::abs(double(cage.mesh.tets.rows()) / tets - 1) > 0.1;
      bool said = false;
      for (const std::string& note : cage.notes) said = said || note.find("asked for") != note.npos;
      EXPECT_EQ(missed, said);
      noted += missed, ++asked;
    }
  EXPECT_LE(noted, asked / 10);
}

// Forces walk through memory by the nodes' numbers. In any order whatever the ends of an edge are a third of
// all nodes apart.
TEST(Cage, NodesAreNumberedNearlyAsNearAsInABand) {
  for (const auto& [name, m] :
       {std::pair{"ball", made_sphere(24)}, std::pair{"ring", made_ring(0.3, 48, 16)}})
    for (const CageMode mode : {CageMode::lattice, CageMode::fast}) {
      SCOPED_TRACE(std::string(name) + (mode == CageMode::fast ? ", fast" : ", lattice"));
      const TetMesh cage = cage_of(m, 6000, mode).mesh, banded = reordered(cage, banded_order(cage));
      validate(banded, name);
      EXPECT_LT(mean_bandwidth(cage.tets), 4 * mean_bandwidth(banded.tets));
      double step = 0;  // from a tet's lowest node to the next one's
      for (Eigen::Index t = 1; t < cage.tets.rows(); ++t)
        step += std::abs(cage.tets.row(t).minCoeff() - cage.tets.row(t - 1).minCoeff());
      EXPECT_LT(step / double(cage.tets.rows()), 2 * mean_bandwidth(banded.tets));
    }
}

TEST(Cage_slow, SaysWhenTheLatticeCannotMeetTheBudget) {
  // A needle along the diagonal of its box: as many tets as asked would need a lattice of too many cells.
  SurfaceMesh needle = box_at_origin({0.01, 0.01, 5});
  needle.positions.col(0) += needle.positions.col(2), needle.positions.col(1) += needle.positions.col(2);
  const Cage cage = cage_of(needle, 8000, CageMode::fast);
  EXPECT_LT(cage.mesh.tets.rows(), 7000);
  ASSERT_EQ(cage.notes.size(), 1u);
  EXPECT_NE(cage.notes[0].find("8000 tets were asked for"), std::string::npos) << cage.notes[0];
  EXPECT_TRUE(certify(needle, cage.mesh).holds());
}

// 396 triangles, 200 of them as long as all, some 20,000 units from the origin: exact predicates ask of no
// coordinate how large it is, and what is asked is bounded by what is near.
TEST(Cage, ARodOfNeedlesFarFromTheOriginIsEnclosed) {
  SurfaceMesh rod = rod_of_needles(100, 1e-4);
  rod.positions = (8400 * rod.positions).rowwise() + Eigen::RowVector3d(1800, 300, 500);
  const Cage cage = cage_of(rod, 500);
  EXPECT_NEAR(double(cage.mesh.tets.rows()), 500, 50);
  EXPECT_TRUE(certify(rod, cage.mesh).holds());
  const BruteEnclosure brute = brute_enclosure(rod, cage.mesh);
  EXPECT_EQ(brute.vertices_outside, 0);
  EXPECT_EQ(brute.triangles_crossing, 0);
}

TEST(Cage_slow, DihedralsStayWithinTheirBounds) {
  for (const auto& [name, m] : models()) {
    SCOPED_TRACE(name);
    CageOptions options;
    options.tets = 400;
    for (double bound : {15.0, 25.0, 40.0}) {
      options.min_dihedral_deg = bound, options.max_dihedral_deg = 180 - bound;
      const TetQuality q = measure_quality(build_cage(m, {}, options).mesh);
      EXPECT_GE(q.min_dihedral_deg, bound);
      EXPECT_LE(q.max_dihedral_deg, 180 - bound);
    }
    const TetQuality fast = measure_quality(cage_of(m, 400, CageMode::fast).mesh);
    EXPECT_NEAR(fast.min_dihedral_deg, 60, 1e-9);
    EXPECT_NEAR(fast.max_dihedral_deg, 90, 1e-9);
    EXPECT_NEAR(fast.median_min_dihedral_deg, 60, 1e-9);
  }
}

// Each edge of the boundary has two triangles, and the triangles round a vertex close to one ring.
TEST(Cage, BoundaryIsAManifoldByWalkingRoundEachVertex) {
  for (const auto& [name, m] : models())
    for (int tets : {60, 200, 800}) {
      SCOPED_TRACE(name + " " + std::to_string(tets));
      const Triangles boundary = boundary_triangles(cage_of(m, tets).mesh.tets);
      std::map<int, std::map<int, int>> next_round;  // vertex → (from → to) over its triangles
      for (int f = 0; f < boundary.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
          const bool is_new =
              next_round[boundary(f, k)].emplace(boundary(f, (k + 1) % 3), boundary(f, (k + 2) % 3)).second;
          ASSERT_TRUE(is_new) << "an edge at vertex " << boundary(f, k) << " has more than two triangles";
        }
      for (const auto& [v, ring] : next_round) {
        std::set<int> walked;
        for (int at = ring.begin()->first; walked.insert(at).second;) {
          ASSERT_TRUE(ring.count(at)) << "an open edge at vertex " << v;
          at = ring.at(at);
        }
        ASSERT_EQ(walked.size(), ring.size()) << "vertex " << v << " has more than one fan";
      }
    }
}

TEST(Cage, ConnectedModelsGetOnePieceAndOthersTheirNumber) {
  EXPECT_EQ(cage_of(made_ring(0.25, 24, 10), 300).components, 1);
  EXPECT_EQ(cage_of(models().at("hemisphere"), 300).components, 1);
  const Cage two = cage_of(models().at("two spheres"), 600);
  EXPECT_EQ(two.components, 2);
  ASSERT_EQ(two.notes.size(), 1u);
  EXPECT_NE(two.notes[0].find("2 pieces"), std::string::npos) << two.notes[0];
}

TEST(Cage, DrawingInMakesItTighter) {
  for (const auto& [name, m] : models()) {
    SCOPED_TRACE(name);
    EXPECT_LT(volume(cage_of(m, 500).mesh), 0.8 * volume(cage_of(m, 500, CageMode::fast).mesh));
  }
}

TEST(Cage, SphereVolumeNearsTheModelsAsTheBudgetGrows) {
  const SurfaceMesh m = made_sphere(24);
  double before = 3;
  for (int tets : {100, 400, 1600, 6400}) {
    const Cage cage = cage_of(m, tets);
    EXPECT_NEAR(cage.volume_ratio, volume(cage.mesh) / volume(m), 1e-12);
    EXPECT_GT(cage.volume_ratio, 1);
    EXPECT_LT(cage.volume_ratio, before) << tets;
    before = cage.volume_ratio;
  }
  EXPECT_LT(before, 1.08);
}

TEST(Cage, FillsTheInsideOfAClosedModelAndOfOneWithAnOpening) {
  EXPECT_GT(volume(cage_of(made_sphere(12), 2000).mesh), volume(made_sphere(12)));
  SurfaceMesh opened = made_sphere(12);
  opened.triangles.conservativeResize(opened.triangles.rows() - 20, 3);
  const Cage cage = cage_of(opened, 2000);
  EXPECT_GT(volume(cage.mesh), 0.95 * volume(made_sphere(12)));
  EXPECT_EQ(cage.volume_ratio, 0);
}

TEST(Cage_slow, SameBytesForAnyOrderOfTheTriangles) {
  for (const auto& [name, m] : models()) {
    SCOPED_TRACE(name);
    SurfaceMesh shuffled = m;
    Rng rng(12, 0);
    for (int f = int(m.triangles.rows()) - 1; f > 0; --f)
      shuffled.triangles.row(f).swap(shuffled.triangles.row(rng.below(f + 1)));
    EXPECT_EQ(hash_of(cage_of(m, 400).mesh), hash_of(cage_of(shuffled, 400).mesh));
  }
}

TEST(Cage, SameShapeAtAnyPowerOfTwo) {
  const SurfaceMesh m = made_ring(0.25, 24, 10);
  const Cage cage = cage_of(m, 400);
  for (int power : {-200, -30, 7, 300}) {
    SurfaceMesh scaled = m;
    scaled.positions *= std::exp2(power);
    const Cage other = cage_of(scaled, 400);
    EXPECT_EQ(other.mesh.tets, cage.mesh.tets);
    EXPECT_EQ(other.mesh.positions, cage.mesh.positions * std::exp2(power)) << power;
  }
}

TEST(Cage, VertexOfNoTriangleIsEnclosedToo) {
  SurfaceMesh m = made_sphere(8);
  m.positions.conservativeResize(m.positions.rows() + 1, 3);
  m.positions.bottomRows(1) << 1.9, 0, 0;
  EXPECT_EQ(certify(m, cage_of(m, 500).mesh).vertices_outside, 0);
}

TEST(Cage, GluedShareIsNothingForOneBallAndMuchForTwoThatNearlyTouch) {
  EXPECT_EQ(cage_of(made_sphere(16), 1000).glued_share, 0);
  const SurfaceMesh ball = made_sphere(16);
  EXPECT_GT(cage_of(joined(ball, moved(ball, {2.01, 0, 0})), 1000, CageMode::fast).glued_share, 0.01);
}

TEST(Cage, TellsWhatIsWrongWithItsInput) {
  const SurfaceMesh m = made_sphere(6);
  const auto message = [&](const SurfaceMesh& surface, const CageOptions& options) -> std::string {
    try {
      build_cage(surface, {}, options);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message(m, {.tets = 3}), testing::HasSubstr("24 … 200000"));
  EXPECT_THAT(message(m, {.min_dihedral_deg = 70}), testing::HasSubstr("min_dihedral_deg is 70"));
  EXPECT_THAT(message(m, {.gap = std::nan("")}), testing::HasSubstr("gap"));
  EXPECT_THAT(message(m, {.mode = CageMode::paper}), testing::HasSubstr("needs convex shells"));
  SurfaceMesh point = m;
  point.positions.setOnes();
  EXPECT_THAT(message(point, {}), testing::HasSubstr("one point"));
  SurfaceMesh nan = m;
  nan.positions(3, 1) = std::nan("");
  EXPECT_THAT(message(nan, {}), testing::HasSubstr("3"));
}

ConvexShell shell_of(const SurfaceMesh& m) { return {m.positions, m.triangles}; }

TEST(Cage, EachTetIsLabelledByTheShellThatHoldsIt) {
  const SurfaceMesh left = box_at_origin({1, 1, 1}), right = moved(left, {1, 0, 0});
  const SurfaceMesh whole = box_at_origin({2, 1, 1});
  const Cage cage = build_cage(whole, {shell_of(left), shell_of(right)}, {.tets = 500});
  for (int t = 0; t < cage.mesh.tets.rows(); ++t) {
    double x = 0;
    for (int k = 0; k < 4; ++k) x += cage.mesh.positions(cage.mesh.tets(t, k), 0) / 4;
    if (std::abs(x - 1) > 0.3) {
      EXPECT_EQ(cage.shell_from_tet[t], x > 1) << "middle at x = " << x;
    }
  }
}

TEST(Cage, ModePaperFillsEachShellAndWeldsSharedCorners) {
  const SurfaceMesh left = box_at_origin({1, 1, 1}), right = moved(left, {1, 0, 0});
  const Cage cage =
      build_cage(box_at_origin({2, 1, 1}), {shell_of(left), shell_of(right)}, {.mode = CageMode::paper});
  EXPECT_NEAR(volume(cage.mesh), 2, 1e-12);
  EXPECT_EQ(cage.mesh.positions.rows(), 12);
  EXPECT_EQ(std::count(cage.shell_from_tet.begin(), cage.shell_from_tet.end(), 0) * 2, cage.mesh.tets.rows());
  validate(cage.mesh, "paper");
}

TEST(Certificate, FailsWhenAVertexOfTheCageIsPulledThroughTheSurface) {
  const SurfaceMesh m = made_sphere(12);
  const Cage cage = cage_of(m, 300);
  ASSERT_TRUE(certify(m, cage.mesh).holds());
  for (int v : vertices_of(boundary_triangles(cage.mesh.tets))) {
    TetMesh pulled = cage.mesh;
    pulled.positions.row(v) *= 0.8 / pulled.positions.row(v).norm();
    const Certificate c = certify(m, pulled);
    EXPECT_FALSE(c.holds());
    EXPECT_GT(c.triangles_crossing, 0);
    EXPECT_EQ(c.triangles_crossing, brute_enclosure(m, pulled).triangles_crossing);
    EXPECT_NE(c.cage_hash, certify(m, cage.mesh).cage_hash);
    if (v > 40) break;
  }
}

TEST(Certificate, CountsVerticesOutsideAsBruteForceDoes) {
  const SurfaceMesh m = made_sphere(12);
  TetMesh cage = cage_of(m, 300).mesh;
  cage.positions *= 0.8;
  const Certificate c = certify(m, cage);
  EXPECT_GT(c.vertices_outside, 0);
  EXPECT_EQ(c.vertices_outside, brute_enclosure(m, cage).vertices_outside);
  EXPECT_FALSE(c.holds());
}

TEST(Certificate, SeesATouch) {
  // A triangle inside the tet, one corner exactly on its face x = 0.
  TetMesh tet{Points(4, 3), Tets(1, 4)};
  tet.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  tet.tets << 0, 1, 2, 3;
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << 0, 0.2, 0.2, 0.1, 0.2, 0.2, 0.1, 0.3, 0.2;
  m.triangles << 0, 1, 2;
  EXPECT_EQ(certify(m, tet).triangles_crossing, 1);
  EXPECT_EQ(certify(m, tet).vertices_outside, 0);
  m.positions(0, 0) = 5e-324;
  EXPECT_TRUE(certify(m, tet).holds());
}

TEST(Certificate, CountsWhatIsNoManifold) {
  TetMesh m{Points(7, 3), Tets(2, 4)};
  m.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0, 0, 0, -1;
  const SurfaceMesh inner = [] {
    SurfaceMesh s{Points(3, 3), Triangles(1, 3)};
    s.positions << 0.1, 0.1, 0.1, 0.2, 0.1, 0.1, 0.1, 0.2, 0.1;
    s.triangles << 0, 1, 2;
    return s;
  }();
  m.tets << 0, 1, 2, 3, 0, 4, 6, 5;  // two that share a vertex
  EXPECT_EQ(certify(inner, m).nonmanifold_vertices, 1);
  EXPECT_EQ(certify(inner, m).nonmanifold_edges, 0);
  m.tets << 0, 1, 2, 3, 0, 3, 5, 4;  // two that share an edge
  EXPECT_EQ(certify(inner, m).nonmanifold_edges, 1);
  EXPECT_FALSE(certify(inner, m).holds());
  m.tets.row(1) << 0, 1, 3, 5;  // two that share a face
  EXPECT_TRUE(certify(inner, m).holds());
  m.tets.row(1) << 0, 1, 5, 3;
  EXPECT_EQ(certify(inner, m).inverted_tets, 1);
}

TEST(Quality, KnowsTheAnglesOfKnownTets) {
  const DihedralRange regular = dihedral_range({1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1});
  const double expected = std::acos(1.0 / 3) * 180 / std::numbers::pi;
  EXPECT_NEAR(regular.min_deg, expected, 1e-12);
  EXPECT_NEAR(regular.max_deg, expected, 1e-12);
  const DihedralRange corner = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(corner.min_deg, std::acos(1 / std::sqrt(3.0)) * 180 / std::numbers::pi, 1e-12);
  EXPECT_NEAR(corner.max_deg, 90, 1e-12);
  const DihedralRange flat = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  EXPECT_EQ(flat.min_deg, 0);
  EXPECT_EQ(flat.max_deg, 180);
}

TEST(Quality, AnglesAreThoseBetweenTheOtherCornersSeenAlongAnEdge) {
  const std::array<Vec3, 4> needle{Vec3(0, 0, 0), Vec3(1, 0.1, 0), Vec3(0.4, 2, 0.1), Vec3(0.3, 0.2, 0.5)};
  std::array<double, 6> angles = dihedral_angles(needle);
  std::sort(angles.begin(), angles.end());
  std::vector<double> expected;  // at each edge, between the other corners seen along it
  for (const auto& [a, b, c, d] : std::vector<std::array<int, 4>>{
           {0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}}) {
    const Vec3 edge = (needle[b] - needle[a]).normalized();
    const auto across = [&](const Vec3& p) {
      return Vec3((p - needle[a]) - edge * edge.dot(p - needle[a])).normalized();
    };
    expected.push_back(std::acos(across(needle[c]).dot(across(needle[d]))) * 180 / M_PI);
  }
  std::sort(expected.begin(), expected.end());
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(angles[i], expected[i], 1e-10);
}

TEST(Lattice, TwelveTetsFillACellAndNeighboursAreMutual) {
  using namespace detail;
  const Lattice lattice{Vec3::Zero(), 2, {5, 5, 5}};
  const int cell = lattice.index({2, 2, 2});
  double volume_sum = 0;
  for (int which = 0; which < tets_a_cell; ++which) {
    const int tet = cell * tets_a_cell + which;
    const auto [a, b, c, d] = lattice.tet_positions(tet);
    EXPECT_NEAR(signed_volume(a, b, c, d), 8.0 / 12, 1e-15);
    volume_sum += signed_volume(a, b, c, d);
    for (int corner = 0; corner < 4; ++corner) {
      const int across = lattice.neighbour(tet, corner);
      ASSERT_GE(across, 0);
      int back = 0;
      for (int k = 0; k < 4; ++k) back += lattice.neighbour(across, k) == tet;
      EXPECT_EQ(back, 1);
      int shared = 0;
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) shared += lattice.tet_corner(tet, i) == lattice.tet_corner(across, j);
      EXPECT_EQ(shared, 3);
    }
  }
  EXPECT_NEAR(volume_sum, 8, 1e-14);
}

}  // namespace
}  // namespace limber::meshing
