#include "scenes/shapes.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "scenes/models.h"

namespace limber::scenes {
namespace {

constexpr double pi = std::numbers::pi;

struct Shape {
  std::string name;
  SurfaceMesh mesh;
  int euler;                      // V − E + F: 2 for a ball, 0 for a ring
  double volume, relative_error;  // by a closed form; the error is that of flat triangles in round parts
};

// A box with rounded edges: a smaller box, its six faces raised, quarter cylinders and a ball.
double rounded_box_volume(const Vec3& size, double r) {
  const Vec3 a = size.array() - 2 * r;
  return a.prod() + 2 * r * (a.x() * a.y() + a.y() * a.z() + a.z() * a.x()) + pi * r * r * a.sum() +
         4 * pi / 3 * r * r * r;
}

// Two walls that cross, 0.2 thick, with a window in each arm; the third reaches to the floor.
BlocksModel crossing(double bevel) {
  return {{{{0, 1, 0}, {2.2, 1.2, 1}}, {{1, 0, 0}, {1.2, 2.2, 1}}},
          {{{0.3, 1, 0.2}, {0.7, 1.2, 0.8}},
           {{1.5, 1, 0.2}, {1.9, 1.2, 0.5}},
           {{1, 0.3, 0}, {1.2, 0.7, 0.5}},
           {{1, 1.5, 0.5}, {1.2, 1.9, 0.8}}},
          bevel,
          0.1};
}
constexpr double crossing_volume = 2 * 2.2 * 0.2 - 0.04 - 0.2 * (0.24 + 0.12 + 0.2 + 0.12);

// An S of 0.6 m in three dimensions.
TubeModel bent(double diameter, double wall, double triangle) {
  return {{{0, 0, 0}, {0.15, 0, 0.05}, {0.25, 0.12, 0.05}, {0.4, 0.12, -0.05}, {0.55, 0, 0}},
          diameter,
          wall,
          triangle};
}

// A ring that is not plane, so that its frames would not meet by themselves.
TubeModel loop(double diameter, double triangle) {
  return {{{0.4, 0, 0}, {0.2, 0.3, 0.1}, {-0.2, 0.3, -0.1}, {-0.4, 0, 0.1}, {0, -0.35, 0}, {0.4, 0, 0}},
          diameter,
          0,
          triangle};
}

// By Pappus and Guldin: a section's area times the way of its middle, whatever the curve. Round ends are half
// balls and half rings.
double tube_volume(const TubeModel& tube) {
  const double r = tube.diameter_m / 2, w = tube.wall_m / 2, length = length_m(tube);
  if (w == 0) return pi * r * r * (length - 2 * r) + 4 * pi / 3 * r * r * r;
  return pi * (r * r - (r - 2 * w) * (r - 2 * w)) * (length - 2 * w) + 2 * pi * (r - w) * pi * w * w;
}

std::vector<Shape> shapes() {
  const Vec3 size(1, 2, 0.5);
  std::vector<Shape> made{
      {"cube", make_box({Vec3::Ones(), 0, 0.3}), 2, 1, 1e-12},
      {"box", make_box({size, 0, 0.1}), 2, 1, 1e-12},
      {"rounded box", make_box({size, 0.1, 0.1}), 2, rounded_box_volume(size, 0.1), 2e-3},
      {"pill", make_box({size, 0.25, 0.1}), 2, rounded_box_volume(size, 0.25), 1e-2},
      {"ball of a box", make_box({Vec3::Ones(), 0.5, 0.1}), 2, pi / 6, 3e-2},
      {"sphere", make_sphere({1.6, 0.1}), 2, pi / 6 * 1.6 * 1.6 * 1.6, 1e-2},
      {"one-piece sphere", make_sphere({1, 9}), 2, 0.31702,
       1e-4},  // 5(3+√5)/12 a³ of the icosahedron, a = 1/(2 sin 72°)
      {"beach ball", make_beach_ball(), 2, pi / 6, 5e-3},
      {"bunny", make_bunny(), 2, 0, 0},
      {"dragon", make_dragon(), 2, 0, 0},
      {"heart", make_heart(), 2, 0, 0},
      {"left lung", make_lung(1), 2, 0, 0},
      {"right lung", make_lung(-1), 2, 0, 0},
      {"liver", make_liver(), 2, 0, 0},
      {"spine", make_spine(), 0, 0, 0},  // two of its processes touch
      {"ribcage", make_ribcage(), 2 * 21, 0, 0},
      {"one block", make_blocks({{{Vec3(1, 1, 1), Vec3(1, 1, 1) + size}}, {}, 0, 0.1}), 2, 1, 1e-4},
      {"rounded block", make_blocks({{{Vec3::Zero(), size}}, {}, 0.1, 0.1}), 2, rounded_box_volume(size, 0.1),
       2e-3},
      {"crossing walls", make_blocks(crossing(0)), 2 - 2 * 3, crossing_volume, 1e-4},
      {"rounded crossing walls", make_blocks(crossing(0.04)), 2 - 2 * 3, crossing_volume, 3e-2},
  };
  const TubeModel straight{{{0, 0, 0}, {0, 0, 1}}, 0.2, 0, 0.01}, rod = bent(0.03, 0, 0.002),
                                                                  tube = bent(0.06, 0.01, 0.003);
  made.push_back({"straight rod", make_tube(straight), 2, tube_volume(straight), 4e-3});
  made.push_back({"bent rod", make_tube(rod), 2, tube_volume(rod), 6e-3});
  made.push_back({"bent tube", make_tube(tube), 0, tube_volume(tube), 6e-3});
  const TubeModel ring = loop(0.1, 0.008);
  made.push_back({"ring", make_tube(ring), 0, pi * 0.05 * 0.05 * length_m(ring), 6e-3});
  for (const Vec3& s : {Vec3(0.3, 3, 2), Vec3(3, 0.3, 2), Vec3(3, 2, 0.3)}) {
    made.push_back({"plate, square hole", make_plate({{s, 0, 0.1}, Hole{false, 0.8, {0.2, -0.1}}}), 0,
                    1.8 - 0.64 * 0.3, 1e-9});
    made.push_back({"plate, round hole", make_plate({{s, 0, 0.05}, Hole{true, 0.8, {0.2, -0.1}}}), 0,
                    1.8 - pi * 0.16 * 0.3, 1e-3});
    made.push_back({"rounded plate", make_plate({{s, 0.05, 0.1}, Hole{true, 1.0, {0, 0}}}), 0,
                    1.8 - pi * 0.25 * 0.3, 2e-2});
    made.push_back({"plate without a hole", make_plate({{s, 0, 0.1}, {}}), 2, 1.8, 1e-12});
  }
  return made;
}

double area_of(const SurfaceMesh& mesh, Eigen::Index f) {
  const auto p = [&](int i) { return Vec3(mesh.positions.row(mesh.triangles(f, i))); };
  return 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
}

TEST(Shapes_slow, AreClosedManifoldsThatFaceOutward) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    ASSERT_NO_THROW(validate(shape.mesh, shape.name));
    std::map<std::pair<int, int>, int> edges;
    double smallest = 1e9;
    for (Eigen::Index f = 0; f < shape.mesh.triangles.rows(); ++f) {
      for (int c = 0; c < 3; ++c) ++edges[{shape.mesh.triangles(f, c), shape.mesh.triangles(f, (c + 1) % 3)}];
      smallest = std::min(smallest, area_of(shape.mesh, f));
    }
    for (const auto& [edge, count] : edges)
      ASSERT_TRUE(count == 1 && edges.count({edge.second, edge.first}) == 1);
    const auto euler =
        shape.mesh.positions.rows() - std::int64_t(edges.size()) / 2 + shape.mesh.triangles.rows();
    EXPECT_EQ(euler, shape.euler);
    EXPECT_GT(volume(shape.mesh), 0);
    EXPECT_GT(smallest, 1e-7);
    EXPECT_EQ(vertices_of(shape.mesh.triangles).size(), std::size_t(shape.mesh.positions.rows()));
  }
}

