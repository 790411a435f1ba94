#include "meshing/decompose.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "core/threads.h"
#include "meshing/convex_hull.h"
#include "meshing/shell_check.h"
#include "meshing/winding_number.h"
#include "tests/meshing/cage_models.h"
#include "tests/meshing/made_meshes.h"
#include "tests/meshing/shell_laws.h"

namespace limber::meshing {
namespace {

double volume_of(const ConvexShell& shell) { return volume(SurfaceMesh{shell.vertices, shell.triangles}); }

// Every corner, and random points of every triangle, lie in a shell: each against every half-space, in long
// double.
void expect_covered(const SurfaceMesh& mesh, const Decomposition& result) {
  EXPECT_EQ(result.vertices_uncovered, 0);
  EXPECT_EQ(result.triangles_uncovered, 0);
  Rng rng(5, 0);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    Eigen::Matrix<long double, 3, 3> corners;
    for (int k = 0; k < 3; ++k)
      corners.col(k) = mesh.positions.row(mesh.triangles(t, k)).transpose().cast<long double>();
    const auto covered = [&](const Long3& weights) {
      const Long3 p = corners * weights;
      return std::any_of(result.shells.begin(), result.shells.end(),
                         [&](const auto& s) { return holds(s, p); });
    };
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(covered(Long3::Unit(k))) << "triangle " << t << ", corner " << k;
    for (int i = 0; i < 3; ++i) {
      long double x = rng.uniform(), y = rng.uniform();
      if (x + y > 1) x = 1 - x, y = 1 - y;
      EXPECT_TRUE(covered({x, y, 1 - x - y})) << "triangle " << t << " at " << double(x) << " " << double(y);
    }
  }
}

void expect_lawful(const SurfaceMesh& mesh, const DecomposeOptions& options, const Decomposition& result) {
  EXPECT_LE(int(result.shells.size()), options.max_shells);
  EXPECT_GE(result.shells.size(), 1u);
  double sum = 0;
  const Box box = bounding_box(mesh.positions);
  const double farthest = mesh.positions.cwiseAbs().maxCoeff();
  for (const ConvexShell& shell : result.shells) {
    expect_convex(shell);
    if (farthest < 1e3 * box.diagonal()) {  // convex in files of floats, too
      EXPECT_TRUE(holds_in_float32(shell));
    }
    EXPECT_LE(shell.vertices.rows(), options.max_vertices);
    EXPECT_GT(volume_of(shell), 0);
    sum += volume_of(shell);
  }
  EXPECT_NEAR(result.sum_of_hull_volumes, sum, 1e-12 * sum);
  for (const auto& [a, b] : result.neighbours) {
    EXPECT_LT(a, b);
    EXPECT_LT(b, int(result.shells.size()));
  }
  EXPECT_TRUE(std::is_sorted(result.neighbours.begin(), result.neighbours.end()));
  expect_covered(mesh, result);
}

TEST(Decompose, AConvexModelIsOneShellItsHull) {
  for (const SurfaceMesh& model : {made_box(Vec3(1, 2, 3)), made_sphere(5)}) {
    const Decomposition result = decompose(model, {.max_vertices = 200});
    expect_lawful(model, {.max_vertices = 200}, result);
    ASSERT_EQ(result.shells.size(), 1u);
    EXPECT_EQ(result.shells[0].vertices.rows(), model.positions.rows());
    EXPECT_NEAR(result.sum_of_hull_volumes / volume(model), 1.0, 1e-5);
    EXPECT_EQ(result.stopped_by, "gain");
    EXPECT_LT(result.max_overshoot, 1e-5);
  }
}

TEST(Decompose, AnLPrismInTwoShellsFillsExactlyItself) {
  const SurfaceMesh prism = made_l_prism();
  const Decomposition result = decompose(prism, {.max_shells = 2});
  expect_lawful(prism, {.max_shells = 2}, result);
  EXPECT_EQ(result.shells.size(), 2u);
  EXPECT_NEAR(result.sum_of_hull_volumes, volume(prism), 2e-5 * volume(prism));
  EXPECT_NEAR(result.model_volume, volume(prism), 1e-12);
  EXPECT_EQ(result.neighbours, (std::vector<std::array<int, 2>>{{0, 1}}));
}

TEST(Decompose, MoreShellsAreNeverAskedThanHelp) {
  const SurfaceMesh prism = made_l_prism();
  const Decomposition result = decompose(prism, {.max_shells = 20});
  EXPECT_EQ(result.shells.size(), 2u);
  EXPECT_EQ(result.stopped_by, "gain");
}

TEST(Decompose, CountAndVertexLimitsHold) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  for (int shells : {1, 4, 7, 16})
    for (int vertices : {8, 20, 64}) {
      SCOPED_TRACE(testing::Message() << shells << " shells of " << vertices << " vertices");
      const DecomposeOptions options{.max_shells = shells, .max_vertices = vertices};
      const Decomposition result = decompose(torus, options);
      expect_lawful(torus, options, result);
      EXPECT_EQ(int(result.shells.size()), shells);
      EXPECT_EQ(result.stopped_by, "count");
    }
}

