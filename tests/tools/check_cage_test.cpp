// The independent checker is run as anyone runs it: on files.
#include <gtest/gtest.h>
#include <stdio.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "core/json.h"
#include "core/mesh_files.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/decompose.h"
#include "meshing/quality.h"
#include "tests/core/temporary_folder.h"
#include "tests/meshing/cage_models.h"
#include "tests/places.h"

namespace limber::meshing {
namespace {

Json run_checker(const std::string& arguments, int expected_exit) {
  FILE* pipe = popen(
      (std::string(limber_binary_dir) + "/tools/check_cage/check_cage " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) text += char(c);
  const int status = pclose(pipe);
  EXPECT_TRUE(WIFEXITED(status)) << text;
  EXPECT_EQ(WEXITSTATUS(status), expected_exit) << text;
  return expected_exit == 2 ? Json{{"error", text}} : Json::parse(text);
}

Json judged(const SurfaceMesh& surface, const TetMesh& cage, bool holds) {
  const TemporaryFolder folder;
  write_ply(folder / "surface.ply", surface);
  write_msh(folder / "cage.msh", cage);
  const Json report = run_checker(
      (folder / "surface.ply").string() + " --tets " + (folder / "cage.msh").string(), holds ? 0 : 1);
  EXPECT_EQ(report.at("cage").at("holds"), holds);
  return report.at("cage");
}

Json judged(const SurfaceMesh& surface, const std::vector<ConvexShell>& shells, bool holds) {
  const TemporaryFolder folder;
  write_ply(folder / "surface.ply", surface);
  write_obj(folder / "shells.obj", shells);
  return run_checker((folder / "surface.ply").string() + " --shells " + (folder / "shells.obj").string(),
                     holds ? 0 : 1)
      .at("shells");
}

Cage cage_of(const SurfaceMesh& m, int tets, CageMode mode = CageMode::lattice) {
  CageOptions options;
  options.mode = mode;
  options.tets = tets;
  return build_cage(m, {}, options);
}

// (0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size).
TetMesh one_tet(double size) {
  TetMesh mesh{Points::Zero(4, 3), Tets(1, 4)};
  for (int k = 0; k < 3; ++k) mesh.positions(k + 1, k) = size;
  mesh.tets << 0, 1, 2, 3;
  return mesh;
}

TetMesh both(const TetMesh& a, const TetMesh& b) {
  TetMesh m{Points(a.positions.rows() + b.positions.rows(), 3), Tets(a.tets.rows() + b.tets.rows(), 4)};
  m.positions << a.positions, b.positions;
  m.tets << a.tets, b.tets.array() + int(a.positions.rows());
  return m;
}

TetMesh shifted(TetMesh m, const Vec3& by) {
  m.positions.rowwise() += by.transpose();
  return m;
}

SurfaceMesh cube(double size, const Vec3& corner) {
  return moved(box_at_origin(Vec3::Constant(size)), corner);
}

SurfaceMesh inside_out(SurfaceMesh m) {
  m.triangles.col(0).swap(m.triangles.col(1));
  return m;
}

void expect_same(const Json& report, const SurfaceMesh& surface, const TetMesh& cage) {
  const Certificate c = certify(surface, cage);
  EXPECT_EQ(report.at("vertices_outside"), c.vertices_outside);
  EXPECT_EQ(report.at("triangles_meeting"), c.triangles_crossing);
  EXPECT_EQ(report.at("tets_not_positive"), c.inverted_tets);
  EXPECT_EQ(report.at("boundary_edges_not_manifold"), c.nonmanifold_edges);
  EXPECT_EQ(report.at("boundary_vertices_not_manifold"), c.nonmanifold_vertices);
  EXPECT_NEAR(report.at("min_dihedral_deg").get<double>(), c.min_dihedral_deg, 1e-6);
  EXPECT_NEAR(report.at("max_dihedral_deg").get<double>(), c.max_dihedral_deg, 1e-6);
  EXPECT_NEAR(report.at("median_dihedral_deg").get<double>(), measure_quality(cage).median_min_dihedral_deg,
              1e-6);
  EXPECT_NEAR(report.at("volume").get<double>(), volume(cage), 1e-12 * volume(cage));
}

TEST(CheckCage, AgreesWithTheCertificateOnGoodCages) {
  for (const auto& [name, m] : models())
    for (CageMode mode : {CageMode::lattice, CageMode::fast}) {
      SCOPED_TRACE(name);
      const Cage cage = cage_of(m, 300, mode);
      const Json report = judged(m, cage.mesh, true);
      expect_same(report, m, cage.mesh);
      EXPECT_EQ(report.at("components"), cage.components);
      EXPECT_EQ(report.at("boundary_triangles"), boundary_triangles(cage.mesh.tets).rows());
      if (cage.volume_ratio > 0)
        EXPECT_NEAR(report.at("volume_ratio").get<double>(), cage.volume_ratio, 1e-9);
      else
        EXPECT_TRUE(report.at("volume_ratio").is_null());
    }
}

// Each cage with one node of its boundary pulled to the model's middle.
TEST(CheckCage, AgreesWithTheCertificateOnACageWithAVertexPulledThroughTheSurface) {
  for (const auto& [name, m] : models()) {
    SCOPED_TRACE(name);
    TetMesh cage = cage_of(m, 300).mesh;
    cage.positions.row(boundary_triangles(cage.tets)(0, 0)) = bounding_box(m.positions).center();
    const Json report = judged(m, cage, false);
    const Certificate c = certify(m, cage);
    EXPECT_EQ(report.at("vertices_outside"), c.vertices_outside);
    EXPECT_EQ(report.at("triangles_meeting"), c.triangles_crossing);
    EXPECT_EQ(report.at("tets_not_positive"), c.inverted_tets);
  }
}

TEST(CheckCage, FindsASurfaceThatSticksOutWithAllItsVerticesInside) {
  // Two tets far apart, and a long triangle from one to the other.
  const TetMesh cage = both(one_tet(1), shifted(one_tet(1), {5, 0, 0}));
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << 0.1, 0.1, 0.1, 0.2, 0.1, 0.1, 5.1, 0.2, 0.1;
  m.triangles << 0, 1, 2;
  const Json report = judged(m, cage, false);
  EXPECT_EQ(report.at("vertices_outside"), 0);
  EXPECT_EQ(report.at("triangles_crossing"), 1);
  EXPECT_EQ(report.at("components"), 2);
}

TEST(CheckCage, TellsTouchingFromCrossingToTheLastBit) {
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << 0.1, 0.2, 0, 0.1, 0.1, 0.1, 0.2, 0.1, 0.1;  // its first corner on the face z = 0
  m.triangles << 0, 1, 2;
  const Json on = judged(m, one_tet(1), false);
  EXPECT_EQ(on.at("vertices_outside"), 0);
  EXPECT_EQ(on.at("triangles_meeting"), 1);
  EXPECT_EQ(on.at("triangles_crossing"), 0);

  constexpr double least = std::numeric_limits<double>::min();
  m.positions(0, 2) = least;
  judged(m, one_tet(1), true);

  m.positions(0, 2) = -least;
  const Json below = judged(m, one_tet(1), false);
  EXPECT_EQ(below.at("vertices_outside"), 1);
  EXPECT_EQ(below.at("triangles_crossing"), 1);

  // The slanted face x + y + z = 1 through a point that no double holds exactly but by luck: 1/4 + 1/4 + 1/2.
  m.positions.row(0) << 0.25, 0.25, 0.5;
  EXPECT_EQ(judged(m, one_tet(1), false).at("vertices_outside"), 0);
  m.positions(0, 2) = std::nextafter(0.5, 1);
  EXPECT_EQ(judged(m, one_tet(1), false).at("vertices_outside"), 1);
  m.positions(0, 2) = std::nextafter(0.5, 0);
  judged(m, one_tet(1), true);
}

TEST(CheckCage, TellsTouchingFromBesideInAPlaneToTheLastBit) {
  // (1 + e, 1) × (1, 1 − e) = −e²: the point lies beside the edge, though products of doubles say that it is
  // on it.
  constexpr double e = 0x1p-30;
  TetMesh cage = one_tet(1);
  cage.positions.row(1) << 1 + e, 1, 0;
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << 1, 1 - e, 0, 1.5, 0, 0, 2, 0, 0;
  m.triangles << 0, 1, 2;
  const Json beside = judged(m, cage, false);
  EXPECT_EQ(beside.at("vertices_outside"), 3);
  EXPECT_EQ(beside.at("triangles_meeting"), 0);
  m.positions.row(0) << 0.5 + e / 2, 0.5, 0;
  const Json on = judged(m, cage, false);
  EXPECT_EQ(on.at("vertices_outside"), 2);
  EXPECT_EQ(on.at("triangles_meeting"), 1);
  EXPECT_EQ(on.at("triangles_crossing"), 0);
}

TEST(CheckCage, CountsAFlippedTet) {
  const SurfaceMesh m = made_sphere(8);
  TetMesh cage = cage_of(m, 200).mesh;
  std::swap(cage.tets(7, 0), cage.tets(7, 1));
  const Json report = judged(m, cage, false);
  EXPECT_EQ(report.at("tets_not_positive"), 1);
  EXPECT_EQ(report.at("vertices_outside"), 0);  // it still holds what it held
}

TEST(CheckCage, TakesTheOtherConventionOfTurning) {
  const SurfaceMesh m = made_sphere(8);
  TetMesh cage = cage_of(m, 200).mesh;
  const double expected = volume(cage);
  cage.tets.col(0).swap(cage.tets.col(1));
  EXPECT_NEAR(judged(m, cage, true).at("volume").get<double>(), expected, 1e-12);
}

TEST(CheckCage, CountsTheFacesOfATetThatIsThereTwice) {
  const SurfaceMesh m = made_sphere(8);
  TetMesh cage = cage_of(m, 200).mesh;
  cage.tets.conservativeResize(cage.tets.rows() + 1, 4);
  cage.tets.bottomRows(1) = cage.tets.row(7);
  EXPECT_EQ(judged(m, cage, false).at("faces_overfull"), 4);

  TetMesh alone = one_tet(1);  // all four faces lie at the boundary
  alone.tets.conservativeResize(2, 4);
  alone.tets.row(1) << 1, 2, 0, 3;
  EXPECT_EQ(judged(cube(0.1, {0.1, 0.1, 0.1}), alone, false).at("faces_overfull"), 4);
}

TEST(CheckCage, CountsEdgesAndVerticesInWhichTetsMerelyMeet) {
  const SurfaceMesh m = cube(0.1, {0.05, 0.05, 0.05});
  TetMesh cage = both(one_tet(1), one_tet(-1));  // the second one's turn is the other way
  std::swap(cage.tets(1, 0), cage.tets(1, 1));
  cage.tets(1, 1) = 0;  // its corner at the origin is the first one's
  Json report = judged(m, cage, false);
  EXPECT_EQ(report.at("boundary_vertices_not_manifold"), 1);
  EXPECT_EQ(report.at("boundary_edges_not_manifold"), 0);

  cage.positions.row(5) << 1, 0, 0;  // and so is the edge along x
  cage.tets.row(1) << 0, 1, 7, 6;
  cage.positions.row(6) << 0, -1, 0;
  cage.positions.row(7) << 0, 0, -1;
  std::swap(cage.tets(1, 2), cage.tets(1, 3));
  report = judged(m, cage, false);
  EXPECT_EQ(report.at("tets_not_positive"), 0);
  EXPECT_EQ(report.at("boundary_edges_not_manifold"), 1);
}

TEST(CheckCage, FindsACageThatOverlapsItself) {
  const SurfaceMesh m = cube(0.1, {0.05, 0.05, 0.05});
  const Json report = judged(m, both(one_tet(1), shifted(one_tet(1), {0.3, 0.2, -0.1})), false);
  EXPECT_GT(report.at("boundary_pairs_crossing"), 0);
  EXPECT_EQ(report.at("faces_overfull"), 0);
}

// One tet round models of two pieces: the air joins them or the solid does.
TEST(CheckCage, GluedIsWhatOnlyTheAirJoins) {
  const SurfaceMesh apart = joined(cube(0.1, {0.1, 0.1, 0.1}), cube(0.1, {0.4, 0.1, 0.1}));
  EXPECT_EQ(judged(apart, one_tet(1), true).at("glued_share"), 1);

  const SurfaceMesh hollow = joined(cube(0.2, {0.1, 0.1, 0.1}), inside_out(cube(0.18, {0.11, 0.11, 0.11})));
  EXPECT_EQ(judged(hollow, one_tet(1), true).at("glued_share"), 0);

  const SurfaceMesh stone_in_a_hollow = joined(hollow, cube(0.1, {0.15, 0.15, 0.15}));
  EXPECT_EQ(judged(stone_in_a_hollow, one_tet(1), true).at("glued_share"), 1);

  // Whichever way the triangles turn.
  const Json turned = judged(inside_out(hollow), one_tet(1), true);
  EXPECT_EQ(turned.at("glued_share"), 0);
  EXPECT_NEAR(turned.at("volume_ratio").get<double>(), 1.0 / 6 / (std::pow(0.2, 3) - std::pow(0.18, 3)),
              1e-9);
  EXPECT_EQ(judged(inside_out(stone_in_a_hollow), one_tet(1), true).at("glued_share"), 1);
  const auto every_other_turned = [](SurfaceMesh m) {
    for (Eigen::Index t = 0; t < m.triangles.rows(); t += 2) std::swap(m.triangles(t, 0), m.triangles(t, 1));
    return m;
  };
  EXPECT_EQ(judged(every_other_turned(hollow), one_tet(1), true).at("glued_share"), 0);
  EXPECT_EQ(judged(every_other_turned(stone_in_a_hollow), one_tet(1), true).at("glued_share"), 1);

  const auto open = [](SurfaceMesh closed) {
    closed.triangles.conservativeResize(closed.triangles.rows() - 1, 3);
    return closed;
  };
  EXPECT_EQ(judged(open(apart), one_tet(1), true).at("glued_share"), 1);
  EXPECT_EQ(judged(open(hollow), one_tet(1), true).at("glued_share"), 0);
  EXPECT_EQ(judged(inside_out(open(hollow)), one_tet(1), true).at("glued_share"), 0);

  // Two fingers of one hand: within the small tet only the air joins them, in the large one their root does.
  const SurfaceMesh hand = joined(joined(moved(box_at_origin({0.5, 0.2, 0.1}), {0.1, 0.1, 0.1}),
                                         moved(box_at_origin({0.1, 0.1, 0.4}), {0.1, 0.15, 0.15})),
                                  moved(box_at_origin({0.1, 0.1, 0.4}), {0.5, 0.15, 0.15}));
  EXPECT_EQ(judged(hand, one_tet(2), true).at("glued_share"), 0);
  EXPECT_EQ(judged(hand, shifted(one_tet(1.1), {0, 0, 0.25}), false).at("glued_share"), 1);
}

TEST(CheckCage, ReadsTheSameFromEveryForm) {
  const TemporaryFolder folder;
  const auto text = [&](const std::string& name) { return std::ofstream(folder / name); };
  const SurfaceMesh m = made_sphere(6);
  const TetMesh cage = cage_of(m, 100).mesh;
  write_ply(folder / "m.ply", m);
  write_obj(folder / "m.obj", m);
  {
    std::ofstream off = text("m.off"), stl = text("m.stl"), ascii = text("ascii.ply");
    off.precision(17), stl.precision(17), ascii.precision(17);
    off << "COFF # coloured\n" << m.positions.rows() << " " << m.triangles.rows() << " 0\n";
    ascii << "ply\nformat ascii 1.0\nelement vertex " << m.positions.rows()
          << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << m.triangles.rows()
          << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& p : m.positions.rowwise()) off << p << " 255 0 0\n", ascii << p << "\n";
    stl << "solid m\n";
    for (const auto& t : m.triangles.rowwise()) {
      off << "3 " << t << "\n", ascii << "3 " << t << "\n";
      stl << "facet normal 0 0 0\nouter loop\n";
      for (int v : t) stl << "vertex " << m.positions.row(v) << "\n";
      stl << "endloop\nendfacet\n";
    }
    std::ofstream medit = text("c.mesh"), node = text("c.node"), ele = text("c.ele");
    medit.precision(17), node.precision(17);
    medit << "MeshVersionFormatted 2\nDimension 3\nVertices " << cage.positions.rows() << "\n";
    node << cage.positions.rows() << " 3 0 0\n";
    for (Eigen::Index v = 0; v < cage.positions.rows(); ++v) {
      medit << cage.positions.row(v) << " 0\n";
      node << v + 1 << " " << cage.positions.row(v) << "\n";
    }
    medit << "Tetrahedra " << cage.tets.rows() << "\n";
    ele << cage.tets.rows() << " 4 0\n";
    for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
      medit << cage.tets.row(t).array() + 1 << " 0\n";
      ele << t + 1 << " " << cage.tets.row(t).array() + 1 << "\n";
    }
    medit << "End\n";
  }
  write_msh(folder / "c.msh", cage);
  const auto path = [&](const char* name) { return (folder / name).string(); };
  const Json expected = run_checker(path("m.ply") + " --tets " + path("c.msh"), 0);
  for (const char* surface : {"m.obj", "m.off", "m.stl", "ascii.ply"}) {
    SCOPED_TRACE(surface);
    Json report = run_checker(path(surface) + " --tets " + path("c.msh"), 0);
    EXPECT_EQ(report.at("surface").at("vertices"), m.positions.rows());
    EXPECT_NEAR(report.at("surface").at("volume").get<double>(), volume(m), 1e-12);
    EXPECT_EQ(report.at("cage").at("volume"), expected.at("cage").at("volume"));
  }
  for (const char* tets : {"c.mesh", "c.ele"}) {
    SCOPED_TRACE(tets);
    EXPECT_EQ(run_checker(path("m.ply") + " --tets " + path(tets), 0), expected);
  }
  EXPECT_NE(run_checker(path("m.ply") + " --tets " + path("missing.msh"), 2)
                .at("error")
                .get<std::string>()
                .find("missing.msh: cannot be read"),
            std::string::npos);
  text("bad.off") << "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n";
  EXPECT_NE(run_checker(path("bad.off"), 2).at("error").get<std::string>().find("names vertex 3 of 3"),
            std::string::npos);
}

TEST(CheckCage, RefusesEveryTruncatedFile) {
  const TemporaryFolder folder;
  const SurfaceMesh m = made_sphere(3);
  const TetMesh cage = cage_of(m, 60).mesh;
  write_ply(folder / "m.ply", m);
  write_msh(folder / "c.msh", cage);
  for (const char* name : {"m.ply", "c.msh"}) {
    const std::string whole = read_file(folder / name);
    for (std::size_t size = 0; size < whole.size() - 15; size += whole.size() / 40) {
      SCOPED_TRACE(fmt::format("{} of {} bytes of {}", size, whole.size(), name));
      std::ofstream(folder / (std::string("cut_") + name), std::ios::binary) << whole.substr(0, size);
      const bool surface = name == std::string("m.ply");
      const std::string file = (folder / (std::string("cut_") + name)).string();
      run_checker(surface ? file : (folder / "m.ply").string() + " --tets " + file, 2);
    }
  }
}

TEST(CheckCage, CutsAPolygonInItsPlane) {
  // A prism of height 1 over an arrowhead of area 1/4. The triangle of the first three corners of each
  // polygon, and those of a fan from its first corner, leave it, which adds to the area and not to the signed
  // volume.
  const TemporaryFolder folder;
  const fs::path file = folder / "arrow.off";
  std::ofstream(file) << "OFF\n8 6 0\n1 -0.5 0\n0.5 0 0\n1 0.5 0\n0 0 0\n1 -0.5 1\n0.5 0 1\n1 0.5 1\n0 0 1\n"
                         "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
  const Json surface = run_checker(file.string(), 0).at("surface");
  EXPECT_EQ(surface.at("triangles"), 12);
  EXPECT_NEAR(surface.at("volume").get<double>(), 0.25, 1e-15);
  EXPECT_NEAR(surface.at("area").get<double>(), 0.5 + 2 * (std::sqrt(1.25) + std::sqrt(0.5)), 1e-14);
  EXPECT_EQ(surface.at("closed"), true);
}

TEST(CheckCage, ProvesTheCoverOfADecomposition) {
  std::map<std::string, SurfaceMesh> parted = models();
  for (const char* one_shell : {"sphere", "box", "hemisphere", "needle"}) parted.erase(one_shell);
  parted["L"] = made_l_prism();
  for (const auto& [name, m] : parted) {
    SCOPED_TRACE(name);
    Decomposition d = decompose(m, {.max_shells = 8});
    const Json report = judged(m, d.shells, true);
    EXPECT_EQ(report.at("shells"), d.shells.size());
    EXPECT_NEAR(report.at("sum_of_volumes").get<double>(), d.sum_of_hull_volumes, 1e-9);
    EXPECT_NEAR(report.at("mean_overshoot").get<double>(), d.mean_overshoot, 0.05 * d.mean_overshoot);

    d.shells.pop_back();
    const Json less = judged(m, d.shells, false);
    EXPECT_GT(less.at("vertices_uncovered"), 0);
    EXPECT_GT(less.at("triangles_uncovered"), 0);
  }
}

ConvexShell shell_of(const SurfaceMesh& m) { return {m.positions, m.triangles}; }

TEST(CheckCage, FindsWhatShellsLeaveBareBetweenThem) {
  SurfaceMesh m{Points(3, 3), Triangles(1, 3)};
  m.positions << 0.5, 0.5, 0.5, 0.6, 0.5, 0.5, 1.5, 0.6, 0.5;
  m.triangles << 0, 1, 2;
  const ConvexShell left = shell_of(cube(1, {0, 0, 0}));
  const Json closed = judged(m, {left, shell_of(cube(1, {1, 0, 0}))}, true);  // they share a side
  EXPECT_EQ(closed.at("triangles_uncovered"), 0);
  const Json open = judged(m, {left, shell_of(cube(1, {std::nextafter(1.0, 2.0), 0, 0}))}, false);
  EXPECT_EQ(open.at("vertices_uncovered"), 0);
  EXPECT_EQ(open.at("triangles_uncovered"), 1);
}

TEST(CheckCage, FindsAShellThatIsNotConvex) {
  SurfaceMesh dented = made_sphere(6);
  dented.positions.row(0) *= 0.5;
  EXPECT_EQ(judged(cube(0.1, {0, 0, 0}), {shell_of(dented)}, false).at("shells_not_convex"), 1);
  SurfaceMesh open = cube(1, {0, 0, 0});
  open.triangles.conservativeResize(11, 3);
  EXPECT_EQ(judged(cube(0.1, {0.1, 0.1, 0.1}), {shell_of(open)}, false).at("shells_not_convex"), 1);
}

TEST(CheckCage, OvershootIsTheDistanceFromTheUnionsBoundary) {
  // A unit cube in one that stands off it by a tenth: from 0.1 over the sides to 0.1 √3 at the corners.
  const SurfaceMesh m = cube(1, {0, 0, 0});
  const double diagonal = std::sqrt(3.0);
  const Json one = judged(m, {shell_of(cube(1.2, {-0.1, -0.1, -0.1}))}, true);
  EXPECT_GT(one.at("mean_overshoot"), 0.1 / diagonal);
  EXPECT_LT(one.at("mean_overshoot"), 0.11 / diagonal);
  EXPECT_NEAR(one.at("max_overshoot").get<double>(), 0.1, 0.002);  // 0.1 √3 over √3

  // A unit sphere in a cube of side 4, whose corners are 2 √3 from the middle; as the sphere is of chords, a
  // bit more.
  const Json far = judged(made_sphere(24), {shell_of(cube(4, {-2, -2, -2}))}, true);
  EXPECT_NEAR(far.at("max_overshoot").get<double>(), (2 * diagonal - 1) / (2 * diagonal), 0.02);

  // Two halves that overlap: what lies in the other does not count, and all else lies on the cube's sides.
  const ConvexShell low = shell_of(box_at_origin({1, 1, 0.6})),
                    high = shell_of(moved(box_at_origin({1, 1, 0.6}), {0, 0, 0.4}));
  const Json two = judged(m, {low, high}, true);
  EXPECT_LT(two.at("max_overshoot"), 1e-12);
  EXPECT_GT(two.at("samples"), 10000);
}

}  // namespace
}  // namespace limber::meshing