TEST(Shapes_slow, HaveTheVolumeOfTheClosedForm) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    if (shape.volume == 0) continue;
    EXPECT_NEAR(volume(shape.mesh), shape.volume, shape.relative_error * shape.volume);
  }
}

TEST(Shapes_slow, AreMadeTheSameTwice) {
  const auto once = shapes(), twice = shapes();
  for (std::size_t i = 0; i < once.size(); ++i)
    EXPECT_EQ(hash_of(once[i].mesh), hash_of(twice[i].mesh)) << once[i].name;
}

TEST(Shapes, FlatFacesHaveNoEdgeLongerThanAsked) {
  const SurfaceMesh box = make_box({Vec3(1, 2, 0.5), 0.1, 0.17});
  double longest_side = 0;  // along the axes; the diagonals of the squares are √2 longer
  for (Eigen::Index f = 0; f < box.triangles.rows(); ++f)
    for (int c = 0; c < 3; ++c) {
      const Vec3 e =
          box.positions.row(box.triangles(f, c)) - box.positions.row(box.triangles(f, (c + 1) % 3));
      if ((e.array().abs() > 1e-9).count() == 1) longest_side = std::max(longest_side, e.norm());
    }
  EXPECT_LE(longest_side, 0.17);
  const SurfaceMesh sphere = make_sphere({1, 0.1});
  for (Eigen::Index v = 0; v < sphere.positions.rows(); ++v)
    ASSERT_NEAR(sphere.positions.row(v).norm(), 0.5, 1e-12);
}