TEST(Decompose, MoreShellsFitBetter) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  double last = 1e300;
  for (int shells : {1, 4, 8, 16, 32}) {
    const Decomposition result = decompose(torus, {.max_shells = shells});
    EXPECT_LT(result.sum_of_hull_volumes, last);
    EXPECT_GE(result.sum_of_hull_volumes, volume(torus));
    last = result.sum_of_hull_volumes;
  }
  EXPECT_LT(last, 1.06 * volume(torus));
}

TEST(Decompose, TheConcavityBoundIsMetWithAsFewShellsAsItTakes) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  std::size_t last = 0;
  for (double bound : {0.1, 0.03, 0.013}) {
    const DecomposeOptions options{.max_shells = 100, .max_concavity = bound};
    const Decomposition result = decompose(torus, options);
    expect_lawful(torus, options, result);
    EXPECT_LE(result.max_overshoot, bound);
    EXPECT_EQ(result.stopped_by, "concavity");
    EXPECT_GT(result.shells.size(), last);
    EXPECT_LT(result.shells.size(), 100u);
    last = result.shells.size();
  }
  EXPECT_EQ(decompose(torus, {.max_shells = 3, .max_concavity = 0.015}).stopped_by, "count");
}

TEST(Decompose, SameInputSameBytesWithAnyNumberOfThreads) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  const auto with_threads = [&](int count) {
    set_thread_count(count);
    Decomposition result = decompose(torus, {.max_shells = 9});
    set_thread_count(0);
    return result;
  };
  const Decomposition a = with_threads(1), b = with_threads(4);
  ASSERT_EQ(a.shells.size(), b.shells.size());
  for (std::size_t s = 0; s < a.shells.size(); ++s) {
    EXPECT_EQ(a.shells[s].vertices, b.shells[s].vertices);
    EXPECT_EQ(a.shells[s].triangles, b.shells[s].triangles);
  }
}

TEST(Decompose, OrderOfTrianglesAndPlaceInSpaceChangeLittle) {
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  const double expected = decompose(torus, {.max_shells = 12}).sum_of_hull_volumes;
  SurfaceMesh moved = torus;
  Rng rng(3, 0);
  for (Eigen::Index t = torus.triangles.rows() - 1; t > 0; --t) {
    const int other = rng.below(int(t) + 1);
    moved.triangles.row(t).swap(moved.triangles.row(other));
  }
  EXPECT_NEAR(decompose(moved, {.max_shells = 12}).sum_of_hull_volumes, expected, 1e-2 * expected);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Index v = 0; v < moved.positions.rows(); ++v)
    moved.positions.row(v) = (turn * torus.positions.row(v).transpose() + Vec3(30, -50, 70)).transpose();
  const Decomposition result = decompose(moved, {.max_shells = 12});
  expect_lawful(moved, {.max_shells = 12}, result);
  EXPECT_NEAR(result.sum_of_hull_volumes, expected, 3e-2 * expected);
}

