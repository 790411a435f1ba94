#include "meshing/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/random.h"
#include "meshing/repair.h"
#include "tests/meshing/import_meshes.h"

namespace limber::meshing {
namespace {

using testing::Contains;
using testing::HasSubstr;

fs::path written(const std::string& name, const std::string& content) {
  const fs::path folder = fs::path(testing::TempDir()) / "limber_import";
  make_folder(folder);
  write_file(folder / name, content);
  return folder / name;
}

std::string complaint_about(const std::string& name, const std::string& content) {
  try {
    import_model(written(name, content));
  } catch (const InputError& e) {
    return e.what();
  }
  return "no InputError";
}

// The same triangles as sets of points, each turned so that its smallest corner is first: what order cannot
// change.
std::multiset<std::array<std::array<double, 3>, 3>> triangles_as_points(const SurfaceMesh& mesh) {
  std::multiset<std::array<std::array<double, 3>, 3>> all;
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    std::array<std::array<double, 3>, 3> corners;
    for (int c = 0; c < 3; ++c)
      for (int axis = 0; axis < 3; ++axis) corners[c][axis] = mesh.positions(mesh.triangles(t, c), axis);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.insert(corners);
  }
  return all;
}

void expect_no_defect(const ImportedModel& model) {
  EXPECT_THAT(sentences(model.left), testing::IsEmpty());
  EXPECT_THAT(model.warnings, testing::IsEmpty());
}

// ── a good model stays as it is
// ───────────────────────────────────────────────────────────────────────────────────

TEST(Import, LeavesACleanMeshUntouched) {
  for (const SurfaceMesh& mesh : {cube(), sphere(3), torus()}) {
    const ImportedModel model = clean(mesh);
    EXPECT_EQ(hash_of(model.surface), hash_of(mesh));
    expect_no_defect(model);
    EXPECT_THAT(model.mended, testing::IsEmpty());
  }
}

TEST(Import, CleaningTwiceIsCleaningOnce) {
  SurfaceMesh mesh =
      merged({sphere(3), moved(sphere(2), {0.3, 0, 0}), moved(turned_inside_out(cube()), {5, 0, 0})});
  mesh = merged({mesh, moved(sphere(1), {0, 0, 0})});
  const ImportedModel once = clean(mesh), twice = clean(once.surface);
  EXPECT_EQ(hash_of(once.surface), hash_of(twice.surface));
  EXPECT_EQ(to_json(once.left), to_json(twice.left));
}

TEST(Import, SameBytesWhateverTheTimesItRuns) {
  const SurfaceMesh soup = shuffled(exploded(torus()), 3);
  EXPECT_EQ(hash_of(clean(soup).surface), hash_of(clean(soup).surface));
}

// ── weld
// ──────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(Weld, MakesASoupOfLoneTrianglesTheSurfaceItCameFrom) {
  for (const SurfaceMesh& mesh : {cube(), sphere(3), torus()}) {
    const ImportedModel model = clean(exploded(mesh));
    EXPECT_EQ(model.surface.positions.rows(), mesh.positions.rows());
    EXPECT_EQ(triangles_as_points(model.surface), triangles_as_points(mesh));
    EXPECT_EQ(model.found.duplicate_vertices.count, 3 * mesh.triangles.rows() - mesh.positions.rows());
    expect_no_defect(model);
  }
}

TEST(Weld, OrderOfTheSoupDoesNotMatter) {
  const SurfaceMesh soup = exploded(torus());
  const auto expected = triangles_as_points(clean(soup).surface);
  for (const int seed : {1, 2, 3})
    EXPECT_EQ(triangles_as_points(clean(shuffled(soup, seed)).surface), expected);
}