TEST(Shapes, RoundedBoxIsABevelFromItsInnerBox) {
  const Vec3 size(1, 2, 0.5);
  const double bevel = 0.1;
  const SurfaceMesh box = make_box({size, bevel, 0.1});
  const Vec3 inner = (size / 2).array() - bevel;
  for (Eigen::Index v = 0; v < box.positions.rows(); ++v) {
    const Vec3 p = box.positions.row(v);
    ASSERT_NEAR((p - p.cwiseMax(-inner).cwiseMin(inner)).norm(), bevel, 1e-12);
  }
}

TEST(Shapes, BunnyIsOneMetreHighAndSymmetric) {
  const SurfaceMesh bunny = make_bunny();
  const Box box = bounding_box(bunny.positions);
  EXPECT_NEAR(box.size().z(), 1, 1e-12);
  EXPECT_LT(box.center().norm(), 1e-12);
  EXPECT_NEAR(box.size().y(), 0.7, 0.1);
  EXPECT_GE(bunny.triangles.rows(), 20000);
  EXPECT_LE(bunny.triangles.rows(), 40000);
  // The ears are behind the muzzle, and the tail is at the back: it looks along +x.
  Eigen::Index top = 0;
  bunny.positions.col(2).maxCoeff(&top);
  EXPECT_GT(bunny.positions(top, 0), box.lower.x() + 0.4 * box.size().x());
  Vec3 moment = Vec3::Zero();
  for (Eigen::Index f = 0; f < bunny.triangles.rows(); ++f)
    for (int c = 0; c < 3; ++c) moment += area_of(bunny, f) / 3 * bunny.positions.row(bunny.triangles(f, c));
  EXPECT_NEAR(moment.y() / area(bunny), 0, 1e-3);
}

std::vector<std::pair<Vec3, Eigen::Vector3i>> cages() {
  return {{Vec3::Ones(), {3, 3, 3}},
          {Vec3(0.35, 3, 2.2), {2, 9, 3}},
          {Vec3(1, 2, 3), {1, 1, 1}},
          {Vec3(1, 2, 3), {2, 1, 4}}};
}