TEST(Decompose, TurnedBy17DegreesItIsAsGood) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(17 * std::numbers::pi / 180, Vec3(3, 1, -2).normalized()).toRotationMatrix();
  const auto turned = [&](SurfaceMesh mesh) {
    mesh.positions = (mesh.positions * turn.transpose()).eval();
    return mesh;
  };
  const SurfaceMesh prism = turned(made_l_prism());
  EXPECT_NEAR(decompose(prism, {.max_shells = 2}).sum_of_hull_volumes, volume(prism), 2e-5 * volume(prism));
  const SurfaceMesh torus = made_torus(0.3, 40, 16);
  for (int shells : {8, 16}) {
    const Decomposition straight = decompose(torus, {.max_shells = shells});
    const Decomposition slanted = decompose(turned(torus), {.max_shells = shells});
    EXPECT_LT(slanted.sum_of_hull_volumes, 1.03 * straight.sum_of_hull_volumes);
    EXPECT_LT(slanted.mean_overshoot, 1.1 * straight.mean_overshoot);
  }
}

// The middle of a chord across a sixteenth of the ring is at 0.98 of its inner radius, 0.7.
TEST(Decompose, AHoleIsKept) {
  const Decomposition result = decompose(made_torus(0.3, 40, 16), {.max_shells = 16});
  for (int i = 0; i < 36; ++i)
    for (double radius : {0.0, 0.3, 0.6}) {
      const double angle = i * std::numbers::pi / 18;
      const Long3 p(radius * std::cos(angle), radius * std::sin(angle), 0);
      for (const ConvexShell& shell : result.shells) EXPECT_FALSE(holds(shell, p)) << radius << " " << angle;
    }
}

// A cube with a pyramid on each face: cuts along the faces leave a part that no triangle is in.
SurfaceMesh made_star() {
  SurfaceMesh star{Points(14, 3), Triangles(24, 3)};
  star.positions.topRows(8) = made_box(Vec3(1, 1, 1)).positions;
  int row = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int side : {0, 1}) {
      const int tip = 8 + 2 * axis + side;
      Vec3 place = Vec3::Constant(0.5);
      place[axis] = side ? 2.5 : -1.5;
      star.positions.row(tip) = place.transpose();
      const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, at = side << axis;
      const int loop[4] = {at, at + u, at + u + v,
                           at + v};  // counter-clockwise from the far side of the axis
      for (int k = 0; k < 4; ++k) {
        const int from = loop[k], to = loop[(k + 1) % 4];
        star.triangles.row(row++) << (side ? from : to), (side ? to : from), tip;
      }
    }
  return star;
}

// A floor of 1 by 1 a cell and walls round each, all 0.05 thick: boxes that overlap.
SurfaceMesh made_tray(int cells) {
  constexpr double wall = 0.05;
  std::vector<Box> slabs{{Vec3(0, 0, 0), Vec3(cells, 1, wall)},
                         {Vec3(0, 0, 0), Vec3(cells, wall, 0.6)},
                         {Vec3(0, 1 - wall, 0), Vec3(cells, 1, 0.6)}};
  for (int c = 0; c <= cells; ++c) {
    const double x = c * (cells - wall) / cells;
    slabs.push_back({Vec3(x, 0, 0), Vec3(x + wall, 1, 0.6)});
  }
  SurfaceMesh tray;
  for (const Box& slab : slabs) {
    SurfaceMesh box = made_box(slab.size());
    box.positions.rowwise() += slab.lower.transpose();
    tray = joined(tray, box);
  }
  return tray;
}

// Half of such a hollow has the hull of the whole, and so has a quarter of a row of them: for long no cut
// gains anything.
TEST(Decompose, WallsRoundAHollowArePartedThoughNoFirstCutGains) {
  for (int cells : {1, 2, 3}) {
    const SurfaceMesh tray = made_tray(cells);
    const Decomposition result = decompose(tray, {});
    expect_lawful(tray, {}, result);
    EXPECT_LT(result.max_overshoot, 0.02) << cells;
    EXPECT_LT(result.mean_overshoot, 0.001) << cells;
  }
}

// Every point of the solid is in a shell: of random ones each that the winding number has inside.
TEST(Decompose, TheSolidIsCoveredNotItsSurfaceAlone) {
  for (const SurfaceMesh& model : {made_star(), made_torus(0.3, 24, 12), made_tray(2)}) {
    const Decomposition result = decompose(model, {});
    expect_lawful(model, {}, result);
    const WindingNumber winding(model.positions, model.triangles);
    const Box box = bounding_box(model.positions);
    Rng rng(7, 0);
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p = box.lower + box.size().cwiseProduct(Vec3(rng.uniform(), rng.uniform(), rng.uniform()));
      if (winding.at(p) < 0.6) continue;
      ++inside;
      EXPECT_TRUE(std::any_of(result.shells.begin(), result.shells.end(), [&](const ConvexShell& shell) {
        return holds(shell, p.cast<long double>());
      })) << p.transpose();
    }
    EXPECT_GT(inside, 500);
  }
}