TEST(Weld, ToleranceFollowsTheModelWhereverAndHoweverLargeItIs) {
  for (const double scale : {1e-12, 1e-3, 1.0, 1e9, 1e20}) {
    SCOPED_TRACE(scale);
    const SurfaceMesh exact = scaled(exploded(sphere(2)), scale);
    EXPECT_EQ(clean(jittered(exact, 1e-9 * scale, 5)).left.boundary_edges.count, 0) << "below the tolerance";
    EXPECT_GT(clean(jittered(exact, 1e-6 * scale, 5)).left.boundary_edges.count, 0) << "above the tolerance";
  }
  const ImportedModel far = clean(moved(exploded(sphere(2)), {1e6, -1e6, 1e6}));
  EXPECT_EQ(far.surface.positions.rows(), sphere(2).positions.rows());
}

// Two balls that cross, a patch turned over, a hole, a doubled face: the same report in any unit, anywhere.
TEST(Import, TheReportDoesNotDependOnUnitOrPlace) {
  SurfaceMesh mesh = merged({sphere(3), moved(sphere(2), {0.913, 0.1, 0.2})});
  mesh = without_triangle(mesh, 40);
  for (const int t : {7, 8, 9}) std::swap(mesh.triangles(t, 0), mesh.triangles(t, 1));
  mesh.triangles.row(100) = mesh.triangles.row(99);
  const auto figures = [](const SurfaceMesh& m) {
    const ImportedModel model = clean(m);
    std::vector<std::int64_t> counts;
    for (const Json& report : {to_json(model.found), to_json(model.left)})
      for (const Json& defect : report)
        if (defect.is_number() || defect.is_object())
          counts.push_back(defect.is_number() ? defect.get<std::int64_t>()
                                              : defect.at("count").get<std::int64_t>());
    return counts;
  };
  const auto expected = figures(mesh);
  EXPECT_GT(clean(mesh).left.self_intersecting_pairs.count, 10);
  for (const double unit : {1e-9, 1e-3, 1e9}) EXPECT_EQ(figures(scaled(mesh, unit)), expected) << unit;
  for (const double unit : {1e-9, 1.0, 1e9})
    EXPECT_EQ(figures(scaled(moved(mesh, {1e6, -2e6, 3e6}), unit)), expected) << unit << ", far";
}

TEST(Weld, AStrayVertexFarAwayDoesNotMeltTheModel) {
  SurfaceMesh mesh = sphere(2);
  mesh.positions.row(0) << 1e12, 0, 0;
  EXPECT_EQ(clean(mesh).surface.positions.rows(), mesh.positions.rows());
}

TEST(Weld, IsTheSameAsComparingAllPairs) {
  Rng rng(7, 0);
  const double tolerance = 0.02;
  Points points(1500, 3);
  for (int v = 0; v < points.rows(); ++v)
    points.row(v) = Vec3(rng.uniform(-.5, .5), rng.uniform(-.5, .5), rng.uniform(-.2, .2));
  const std::vector<int> welded = weld(points, tolerance);
  std::vector<int> slow(points.rows());
  for (int v = 0; v < points.rows(); ++v) slow[v] = v;
  for (bool changed = true; changed;) {
    changed = false;
    for (int v = 0; v < points.rows(); ++v)
      for (int w = 0; w < v; ++w)
        if ((points.row(v) - points.row(w)).norm() <= tolerance && slow[v] != slow[w]) {
          slow[v] = slow[w] = std::min(slow[v], slow[w]);
          changed = true;
        }
  }
  EXPECT_EQ(welded, slow);
  EXPECT_LT(std::set<int>(slow.begin(), slow.end()).size(), std::size_t(points.rows() - 20))
      << "nothing to weld";
}

// ── faces
// ─────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(Repair, KeepsOneOfEachFaceThatIsThereTwice) {
  const SurfaceMesh doubled = merged({cube(), cube()}),
                    both_ways = merged({cube(), turned_inside_out(cube())});
  for (const SurfaceMesh& mesh : {doubled, both_ways}) {
    const ImportedModel model = clean(mesh);
    EXPECT_EQ(model.found.duplicate_faces.count, 12);
    EXPECT_EQ(model.found.non_manifold_edges.count, 18);
    EXPECT_EQ(model.surface.triangles.rows(), 12);
    EXPECT_NEAR(volume(model.surface), 1, 1e-12);
    expect_no_defect(model);
  }
}