TEST(BoxCage, FillsTheBoxWithFiveTetsACell) {
  for (const auto& [size, cells] : cages()) {
    SCOPED_TRACE(fmt::format("{} {} {}", cells.x(), cells.y(), cells.z()));
    const TetMesh cage = make_box_cage(size, cells);
    ASSERT_NO_THROW(validate(cage, "cage"));
    EXPECT_EQ(cage.tets.rows(), 5 * cells.prod());
    EXPECT_EQ(cage.positions.rows(), (cells.array() + 1).prod());
    EXPECT_NEAR(volume(cage), size.prod(), 1e-12 * size.prod());
    const Box box = bounding_box(cage.positions);
    EXPECT_EQ(box.lower, -size / 2);
    EXPECT_EQ(box.upper, size / 2);
  }
}

// Cells cut alike share no faces: the surface would then hold triangles inside the box.
TEST(BoxCage, NeighboursShareTheirFaces) {
  for (const auto& [size, cells] : cages()) {
    const TetMesh cage = make_box_cage(size, cells);
    const Triangles boundary = boundary_triangles(cage.tets);
    EXPECT_EQ(boundary.rows(), 4 * (cells.x() * cells.y() + cells.y() * cells.z() + cells.z() * cells.x()));
    EXPECT_NEAR(volume(SurfaceMesh{cage.positions, boundary}), size.prod(), 1e-12 * size.prod());
    EXPECT_NEAR(area(SurfaceMesh{cage.positions, boundary}),
                2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x()), 1e-9);
  }
}

// Cells left out leave holes, and the rest fits together: the boundary is that of the blocks.
TEST(BlocksCage, FillsTheBlocksInTwoLayersAndNoMore) {
  const BlocksModel blocks = crossing(0);
  const TetMesh cage = make_blocks_cage(blocks, 0.4);
  ASSERT_NO_THROW(validate(cage, "cage"));
  EXPECT_NEAR(volume(cage), crossing_volume, 1e-12);
  const SurfaceMesh boundary{cage.positions, boundary_triangles(cage.tets)};
  EXPECT_NEAR(volume(boundary), crossing_volume, 1e-12);
  EXPECT_NEAR(area(boundary), area(make_blocks(blocks)), 1e-3);
  EXPECT_EQ(vertices_of(boundary.triangles).size() < std::size_t(cage.positions.rows()), true);
  std::set<double> through, along;
  double longest = 0;  // along the axes
  for (Eigen::Index n = 0; n < cage.positions.rows(); ++n) {
    if (cage.positions(n, 0) < 1) through.insert(cage.positions(n, 1));
    if (cage.positions(n, 0) >= 1 && cage.positions(n, 0) <= 1.2) along.insert(cage.positions(n, 1));
  }
  EXPECT_EQ(through.size(), 3U);
  for (auto at = std::next(along.begin()); at != along.end(); ++at)
    longest = std::max(longest, *at - *std::prev(at));
  EXPECT_LE(longest, 0.4 + 1e-12);
}

// The tet that holds a point, or −1; and how far a point of no tet is outside of the nearest, as a share.
int tet_that_holds(const TetMesh& cage, const Vec3& p) {
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t) {
    const auto corner = [&](int c) -> Vec3 { return cage.positions.row(cage.tets(t, c)); };
    Vec3 q[4] = {corner(0), corner(1), corner(2), corner(3)};
    bool inside = true;
    for (int c = 0; c < 4 && inside; ++c) {
      const Vec3 kept = q[c];
      q[c] = p;
      inside = signed_volume(q[0], q[1], q[2], q[3]) >= 0;
      q[c] = kept;
    }
    if (inside) return int(t);
  }
  return -1;
}

