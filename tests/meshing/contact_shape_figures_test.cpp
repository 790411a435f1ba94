#include <gtest/gtest.h>

#include "core/threads.h"
#include "tests/meshing/contact_shapes.h"

namespace limber::meshing {
namespace {

// Bodies with an inside.
const std::map<std::string, Made>& solids() {
  static const std::map<std::string, Made> made = [] {
    std::map<std::string, Made> all;
    const auto add = [&](const char* name, SurfaceMesh surface) { all.emplace(name, std::move(surface)); };
    add("sphere", made_sphere(60));
    add("box", box_at_origin({1, 2, 3}));
    add("L", made_l_prism());
    add("torus", made_ring(0.25, 96, 40));
    add("crossing boxes",
        joined(box_at_origin({1, 1, 1}), moved(box_at_origin({1, 1, 1}), {0.6, 0.37, 0.21})));
    return all;
  }();
  return made;
}

TEST(ContactShape, TheFieldOfASphereIsItsDistance) {
  const Made& made = solids().at("sphere");
  Rng rng(1, 0);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 p = point_of(bounding_box(made.cage.positions), rng);
    // The facets lie up to 0.0014 below the sphere.
    EXPECT_NEAR(made.shape.field.at(p), p.norm() - 1, 0.008 + 0.03 * std::abs(p.norm() - 1)) << p.transpose();
  }
  EXPECT_LT(made.report.error_p99_m, 0.0025 * 2);
  EXPECT_NEAR(made.report.characteristic_m, 2, 0.02);
}

TEST(ContactShape, TheFieldOfABoxIsItsDistanceExceptAtItsEdges) {
  const Vec3 size(1, 2, 3);
  const Made& made = solids().at("box");
  const double cell = made.shape.field.cell_m;
  Rng rng(2, 0);
  double sum = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 p = point_of(bounding_box(made.cage.positions), rng);
    const double error = std::abs(made.shape.field.at(p) - distance_to_box(p, size));
    EXPECT_LT(error, 0.5 * cell) << p.transpose();
    sum += error;
  }
  EXPECT_LT(sum / 20'000, 0.02 * cell);
  EXPECT_LT(made.report.error_p99_m, 0.0025 * made.report.characteristic_m);
  EXPECT_NEAR(made.report.characteristic_m, 6.0 * 6 / 22, 0.03);
}

TEST(ContactShape, OutsideItsGridAFieldIsThatOfTheNearestPointOfTheGrid) {
  const Made& made = solids().at("sphere");
  const DistanceField& field = made.shape.field;
  const Vec3 last =
      field.lower_m + field.cell_m * Vec3(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  EXPECT_EQ(field.at(last + Vec3(5, 0.1, 7)), field.unit_m * field.values.back());
  EXPECT_EQ(field.at(field.lower_m - Vec3(1, 1, 1)), field.unit_m * field.values.front());
}

// What is within has no part in it: walls of a chamber that is counted twice, and of parts that overlap.
TEST(ContactShape, InnerWallsAreNotSeen) {
  SurfaceMesh chamber = made_sphere(30);
  chamber.positions *= 0.5;
  const Made nested(joined(made_sphere(40), chamber));
  EXPECT_NEAR(nested.shape.field.at({0.5, 0, 0}), -0.5, 0.03);
  EXPECT_GT(nested.shape.samples.positions_m.rowwise().norm().minCoeff(), 0.9);
  EXPECT_NEAR(nested.shape.samples.area_m2.sum(), area(made_sphere(40)), 1e-9);

  // A beam that sticks in a box: without the inner walls, the rim of the beam is what is nearest.
  const Vec3 box(1, 1, 1), beam(1, 0.6, 0.6), at(0.5, 0.2, 0.2);
  const Made crossing(joined(box_at_origin(box), moved(box_at_origin(beam), at)));
  EXPECT_NEAR(crossing.shape.field.at({0.75, 0.5, 0.5}), -std::hypot(0.25, 0.3), 0.02);  // without: -0.25
  // The surface is judged in pieces of a thirty-second of its size.
  const double hidden = 2 * 0.36 + 4 * 0.5 * 0.6;
  EXPECT_NEAR(crossing.shape.samples.area_m2.sum(), area(crossing.surface) - hidden, 0.1);
  for (const Vec3 p : crossing.shape.samples.positions_m.rowwise())
    EXPECT_NEAR(std::min(distance_to_box(p, box), distance_to_box(p - at, beam)), 0, 1e-9) << p.transpose();
}

TEST(ContactShape, TheSurfaceIsCoveredBySamplesThatKeepApart) {
  for (const auto& [name, made] : solids()) {
    SCOPED_TRACE(name);
    const SurfaceMesh& surface = made.surface;
    const double size = size_of(surface);
    const Points& samples = made.shape.samples.positions_m;
    EXPECT_GT(samples.rows(), 250);
    EXPECT_LE(samples.rows(), (1 + ContactShapeSettings().max_tips) * ContactShapeSettings().max_samples);
    EXPECT_GT(made.shape.samples.area_m2.minCoeff(), 0);
    const double least =
        ContactShapeSettings().min_spacing * std::max(made.report.characteristic_m, size / 3);
    // No two closer than the least spacing, but for those on the two sides of an edge or a wall.
    int close = 0;
    for (Eigen::Index a = 0; a < samples.rows(); ++a)
      for (Eigen::Index b = 0; b < a; ++b) close += (samples.row(a) - samples.row(b)).norm() < least;
    EXPECT_LT(close, 0.02 * double(samples.rows()));
    Rng rng(4, 0);
    for (int i = 0; i < 3000; ++i) {
      const Vec3 p = surface_point(surface, rng);
      if (made.shape.field.at(p) < -0.01 * size) continue;  // an inner wall
      EXPECT_LT((samples.rowwise() - p.transpose()).rowwise().norm().minCoeff(),
                1.06 * ContactShapeSettings().max_flat_spacing * size)
          << p.transpose();
    }
  }
}

// The flat floor under a body in any position is met by samples as deep as by the body, to a share of its
// size.
TEST(ContactShape, WhatSticksOutIsSampled) {
  for (const auto& [name, made] : solids()) {
    SCOPED_TRACE(name);
    const SurfaceMesh& surface = made.surface;
    Rng rng(5, 0);
    double worst = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 down = rng.direction();
      worst = std::max(
          worst, (surface.positions * down).maxCoeff() - (made.shape.samples.positions_m * down).maxCoeff());
    }
    EXPECT_LT(worst, 2 * ContactShapeSettings().missed_depth * made.report.characteristic_m);
  }
}

// Rounded corners of a large plate, too, whose creases are none: they are small beside its size, and its
// thickness is what others are pressed by.
TEST(ContactShape, RoundedCornersOfAPlateAreSampled) {
  constexpr double radius = 0.025;
  const Vec3 middle_of_corner = 0.5 * Vec3(3, 2, 0.35) - Vec3::Constant(radius);
  const Eigen::AngleAxisd aside(0.01, Vec3::UnitZ());  // no vertex lies between two corners
  SurfaceMesh surface = made_sphere(61);
  for (auto p : surface.positions.rowwise()) {
    const Vec3 n = aside * p.transpose();
    p = radius * n + n.cwiseSign().cwiseProduct(middle_of_corner);
  }
  const Made made(surface);
  Rng rng(5, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 down = rng.direction();
    ASSERT_LT((surface.positions * down).maxCoeff() - (made.shape.samples.positions_m * down).maxCoeff(),
              2 * ContactShapeSettings().missed_depth * made.report.characteristic_m)
        << down.transpose();
  }
}

// Bumps narrower than the spacing of as many samples as there may be: no plane that rests on samples, however
// it leans, has a bump between them inside by more than may be missed.
TEST(ContactShape, TipsBetweenSamplesAreSampled) {
  SurfaceMesh surface = made_sphere(120);
  for (auto p : surface.positions.rowwise())
    p *= 1 + 0.04 * std::sin(50 * p.x()) * std::sin(50 * p.y()) * std::sin(50 * p.z());
  const Made made(surface);
  const Points& samples = made.shape.samples.positions_m;
  const Points normals = vertex_normals(surface.positions, surface.triangles);
  constexpr double radius = 0.2;  // of what is about a vertex
  Rng rng(7, 0);
  double worst = 0;
  for (int i = 0; i < 20'000; ++i) {
    const int v = rng.below(int(surface.positions.rows()));
    const Vec3 p = surface.positions.row(v);
    const Vec3 n = (Vec3(normals.row(v)) + 0.5 * rng.uniform() * rng.direction()).normalized();
    double above = 1;
    for (const Vec3 s : samples.rowwise())
      if ((p - s).squaredNorm() < radius * radius) above = std::min(above, n.dot(p - s));
    worst = std::max(worst, above);
  }
  EXPECT_LT(worst, 2 * ContactShapeSettings().missed_depth * made.report.characteristic_m);
}

// A small ball of radius R pressed against a face, an edge or a rim finds a sample within the spacing s of
// it, and so goes s²/2R deeper at most.
TEST(ContactShape, ABallThatIsPressedInMeetsASample) {
  for (const auto& [name, made] : solids()) {
    SCOPED_TRACE(name);
    const SurfaceMesh& surface = made.surface;
    const double size = size_of(surface), radius = 0.25 * size;
    const Points normals = vertex_normals(surface.positions, surface.triangles);
    Rng rng(6, 0);
    for (int i = 0; i < 300; ++i) {
      const int v = rng.below(int(surface.positions.rows()));
      if (std::abs(made.shape.field.at(surface.positions.row(v))) > 0.01 * size) continue;
      const Vec3 center = Vec3(surface.positions.row(v)) + radius * Vec3(normals.row(v));
      const auto nearest = [&](const Points& p) {
        return (p.rowwise() - center.transpose()).rowwise().norm().minCoeff();
      };
      EXPECT_LT(nearest(made.shape.samples.positions_m) - nearest(surface.positions),
                std::pow(1.06 * ContactShapeSettings().max_flat_spacing * size, 2) / (2 * radius));
    }
  }
}

TEST(ContactShape, SamplesAreBoundToTheTetThatHoldsThem) {
  const Made& made = solids().at("sphere");
  const SurfaceSamples& s = made.shape.samples;
  for (Eigen::Index i = 0; i < s.tet_from_sample.size(); ++i) {
    Vec3 p = Vec3::Zero();
    for (int k = 0; k < 4; ++k)
      p += s.weights(i, k) * Vec3(made.cage.positions.row(made.cage.tets(s.tet_from_sample[i], k)));
    EXPECT_LT((p - Vec3(s.positions_m.row(i))).norm(), 1e-12);
    EXPECT_GE(s.weights.row(i).minCoeff(), -1e-9);
    EXPECT_NEAR(s.weights.row(i).sum(), 1, 1e-12);
    EXPECT_GE(s.tet_from_sample[i], s.tet_from_sample[std::max<Eigen::Index>(i, 1) - 1]);
  }
}

// Against points thrown into each tet.
TEST(ContactShape, NoPointInsideIsBelowTheLeastWeights) {
  for (const auto& [name, made] : solids()) {
    SCOPED_TRACE(name);
    const SurfaceMesh& surface = made.surface;
    Rng rng(7, 0);
    double gap = 0;
    int met = 0;
    for (int t = 0; t < made.cage.tets.rows(); ++t) {
      Eigen::RowVector4d least = Eigen::RowVector4d::Constant(2);
      double lowest = 1e300;
      for (int i = 0; i < 400; ++i) {
        Eigen::RowVector4d w;
        for (int k = 0; k < 4; ++k) w[k] = -std::log(1 - rng.uniform());
        w /= w.sum();
        Vec3 p = Vec3::Zero();
        for (int k = 0; k < 4; ++k) p += w[k] * Vec3(made.cage.positions.row(made.cage.tets(t, k)));
        lowest = std::min(lowest, made.shape.field.at(p));
        if (made.shape.field.at(p) <= 0) least = least.cwiseMin(w);
      }
      const Eigen::RowVector4d bound = made.shape.min_weight.row(t);
      for (int k = 0; k < 4; ++k) EXPECT_LE(bound[k], least[k]) << "tet " << t;
      EXPECT_GE(bound.minCoeff(), 0);
      if (least[0] <= 1) gap += (least - bound).mean(), ++met;
      EXPECT_TRUE(lowest <= 0.1 * size_of(surface) || bound.minCoeff() > 1) << "tet " << t;
    }
    // Nor is it far below: 400 points leave some room themselves.
    EXPECT_LT(gap / met, 0.06);
  }
}

TEST(ContactShape, SameBytesOnAnyNumberOfThreads) {
  for (const char* name : {"sphere", "hemisphere", "two spheres"}) {
    SCOPED_TRACE(name);
    const SurfaceMesh surface = models().at(name);
    set_thread_count(1);
    const Made one(surface);
    set_thread_count(2);
    const Made two(surface);
    set_thread_count(0);
    EXPECT_EQ(one.shape.field.values, two.shape.field.values);
    EXPECT_EQ(one.shape.samples.positions_m, two.shape.samples.positions_m);
    EXPECT_EQ(one.shape.samples.area_m2, two.shape.samples.area_m2);
    EXPECT_EQ(one.shape.samples.weights, two.shape.samples.weights);
    EXPECT_EQ(one.shape.min_weight, two.shape.min_weight);
  }
}

// The body goes with its cage, wherever and however large it is.
TEST(ContactShape, SizeAndPlaceOnlyScaleIt) {
  const SurfaceMesh surface = made_l_prism();
  const TetMesh cage = cage_of(surface);
  const ContactShape shape = make_contact_shape(surface, cage);
  const ContactShape large =
      make_contact_shape({1024 * surface.positions, surface.triangles}, {1024 * cage.positions, cage.tets});
  EXPECT_EQ(shape.field.values, large.field.values);
  EXPECT_EQ(1024 * shape.samples.positions_m, large.samples.positions_m);
  EXPECT_EQ(shape.min_weight, large.min_weight);
}

TEST(ContactShape, WhatHasNoInsideIsLeftToTheCage) {
  SurfaceMesh sheet = box_at_origin({1, 1, 1});
  sheet.triangles = sheet.triangles.topRows(2).eval();
  for (const auto& [name, surface] : std::map<std::string, SurfaceMesh>{
           {"sheet", sheet}, {"wafer", box_at_origin({5, 5, 0.005})}, {"soup", made_soup(60)}}) {
    SCOPED_TRACE(name);
    const TetMesh cage = cage_of(surface);
    ContactShapeReport report;
    const ContactShape shape = make_contact_shape(surface, cage, {}, &report);
    EXPECT_FALSE(shape.usable);
    EXPECT_EQ(shape.samples.tet_from_sample.size(), 0);
    EXPECT_EQ(shape.min_weight, Weights::Constant(cage.tets.rows(), 4, 2));
    ASSERT_EQ(report.warnings.size(), 1u);
    EXPECT_NE(report.warnings[0].find("contact goes by the cage"), std::string::npos);
    EXPECT_GT(shape.field.at(surface.positions.row(0)), 0);
  }
}

}  // namespace
}  // namespace limber::meshing