TEST(Repair, AFlatTriangleGoesWithoutLeavingACrack) {
  // The cube's edge 0–1 gets a middle vertex on one side only; a triangle of no area closes the crack.
  SurfaceMesh mesh = cube();
  const auto [left, right] = triangles_at_edge(mesh, 0, 1);
  mesh.positions.conservativeResize(9, 3);
  mesh.positions.row(8) = 0.5 * (mesh.positions.row(0) + mesh.positions.row(1));
  const SurfaceMesh split = split_side(mesh, left, 0, 1, 8);
  ASSERT_NE(left, right);
  const ImportedModel cracked = clean(split);
  EXPECT_EQ(cracked.left.boundary_edges.count, 3);
  SurfaceMesh closed = split;
  closed.triangles.conservativeResize(split.triangles.rows() + 1, 3);
  const bool runs_0_to_1 = runs_along(mesh, left, 0, 1);
  closed.triangles.row(split.triangles.rows()) << (runs_0_to_1 ? 0 : 1), (runs_0_to_1 ? 1 : 0), 8;
  const ImportedModel model = clean(closed);
  EXPECT_EQ(model.found.degenerate_faces.count, 1);
  EXPECT_EQ(model.found.boundary_edges.count, 0);
  EXPECT_EQ(model.surface.triangles.rows(), 14);
  EXPECT_NEAR(volume(model.surface), 1, 1e-12);
  expect_no_defect(model);
}

TEST(Repair, DropsVerticesInNoFaceAndKeepsTheOrderOfTheOthers) {
  SurfaceMesh mesh = cube();
  Points spread(16, 3);
  for (int v = 0; v < 8; ++v)
    spread.row(2 * v) = mesh.positions.row(v), spread.row(2 * v + 1) << 10 + v, 0, 0;
  const SurfaceMesh loose{spread, (2 * mesh.triangles.array()).matrix()};
  const ImportedModel model = clean(loose);
  EXPECT_EQ(hash_of(model.surface), hash_of(mesh));
  EXPECT_EQ(model.found.isolated_vertices.count, 8);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("8 of 16 vertices are in no face")));
}

TEST(Repair, InfiniteVerticesGoWithTheirFacesAndAreCounted) {
  SurfaceMesh mesh = sphere(3);
  const ImportedModel whole = clean(mesh);
  mesh.positions.row(5) << 0, std::nan(""), 0;
  mesh.positions.row(77) << 0, 0, INFINITY;
  const ImportedModel model = clean(mesh);
  EXPECT_EQ(model.found.non_finite_vertices.count, 2);
  EXPECT_EQ(model.surface.positions.rows(), whole.surface.positions.rows() - 2);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("2 vertices that are not finite and")));
  for (int v = 0; v < mesh.positions.rows(); v += 2) mesh.positions(v, 0) = 1e300;
  EXPECT_THROW(clean(mesh), InputError);
}

// ── orientation
// ───────────────────────────────────────────────────────────────────────────────────────────────────

TEST(Orient, AnyMixOfFlippedTrianglesComesOutFacingOutward) {
  for (const SurfaceMesh& mesh : {cube(), sphere(3), torus()})
    for (const int seed : {1, 2, 3}) {
      const SurfaceMesh mixed = with_random_flips(mesh, seed);
      const ImportedModel model = clean(mixed);
      EXPECT_GT(model.found.misoriented_edges.count, 0);
      EXPECT_EQ(triangles_as_points(model.surface), triangles_as_points(mesh));
      expect_no_defect(model);
    }
}