TEST(TubeCage, HoldsItsSurfaceLeavesTheLumenAndSharesItsFaces) {
  const auto holds_all = [](const TubeModel& tube, const Eigen::Vector3i& cells) {
    SCOPED_TRACE(cells.transpose());
    const TetMesh cage = make_tube_cage(tube, cells);
    ASSERT_NO_THROW(validate(cage, "cage"));
    const SurfaceMesh boundary{cage.positions, boundary_triangles(cage.tets)};
    EXPECT_NEAR(volume(boundary), volume(cage), 1e-9 * volume(cage)) << "neighbours share their faces";
    const SurfaceMesh surface = make_tube(tube);
    for (Eigen::Index v = 0; v < surface.positions.rows(); ++v)
      ASSERT_GE(tet_that_holds(cage, surface.positions.row(v)), 0) << surface.positions.row(v);
  };
  const TubeModel rod = bent(0.03, 0, 0.006), tube = bent(0.06, 0.01, 0.01);
  holds_all(rod, {1, 1, 24});
  holds_all(rod, {2, 2, 40});
  holds_all(rod, {3, 3, 31});
  holds_all(tube, {8, 1, 30});
  holds_all(tube, {12, 2, 25});
  holds_all(loop(0.1, 0.03), {1, 1, 24});
  holds_all(loop(0.1, 0.03), {2, 2, 36});
  // With many sections it is the polygon round the circle, less that in the lumen, along the tube.
  const auto polygon = [](int n, double apothem) { return n * apothem * apothem * std::tan(pi / n); };
  EXPECT_NEAR(volume(make_tube_cage(rod, {2, 2, 800})), polygon(8, 0.015) * length_m(rod),
              0.03 * tube_volume(rod));
  const double inner = 0.02 * std::cos(pi / 12) * std::cos(pi / 19);  // the surface has 19 vertices round
  EXPECT_NEAR(volume(make_tube_cage(tube, {12, 1, 800})),
              (polygon(12, 0.03) - polygon(12, inner)) * length_m(tube), 0.03 * tube_volume(tube));
  const TetMesh cage = make_tube_cage(tube, {8, 1, 30});
  for (const Vec3& p : tube.path_m) EXPECT_EQ(tet_that_holds(cage, p), -1) << "the lumen";
  EXPECT_THROW(make_tube_cage(tube, {8, 1, 4}), InputError) << "it would fill the lumen";
}

// Faces stay where they are but for a millionth; in a corner that points inwards both do.
TEST(Blocks, AreRoundedWhereTheyStandOutOnly) {
  const double bevel = 0.04;
  const BlocksModel blocks = crossing(bevel);
  const SurfaceMesh sharp = make_blocks(crossing(0)), round = make_blocks(blocks);
  EXPECT_LT(volume(round), volume(sharp));
  int in_the_notch = 0;
  for (Eigen::Index v = 0; v < round.positions.rows(); ++v) {
    const Vec3 p = round.positions.row(v);
    const bool flat_height = p.z() > bevel && p.z() < 1 - bevel;
    if (std::hypot(p.x() - 1, p.y() - 1) > 1e-4 || !flat_height) continue;
    ++in_the_notch;  // the edge between two arms
    EXPECT_GT(p.x(), 1);
    EXPECT_GT(p.y(), 1);
  }
  EXPECT_GT(in_the_notch, 5);
}

BodySpec box_body() {
  BodySpec body;
  body.name = "block";
  body.model = BoxModel{Vec3(1, 2, 3), 0, 0.5};
  body.cage.cells = {1, 2, 3};
  return body;
}

TEST(Models, SurfaceLiesInsideTheBoxCage) {
  const BodySpec body = box_body();
  const SurfaceMesh surface = *made_surface(body);
  const Box cage = bounding_box(made_cage(body)->positions), fine = bounding_box(surface.positions);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(fine.lower[i], cage.lower[i]);
    EXPECT_LT(fine.upper[i], cage.upper[i]);
    EXPECT_NEAR(fine.upper[i], cage.upper[i], 1e-5);
  }
}