TEST(Decompose, AScaleByAPowerOfTwoChangesNothing) {
  const SurfaceMesh torus = made_torus(0.3, 24, 12);
  SurfaceMesh tiny = torus;
  tiny.positions *= 0x1p-20;
  const Decomposition a = decompose(torus, {.max_shells = 6}), b = decompose(tiny, {.max_shells = 6});
  ASSERT_EQ(a.shells.size(), b.shells.size());
  for (std::size_t s = 0; s < a.shells.size(); ++s)
    EXPECT_EQ(a.shells[s].vertices, Points(b.shells[s].vertices * 0x1p20));
}

TEST(Decompose, FarFromTheOriginAllIsStillCovered) {
  SurfaceMesh torus = made_torus(0.3, 24, 12);
  torus.positions.rowwise() += Eigen::RowVector3d(1e6, 2e6, -3e6);
  expect_lawful(torus, {.max_shells = 6}, decompose(torus, {.max_shells = 6}));
}

TEST(Decompose, AnOpenModelIsSolid) {
  const SurfaceMesh open = made_hemisphere(20);
  const Decomposition result = decompose(open, {.max_shells = 4, .max_vertices = 400});
  expect_lawful(open, {.max_shells = 4, .max_vertices = 400}, result);
  EXPECT_EQ(result.shells.size(), 1u);  // as a bowl it would have cost many
}

TEST(Decompose, AFlatModelGetsThinShells) {
  SurfaceMesh sheet;  // an L of three unit squares
  sheet.positions.resize(8, 3);
  sheet.positions << 0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 1, 1, 0, 2, 1, 0, 0, 2, 0, 1, 2, 0;
  sheet.triangles.resize(6, 3);
  sheet.triangles << 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 3, 4, 7, 3, 7, 6;
  const Decomposition result = decompose(sheet, {.max_shells = 8});
  expect_lawful(sheet, {.max_shells = 8}, result);
  EXPECT_EQ(result.shells.size(), 2u);
  EXPECT_NEAR(result.sum_of_hull_volumes, 3 * 2e-4 * std::sqrt(8.0), 1e-6);
}

TEST(Decompose, ATriangleAndASoupOfTrianglesAreCovered) {
  SurfaceMesh triangle;
  triangle.positions.resize(3, 3);
  triangle.positions << 0, 0, 0, 1, 0, 0, 0, 1, 1;
  triangle.triangles.resize(1, 3);
  triangle.triangles << 0, 1, 2;
  expect_lawful(triangle, {}, decompose(triangle, {}));

  SurfaceMesh soup;
  Rng rng(8, 0);
  soup.positions.resize(300, 3);
  soup.triangles.resize(100, 3);
  for (int v = 0; v < 300; ++v) soup.positions.row(v) = (rng.uniform() * rng.direction()).transpose();
  for (int t = 0; t < 100; ++t) soup.triangles.row(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  const DecomposeOptions options{.max_shells = 30, .max_vertices = 32};
  expect_lawful(soup, options, decompose(soup, options));
}

TEST(Decompose, NeedlesAndPointsOnALineAreCovered) {
  SurfaceMesh line;
  line.positions.resize(3, 3);
  line.positions << 0, 0, 0, 1, 1, 1, 3, 3, 3;
  line.triangles.resize(1, 3);
  line.triangles << 0, 1, 2;
  expect_lawful(line, {}, decompose(line, {}));
}

// The concave edge lies in the planes of two large faces, whichever way the prism is turned.
TEST(Decompose, ATurnedLPrismIsCutAtItsConcaveEdge) {
  SurfaceMesh prism = made_l_prism();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vec3(3, 1, 2).normalized()).toRotationMatrix();
  prism.positions = (prism.positions * turn.transpose()).eval();
  const Decomposition result = decompose(prism, {.max_shells = 8});
  EXPECT_EQ(result.shells.size(), 2u);
  EXPECT_NEAR(result.sum_of_hull_volumes, 6, 2e-5 * 6);
}