TEST(Orient, AComponentThatIsInsideOutIsTurned) {
  const SurfaceMesh good = merged({sphere(2), moved(cube(), {4, 0, 0})});
  const ImportedModel model = clean(merged({sphere(2), moved(turned_inside_out(cube()), {4, 0, 0})}));
  EXPECT_EQ(model.found.inward_components.count, 1);
  EXPECT_EQ(triangles_as_points(model.surface), triangles_as_points(good));
}

TEST(Orient, NestedShells) {
  const SurfaceMesh outer = scaled(sphere(3), 4), middle = scaled(sphere(3), 2), inner = sphere(2);
  const double shell = volume(outer) - volume(middle);
  // A cavity stays a cavity, what lies in it is a solid, and a solid in a solid stays one.
  const SurfaceMesh hollow = merged({outer, turned_inside_out(middle)});
  EXPECT_EQ(hash_of(clean(hollow).surface), hash_of(hollow));
  EXPECT_THAT(clean(hollow).warnings, Contains(HasSubstr("taken as a cavity")));
  const SurfaceMesh kernel = merged({outer, turned_inside_out(middle), inner});
  EXPECT_EQ(hash_of(clean(kernel).surface), hash_of(kernel));
  const SurfaceMesh inverted_kernel = merged({outer, turned_inside_out(middle), turned_inside_out(inner)});
  EXPECT_NEAR(volume(clean(inverted_kernel).surface), shell + volume(inner), 1e-9);
  const SurfaceMesh solids = merged({outer, inner});
  EXPECT_EQ(hash_of(clean(solids).surface), hash_of(solids));
  const SurfaceMesh inner_first = merged({inner, turned_inside_out(middle), outer});
  EXPECT_EQ(hash_of(clean(inner_first).surface), hash_of(inner_first))
      << "the order in the file does not matter";
  for (const auto& [mesh, count] : {std::pair{hollow, 1}, {kernel, 2}, {inverted_kernel, 2}, {solids, 1}}) {
    const ImportedModel model = clean(mesh);
    EXPECT_EQ(model.found.inner_components.count, count);
    EXPECT_EQ(model.left.inner_components.count, count);
    EXPECT_EQ(int(model.found.inner_components.places.size()), count);
  }
  EXPECT_EQ(clean(merged({outer, moved(inner, {9, 0, 0})})).found.inner_components.count, 0);
  // Inside out as a whole: the same solid again.
  EXPECT_EQ(triangles_as_points(clean(turned_inside_out(kernel)).surface), triangles_as_points(kernel));
}

// So many that a tree answers for the outer one, and boxes of boxes for which to ask.
TEST(Orient, ManyBubblesInASolid) {
  std::vector<SurfaceMesh> parts{scaled(sphere(3), 40)};
  for (int i = 0; i < 60; ++i) {
    const SurfaceMesh bubble =
        moved(sphere(1), {double(i % 5) * 3 - 6, double(i / 5 % 4) * 3 - 5, double(i / 20) * 3});
    parts.push_back(i % 2 ? turned_inside_out(bubble) : bubble);
  }
  const SurfaceMesh mesh = merged(parts);
  const ImportedModel model = clean(mesh);
  EXPECT_EQ(hash_of(model.surface), hash_of(mesh));
  EXPECT_EQ(model.left.inner_components.count, 60);
  EXPECT_EQ(model.left.inward_components.count, 30);
  EXPECT_EQ(triangles_as_points(clean(turned_inside_out(mesh)).surface), triangles_as_points(mesh));
}

TEST(Orient, AnOpenSurfaceIsTurnedOnlyWhenItIsNearlyClosed) {
  const SurfaceMesh with_hole = without_triangle(sphere(3), 17);
  EXPECT_EQ(triangles_as_points(clean(turned_inside_out(with_hole)).surface), triangles_as_points(with_hole));
  const SurfaceMesh bowl = lower_half(sphere(3));
  EXPECT_EQ(triangles_as_points(clean(bowl).surface), triangles_as_points(bowl));
  EXPECT_EQ(triangles_as_points(clean(turned_inside_out(bowl)).surface),
            triangles_as_points(turned_inside_out(bowl)));
}