TEST(Models, PoseTurnsAboutTheOriginThenMovesTheAnchor) {
  BodySpec body = box_body();
  body.pose = {Vec3(5, 6, 7), Vec3::UnitX(), 90, "origin"};
  const Points points = make_box(std::get<BoxModel>(body.model)).positions;
  const auto map = world_from_model(body, points, true);
  EXPECT_LT((map * Vec3(0, 1, 0) - Vec3(5, 6, 8)).norm(), 1e-12);
  for (const char* anchor : {"origin", "center", "bottom"}) {
    body.pose.anchor = anchor;
    Points moved = points;
    transform(world_from_model(body, points, true), moved);
    const Box box = bounding_box(moved), expected = *start_box(body);
    EXPECT_LT((box.size() - Vec3(1, 3, 2)).norm(), 1e-12);
    EXPECT_LT((box.lower - expected.lower).norm(), 1e-12);
    EXPECT_LT((box.upper - expected.upper).norm(), 1e-12);
    EXPECT_NEAR(box.lower.z(), body.pose.anchor == "bottom" ? 7 : 6, 1e-12);
  }
}

TEST(Models, FilesAreTurnedUprightAndScaled) {
  BodySpec body;
  body.cage.tets = 10;
  FileModel model{"a.off", "bunny", 2, {}, Vec3::UnitY(), -Vec3::UnitX()};
  body.model = model;
  body.pose.anchor = "origin";
  Points points(2, 3);
  points << 0, 0, 0, 1, 2, 4;
  EXPECT_EQ(world_from_model(body, points, false) * Vec3::UnitY(), Vec3(0, 0, 2));   // up
  EXPECT_EQ(world_from_model(body, points, false) * -Vec3::UnitX(), Vec3(2, 0, 0));  // front
  EXPECT_EQ(world_from_model(body, points, false).linear().determinant(), 8) << "not mirrored";
  EXPECT_EQ(world_from_model(body, points, true) * Vec3::UnitZ(), Vec3(0, 0, 2))
      << "the made model stands upright already";
  model.height_m = 1;  // the file is 2 high along its y
  body.model = model;
  EXPECT_EQ(world_from_model(body, points, false) * Vec3::UnitY(), Vec3(0, 0, 0.5));
}

TEST(Models, FixedNodesLieWhereTheSceneSays) {
  BodySpec body = box_body();
  body.pose = {Vec3(1, 1, 1.5), Vec3::UnitZ(), 0, "origin"};
  const Box bounds{Vec3::Zero(), Vec3(10, 3, 3)};
  Points cage = made_cage(body)->positions;
  transform(world_from_model(body, cage, true), cage);
  EXPECT_TRUE(fixed_nodes(body, bounds, cage).empty());
  body.fixed.walls = true;  // the block touches y = 0, the floor and the ceiling
  for (int n = 0; n < int(cage.rows()); ++n) {
    const auto nodes = fixed_nodes(body, bounds, cage);
    const bool held = std::find(nodes.begin(), nodes.end(), n) != nodes.end();
    EXPECT_EQ(held,
              std::abs(cage(n, 1)) < 1e-9 || std::abs(cage(n, 2)) < 1e-9 || std::abs(cage(n, 2) - 3) < 1e-9);
  }
  body.fixed = {false, {Box{Vec3(0, 0, 0), Vec3(2, 2, 0)}}};
  EXPECT_EQ(fixed_nodes(body, bounds, cage).size(), 6U);
  body.fixed.boxes_m.push_back(Box{Vec3(5, 0, 0), Vec3(6, 2, 0)});
  EXPECT_THROW(fixed_nodes(body, bounds, cage), InputError);
  body.fixed = {};
  body.kind = Kind::rigid;
  EXPECT_EQ(fixed_nodes(body, bounds, cage).size(), std::size_t(cage.rows()));
  body.role = Role::free;  // moves
  EXPECT_TRUE(fixed_nodes(body, bounds, cage).empty());
}

}  // namespace
}  // namespace limber::scenes