TEST(Decompose, AnInflatedShellTakesInItsSurroundingsWithoutSpikes) {
  const SurfaceMesh prism = made_l_prism();
  const DecomposeOptions plain{.max_shells = 2}, inflated{.max_shells = 2, .inflation = 0.05};
  const Decomposition a = decompose(prism, plain), b = decompose(prism, inflated);
  expect_lawful(prism, inflated, b);
  const double distance = 0.05 * bounding_box(prism.positions).diagonal();
  ASSERT_EQ(a.shells.size(), b.shells.size());
  Rng rng(4, 0);
  for (std::size_t s = 0; s < a.shells.size(); ++s) {
    Box box = bounding_box(a.shells[s].vertices);
    for (Eigen::Index v = 0; v < a.shells[s].vertices.rows(); ++v)
      for (int i = 0; i < 20; ++i) {
        const Vec3 p = Vec3(a.shells[s].vertices.row(v)) + distance * rng.direction();
        EXPECT_TRUE(holds(b.shells[s], p.cast<long double>()));
      }
    // These two shells are boxes, so the distance from them is that from their bounding boxes.
    for (Eigen::Index v = 0; v < b.shells[s].vertices.rows(); ++v) {
      const Vec3 p = b.shells[s].vertices.row(v);
      EXPECT_LT((box.lower - p).cwiseMax(p - box.upper).cwiseMax(0.0).norm(), 1.13 * distance);
    }
  }
}

TEST(Decompose, ExactPartsOfAnLAndATorusOfBoxesAreTheModel) {
  SurfaceMesh ring = made_torus(0.3, 4, 4);  // square of square section
  for (const SurfaceMesh& model : {made_l_prism(), ring, made_box(Vec3(1, 2, 3))}) {
    const DecomposeOptions options{.max_shells = 1000, .exact = true};
    const Decomposition result = decompose(model, options);
    expect_lawful(model, options, result);
    EXPECT_EQ(result.stopped_by, "exact");
    EXPECT_NEAR(result.sum_of_hull_volumes, volume(model), 2e-5 * volume(model));
    EXPECT_LT(result.max_overshoot, 1e-5);
  }
  EXPECT_EQ(decompose(made_box(Vec3(1, 2, 3)), {.exact = true}).shells.size(), 1u);
  EXPECT_EQ(decompose(made_l_prism(), {.exact = true}).shells.size(), 2u);
}

TEST(Decompose, ExactPartsAreRefusedWithAReason) {
  EXPECT_THROW(decompose(made_hemisphere(4), {.exact = true}), InputError);
  EXPECT_THROW(decompose(made_sphere(40), {.exact = true}), InputError);  // too many triangles
  SurfaceMesh two = made_box(Vec3(1, 1, 1));                              // two boxes that cross
  two.positions.conservativeResize(16, 3);
  two.positions.bottomRows(8) = two.positions.topRows(8).eval().array() + 0.5;
  two.triangles.conservativeResize(24, 3);
  two.triangles.bottomRows(12) = two.triangles.topRows(12).eval().array() + 8;
  EXPECT_THROW(decompose(two, {.exact = true}), InputError);
}

TEST(Decompose, SaysWhatIsWrongWithTheInput) {
  const SurfaceMesh box = made_box(Vec3(1, 1, 1));
  EXPECT_THROW(decompose(SurfaceMesh{}, {}), InputError);
  EXPECT_THROW(decompose(box, {.max_shells = 0}), InputError);
  EXPECT_THROW(decompose(box, {.max_concavity = -0.1}), InputError);
  EXPECT_THROW(decompose(box, {.max_concavity = std::nan("")}), InputError);
  EXPECT_THROW(decompose(box, {.max_vertices = 7}), InputError);
  EXPECT_THROW(decompose(box, {.inflation = -0.1}), InputError);
  SurfaceMesh point = box;
  point.positions.setConstant(2);
  EXPECT_THROW(decompose(point, {}), InputError);
}

}  // namespace
}  // namespace limber::meshing