TEST(Orient, AMoebiusStripIsReportedAndLeftAlone) {
  const SurfaceMesh strip = moebius_strip();
  const ImportedModel model = clean(strip);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("one-sided")));
  EXPECT_EQ(hash_of(model.surface), hash_of(strip));
}

// ── polygons
// ──────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(Triangulate, KeepsTheAreaOfAnyPolygonAndOverlapsNowhere) {
  for (const auto& [name, polygon] : polygons()) {
    SCOPED_TRACE(name);
    for (const bool reversed : {false, true}) {
      std::string obj, face = "f";
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const auto& p = polygon[reversed ? polygon.size() - 1 - i : i];
        obj += fmt::format("v {} {} {}\n", p.x(), p.y(), 0.3 * p.x() - 0.2 * p.y());
        face += fmt::format(" {}", i + 1);
      }
      const ImportedModel model = import_model(written("polygon.obj", obj + face + "\n"));
      EXPECT_EQ(model.surface.triangles.rows(), Eigen::Index(polygon.size()) - 2);
      EXPECT_EQ(model.found.n_gons.count, 1);
      EXPECT_EQ(model.left.self_intersecting_pairs.count, 0);
      // In the plane, the signed area must be that of the polygon (shoelace), and no triangle may turn the
      // other way.
      double shoelace = 0, triangles = 0;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        shoelace += 0.5 * (a.x() * b.y() - a.y() * b.x()) * (reversed ? -1 : 1);
      }
      for (int t = 0; t < model.surface.triangles.rows(); ++t) {
        const auto p = [&](int c) {
          return Vec3(model.surface.positions.row(model.surface.triangles(t, c)));
        };
        const double signed_area = 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).z();
        EXPECT_GT(signed_area * shoelace, 0);
        triangles += signed_area;
      }
      EXPECT_NEAR(triangles, shoelace, 1e-9 * std::abs(shoelace));
    }
  }
}

TEST(Triangulate, APolygonThatCrossesItselfOrHasNoAreaEndsToo) {
  for (const int n : {5, 50, 3000}) {
    std::string obj, star = "f", flat = "f";
    Rng rng(11, std::uint64_t(n));
    for (int i = 0; i < n; ++i) obj += fmt::format("v {} {} 0\n", rng.uniform(), rng.uniform());
    for (int i = 0; i < n; ++i)
      star += fmt::format(" {}", 1 + (2 * i) % n), flat += fmt::format(" {}", 1 + i % 2);
    EXPECT_NO_THROW(
        import_model(written("star.obj", obj + star + "\n"), {.count_self_intersections = false}));
    EXPECT_THAT(complaint_about("flat.obj", obj + flat + "\n"), HasSubstr("has an area"));
  }
}

// ── options
// ───────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(Import, ScaleAndAxes) {
  const SurfaceMesh mesh = sphere(2);
  const ImportedModel model = clean(mesh, {.scale = 0.001, .y_up = true});
  EXPECT_NEAR(volume(model.surface), 1e-9 * volume(mesh), 1e-20) << "turned, not mirrored";
  EXPECT_LT((model.surface.positions.col(2) - 0.001 * mesh.positions.col(1)).norm(), 1e-15);
  EXPECT_LT((model.surface.positions.col(1) + 0.001 * mesh.positions.col(2)).norm(), 1e-15);
  for (const double bad : {0.0, -1.0, std::nan(""), double(INFINITY)})
    EXPECT_THROW(clean(mesh, {.scale = bad}), InputError);
  EXPECT_THROW(clean(mesh, {.scale = 1e-40}), InputError) << "too small to compute with";
}

}  // namespace
}  // namespace limber::meshing
