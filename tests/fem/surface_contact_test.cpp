// Contact between fine surfaces that cages move (docs/contact.md, "On the fine surface").
#include "fem/detail/surface_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/error.h"
#include "core/random.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "tests/fem/lane.h"
#include "tests/fem/shapes.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::ball_surface;
using testing::cube;
using testing::grid;
using testing::Lane;
using testing::rounded_box_surface;
using testing::shape_of;

// Balls of radius 0.4 in cubes of edge 1, whose cages overlap by far when the balls touch.
WorldSpec two_balls(double spacing_m = 0.03, double friction = 0.2, bool phong = false) {
  WorldSpec spec;
  for (const double x : {0.0, 0.81}) {
    BodySpec body{x == 0 ? "one" : "other", cube({x, 0, 0}, 1, 3), {}, {}, BodyKind::deformable};
    body.material.friction = friction;
    body.shape = shape_of(body.cage, ball_surface({x, 0, 0}, 0.4), 0.02, spacing_m);
    body.phong = phong;
    spec.bodies.push_back(std::move(body));
  }
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = 0.005;
  return spec;
}

// The same world, whose contact is found once in so many steps of the elastic forces.
World with_substeps(World world, int substeps) {
  const double substep_s = world.substep_s(), contact_s = world.contact_dt_s / world.substeps;
  world.substeps = substeps;
  world.dt_s = substeps * substep_s, world.contact_dt_s = float(substeps * contact_s);
  return world;
}

WorldSpec barriers_with_bevels(bool phong) {
  Material material;
  material.poisson_ratio = 0.48;
  WorldSpec spec = testing::barriers(1, material);
  for (BodySpec& body : spec.bodies) {
    body.shape =
        shape_of(body.cage, rounded_box_surface(bounding_box(body.cage.positions), 0.08), 0.03, 0.06);
    body.phong = phong;
  }
  spec.contact_offset_m = 0.005;
  return spec;
}

std::vector<detail::SurfaceContact<float>> touches_of(Lane& lane) {
  detail::SurfaceContacts<float> contacts(lane.world, detail::kernels<float>(detail::best_isa(), 1), 1);
  return contacts.find(0, lane.view());
}

double deepest(const std::vector<detail::SurfaceContact<float>>& touches) {
  float depth = 0;
  for (const auto& contact : touches) depth = std::max(depth, contact.depth);
  return double(depth);
}

// Of surfaces that their cages move linearly, and by Phong Deformation.
class SurfaceContact : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Moved, SurfaceContact, ::testing::Bool(),
                         [](const auto& moved) { return moved.param ? "ByPhongDeformation" : "Linearly"; });

// Moved towards one another, or with everything stretched along the line of their centres by an affine map,
// the depth is that of the two balls, or ellipsoids, on that line.
TEST_P(SurfaceContact, DepthIsThatOfTheSurfacesThroughAffineMaps) {
  const World world = build_world(two_balls(0.03, 0.2, GetParam()));
  EXPECT_TRUE(touches_of(*std::make_unique<Lane>(world)).empty());
  for (const double stretch : {0.6, 1.0, 1.5})
    for (const double depth : {0.004, 0.012, 0.025}) {
      SCOPED_TRACE(fmt::format("stretch {}, depth {}", stretch, depth));
      Lane lane(world);
      const float closer = float((0.01 * stretch + depth) / stretch);
      lane.move(1, [&](const Vec3f& p) { return Vec3f(p - closer * Vec3f::UnitX()); });
      for (const int body : {0, 1})
        lane.move(body, [&](const Vec3f& p) { return Vec3f(float(stretch) * p.x(), p.y(), p.z()); });
      const auto touches = touches_of(lane);
      ASSERT_FALSE(touches.empty());
      EXPECT_NEAR(deepest(touches), depth + 0.005, 0.1 * depth + 0.0015);
      for (const auto& contact : touches) {  // out of the other body, against one's own centre
        EXPECT_GT(contact.normal[0] * (contact.against == 0 ? 1 : -1), 0.9f);
        EXPECT_NEAR(Eigen::Map<const Vec3f>(contact.normal).norm(), 1, 1e-5);
      }
    }
}

// A plate lies in a slit of 40 mm in a block whose field has cells of 100: there distances are off by half a
// cell at most, but the field has hardly any slope. Nothing is taken for many times as deep as it is said to
// be.
TEST_P(SurfaceContact, InSlitsThatTheFieldDoesNotSeeNothingIsDeep) {
  const auto block = [](const Vec3& p) {
    const auto half = [&](double side) {
      return rounded_box_surface({Vec3(-1, -1, side > 0 ? 0.02 : -1), Vec3(1, 1, side > 0 ? 1 : -0.02)},
                                 0.01)(p);
    };
    return std::min(half(1), half(-1));
  };
  WorldSpec spec;
  spec.bodies = {
      {"plate", testing::grid({-0.3, -0.3, 2}, {0.6, 0.6, 0.1}, 3, 3, 1), {}, {}, BodyKind::deformable},
      {"block", cube(Vec3::Zero(), 2, 4), {}, {}, BodyKind::immovable}};
  spec.bodies[0].shape =
      shape_of(spec.bodies[0].cage,
               rounded_box_surface({Vec3(-0.28, -0.28, 2.04), Vec3(0.28, 0.28, 2.06)}, 0.005), 0.01, 0.02);
  spec.bodies[1].shape = shape_of(spec.bodies[1].cage, block, 0.1, 0.05);
  spec.bodies[0].phong = GetParam();
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false, spec.contact_offset_m = 0.005;
  const World world = build_world(spec);
  int flat = 0;
  for (const double x : {0.0, 0.031, 0.077})
    for (const double z : {-0.005, 0.0, 0.005}) {
      Lane lane(world);
      lane.move(0, [&](const Vec3f& p) { return Vec3f(p + Vec3(x, x, z - 2.05).cast<float>()); });
      for (const auto& contact : touches_of(lane)) {
        if (contact.against != 1) continue;
        EXPECT_LT(contact.depth, 2 * 0.05 + 0.005) << x << ' ' << z;
        ++flat;
      }
    }
  EXPECT_GT(flat, 100);
}

// A bent ball slides over a slit and the edges of a block at rest whose field has cells of 120 mm, so that
// its slope is far from 1 and changes from cell to cell. The depth of a sample changes by no more than the
// ball goes: what jumps gives a light node more speed than it came with, again and again.
TEST_P(SurfaceContact, DepthsDoNotJump) {
  WorldSpec spec;
  const Vec3 start(0.2, 0.25, 1.2);
  spec.bodies = {{"ball", cube(start, 1, 2), {}, {}, BodyKind::deformable},
                 {"block", cube(Vec3::Zero(), 2, 4), {}, {}, BodyKind::immovable}};
  spec.bodies[0].shape = shape_of(spec.bodies[0].cage, ball_surface(start, 0.4), 0.02, 0.05);
  const auto block = [](const Vec3& p) {
    const auto part = [&](double from, double to) {
      return rounded_box_surface({Vec3(from, -0.6, -0.6), Vec3(to, 0.6, 0.7)}, 0.02)(p);
    };
    return std::min(part(-0.6, 0.38), part(0.43, 0.6));
  };
  spec.bodies[1].shape = shape_of(spec.bodies[1].cage, block, 0.12, 0.05);
  spec.bodies[0].phong = GetParam();
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false, spec.contact_offset_m = 0.04;
  const World world = build_world(spec);
  Lane lane(world);
  lane.move(0, [&](const Vec3f& p) {
    const Vec3f q = p - start.cast<float>();
    return Vec3f(p + Vec3f(0.9f * q.z() * q.z(), 0.7f * q.z() * q.z(), -0.15f + 0.5f * q.x() * q.x()));
  });
  std::map<int, float> before;
  constexpr float step = 0.5e-3f;
  float largest = 0;
  int followed = 0;
  for (int k = 0; k < 1200; ++k) {
    std::map<int, float> now;
    for (const auto& contact : touches_of(lane))
      if (contact.body == 0) now[contact.sample] = contact.depth;
    for (const auto& [sample, depth] : now) {
      const auto old = before.find(sample);
      if (k > 0) largest = std::max(largest, std::abs(depth - (old == before.end() ? 0 : old->second)));
      ++followed;
    }
    for (const auto& [sample, depth] : before)
      if (!now.contains(sample)) largest = std::max(largest, depth);
    before = std::move(now);
    lane.move(0, [&](const Vec3f& p) { return Vec3f(p + Vec3f(step, 0.7f * step, -0.1f * step)); });
  }
  EXPECT_GT(followed, 10000);
  EXPECT_LT(largest, 1.5f * step);
}

// A small ball is pressed into an ellipsoid, a ball that is drawn out and sheared, from twelve sides. Depths
// of its samples are those below the tangent plane at the nearest of many places of the ellipsoid.
TEST_P(SurfaceContact, DepthsInAnEllipsoidAreThoseOfBruteForce) {
  constexpr double radius = 0.4, small_radius = 0.12, offset = 1e-4;
  const Vec3 beside(0.65, 0, 0);
  WorldSpec spec;
  BodySpec big{"big", cube({0, 0, 0}, 1, 4), {}, {}, BodyKind::deformable};
  big.shape = shape_of(big.cage, ball_surface({0, 0, 0}, radius), 1.0 / 64, 0.02), big.phong = GetParam();
  BodySpec small{"small", cube(beside, 0.28, 2), {}, {}, BodyKind::deformable};
  small.shape = shape_of(small.cage, ball_surface(beside, small_radius), 0.01, 0.008),
  small.phong = GetParam();
  spec.bodies = {big, small};
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = offset;
  const World world = build_world(spec);
  std::vector<Vec3> directions;
  for (int i = 0; i < 20000; ++i) {
    const double z = 1 - (2 * i + 1.0) / 20000, turn = i * 2.399963229728653, r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  for (const double stretch : {0.55, 0.75, 1.0, 1.5}) {
    Eigen::Matrix3d map = Vec3(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch)).asDiagonal();
    map(1, 0) = 0.1;
    const Eigen::Matrix3d normal_map = map.inverse().transpose();
    std::vector<double> errors;
    Rng rng(3, 0);
    for (int k = 0; k < 12; ++k) {
      const Vec3 direction = rng.direction(), normal = (normal_map * direction).normalized();
      const Vec3 moved = map * (radius * direction) + (small_radius - 0.007 - 0.0015 * k) * normal - beside;
      Lane lane(world);
      lane.move(0, [&](const Vec3f& p) { return Vec3f(map.cast<float>() * p); });
      lane.move(1, [&](const Vec3f& p) { return Vec3f(p + moved.cast<float>()); });
      for (const auto& contact : touches_of(lane)) {
        if (contact.body != 1) continue;
        const Vec3 place = Eigen::Map<const Vec3f>(contact.place).cast<double>();
        std::size_t nearest = 0;
        double least = 1;
        for (std::size_t i = 0; i < directions.size(); ++i)
          if (const double d = (map * (radius * directions[i]) - place).squaredNorm(); d < least)
            least = d, nearest = i;
        const Vec3& n = directions[nearest];
        const double depth = (map * (radius * n) - place).dot((normal_map * n).normalized());
        if (depth > 0.002) errors.push_back(std::abs(double(contact.depth) - offset - depth) / depth);
      }
    }
    std::sort(errors.begin(), errors.end());
    SCOPED_TRACE(fmt::format("stretch {}: {} samples, median {:.1f} %, 90 in 100 below {:.1f} %", stretch,
                             errors.size(), 100 * errors[errors.size() / 2],
                             100 * errors[errors.size() * 9 / 10]));
    ASSERT_GT(errors.size(), 500U);
    EXPECT_LT(errors[errors.size() / 2], 0.025);
    EXPECT_LT(errors[errors.size() * 9 / 10], 0.1);
  }
}

TEST_P(SurfaceContact, ForcesKeepMomentumAndAngularMomentum) {
  const World world = build_world(two_balls(0.03, 0.2, GetParam()));
  Lane lane(world);
  Rng rng(11, 0);
  for (const int body : {0, 1})  // bent, so that places are not where linear deformation has them
    lane.move(body, [&](const Vec3f& p) {
      return Vec3f(p.x() - 0.04f * float(body), p.y() + 0.2f * p.x() * p.x(), p.z() - 0.15f * p.y() * p.x());
    });
  for (float& v : lane.v) v = float(rng.uniform(-0.3, 0.3));
  detail::SurfaceContacts<float> contacts(world, detail::kernels<float>(detail::best_isa(), 1), 1);
  contacts.add_forces(0, lane.view());
  Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
  double all = 0;
  for (int n = 0; n < world.nodes; ++n) {
    const Vec3 force = Eigen::Map<const Vec3f>(&lane.f[3 * n]).cast<double>();
    sum += force, torque += lane.node(n).cross(force), all += force.norm();
  }
  EXPECT_GT(all, 1);
  EXPECT_LT(sum.norm(), 1e-5 * all);
  EXPECT_LT(torque.norm(), 1e-5 * all);
}

// Where Phong Deformation moves a place at rest, in double and from its formula.
class PhongMap {
 public:
  PhongMap(const TetMesh& rest, const Points& now)
      : rest_(rest), now_(now), f_(std::size_t(rest.positions.rows())) {
    std::vector<double> volumes(f_.size(), 0.0);
    for (Eigen::Matrix3d& f : f_) f.setZero();
    for (Eigen::Index t = 0; t < rest.tets.rows(); ++t) {
      const double volume = edges(rest.positions, t).determinant();
      for (int i = 0; i < 4; ++i) {
        const std::size_t node = std::size_t(rest.tets(t, i));
        f_[node] += volume * edges(now, t) * edges(rest.positions, t).inverse(), volumes[node] += volume;
      }
    }
    for (std::size_t n = 0; n < f_.size(); ++n) f_[n] /= volumes[n];
  }
  Vec3 operator()(const Vec3& x) const {
    Eigen::Index best = 0;
    Eigen::Vector4d w = weights(x, 0);
    for (Eigen::Index t = 1; t < rest_.tets.rows(); ++t)
      if (const Eigen::Vector4d other = weights(x, t); other.minCoeff() > w.minCoeff()) best = t, w = other;
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 4; ++i) {
      const int n = rest_.tets(best, i);
      const Vec3 now = now_.row(n), rest = rest_.positions.row(n);
      sum += w[i] * (now + 0.5 * f_[std::size_t(n)] * (x - rest));
    }
    return sum;
  }

 private:
  Eigen::Matrix3d edges(const Points& x, Eigen::Index t) const {
    Eigen::Matrix3d e;
    for (int i = 0; i < 3; ++i) e.col(i) = x.row(rest_.tets(t, i + 1)) - x.row(rest_.tets(t, 0));
    return e;
  }
  Eigen::Vector4d weights(const Vec3& x, Eigen::Index t) const {
    Eigen::Vector4d w;
    w.tail<3>() = edges(rest_.positions, t).inverse() * (x - Vec3(rest_.positions.row(rest_.tets(t, 0))));
    w[0] = 1 - w.tail<3>().sum();
    return w;
  }
  const TetMesh& rest_;
  const Points& now_;
  std::vector<Eigen::Matrix3d> f_;
};

// A ball is pressed into a plate that is bent to a parabola, over the middle of a cell, where Phong
// Deformation has the plate 0.02 m above the chord. Depths are those of the nearest of many places of the
// true surface.
TEST(SurfaceContacts, PhongSurfacesTouchWhereTheyAre) {
  WorldSpec spec;
  const auto plate_surface = rounded_box_surface({{0, 0, 0}, {3, 1, 0.5}}, 0.06);
  BodySpec plate{
      "plate", testing::leaning_grid({0, 0, 0}, {3, 1, 0.5}, 6, 2, 2), {}, {}, BodyKind::deformable};
  plate.shape = shape_of(plate.cage, plate_surface, 0.02, 0.04), plate.phong = true;
  BodySpec ball{"ball", cube({1.75, 0.5, 1.2}, 0.8, 3), {}, {}, BodyKind::deformable};
  ball.shape = shape_of(ball.cage, ball_surface({1.75, 0.5, 1.2}, 0.3), 0.02, 0.03), ball.phong = true;
  spec.bodies = {ball, plate};
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = 0.005;
  const World world = build_world(spec);
  const auto dense = shape_of(plate.cage, plate_surface, 0.1, 0.011);
  for (const double depth : {0.0, 0.01, 0.03}) {
    SCOPED_TRACE(depth);
    Lane lane(world);
    lane.move(1, [](const Vec3f& p) {
      return Vec3f(p.x(), p.y(), p.z() - 0.35f * (p.x() - 1.75f) * (p.x() - 1.75f));
    });
    lane.move(0, [&](const Vec3f& p) { return Vec3f(p - float(0.4 + depth) * Vec3f::UnitZ()); });
    Points now(world.bodies[1].node_count(), 3);
    for (int n = 0; n < now.rows(); ++n) now.row(n) = lane.node(world.bodies[1].first_node + n);
    const PhongMap seen(world.bodies[1].cage, now);
    std::vector<Vec3> places, normals;
    for (Eigen::Index k = 0; k < dense->samples.positions_m.rows(); ++k) {
      const Vec3 x = dense->samples.positions_m.row(k);
      if ((seen(x) - Vec3(1.75, 0.5, 0.5)).norm() > 0.3) continue;
      Eigen::Matrix3d jacobian;
      Vec3 gradient;
      constexpr double h = 1e-4;
      for (int c = 0; c < 3; ++c) {
        jacobian.col(c) = (seen(x + h * Vec3::Unit(c)) - seen(x - h * Vec3::Unit(c))) / (2 * h);
        gradient[c] = (plate_surface(x + h * Vec3::Unit(c)) - plate_surface(x - h * Vec3::Unit(c))) / (2 * h);
      }
      places.push_back(seen(x)), normals.push_back((jacobian.transpose().inverse() * gradient).normalized());
    }
    const auto touches = touches_of(lane);
    double deepest = 0, worst = 0;
    int of_ball = 0;
    for (const auto& contact : touches) {
      if (contact.body != 0) continue;
      ++of_ball;
      const Vec3 place = Eigen::Map<const Vec3f>(contact.place).cast<double>();
      EXPECT_NEAR((place - Vec3(1.75, 0.5, 0.8 - depth)).norm(), 0.3,
                  0.004);  // on the ball, moved as a whole
      std::size_t nearest = 0;
      for (std::size_t k = 1; k < places.size(); ++k)
        if ((places[k] - place).norm() < (places[nearest] - place).norm()) nearest = k;
      const double expected = 0.005 - normals[nearest].dot(place - places[nearest]);
      worst = std::max(worst, std::abs(double(contact.depth) - expected));
      deepest = std::max(deepest, double(contact.depth));
    }
    EXPECT_GT(of_ball, 2);
    EXPECT_NEAR(deepest, depth + 0.005, 0.1 * depth + 0.002);
    EXPECT_LT(worst, 0.1 * depth + 0.002);
  }
}

// Beside a plate that is folded by 70°, a ball is touched only where the plate is: tets that fold away from
// one another do not reach through the air between them.
TEST(SurfaceContacts, FoldsTouchNothingInTheAir) {
  constexpr double offset = 0.005, spacing = 0.01, angle = 70 * M_PI / 180;
  WorldSpec spec;
  const auto plate_surface = rounded_box_surface({{0, 0, 0}, {2, 0.6, 0.3}}, 0.02);
  BodySpec plate{
      "plate", testing::leaning_grid({0, 0, 0}, {2, 0.6, 0.3}, 4, 2, 2), {}, {}, BodyKind::deformable};
  plate.shape = shape_of(plate.cage, plate_surface, 0.01, 0.03);
  BodySpec ball{"ball", cube({1, 0.3, 0.7}, 0.6, 3), {}, {}, BodyKind::deformable};
  ball.shape = shape_of(ball.cage, ball_surface({1, 0.3, 0.7}, 0.2), 0.02, 0.015);
  spec.bodies = {ball, plate};
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = offset;
  const World world = build_world(spec);
  const SurfaceSamples dense = shape_of(plate.cage, plate_surface, 0.1, spacing)->samples;
  int touched = 0;
  for (const double across : {-0.15, -0.1, -0.05, 0.0, 0.05})
    for (const double above : {0.19, 0.2, 0.205, 0.22, 0.24}) {
      SCOPED_TRACE(fmt::format("{} across, {} above", across, above));
      Lane lane(world);
      lane.move(1, [&](const Vec3f& p) {  // downwards beyond the middle, about its upper edge
        if (p.x() <= 1.01f) return p;
        const float s = float(std::sin(angle)), c = float(std::cos(angle)), x = p.x() - 1, z = p.z() - 0.3f;
        return Vec3f(1 + c * x + s * z, p.y(), 0.3f - s * x + c * z);
      });
      lane.move(0, [&](const Vec3f& p) { return Vec3f(p + Vec3f(float(across), 0, float(above) - 0.4f)); });
      std::vector<Vec3> places;
      for (Eigen::Index k = 0; k < dense.positions_m.rows(); ++k) {
        const auto& tet =
            world.topology.tets[std::size_t(world.bodies[1].first_tet + dense.tet_from_sample[k])];
        Vec3 place = Vec3::Zero();
        for (int i = 0; i < 4; ++i) place += dense.weights(k, i) * lane.node(tet.node[i]);
        places.push_back(place);
      }
      for (const auto& contact : touches_of(lane)) {
        if (contact.body != 0) continue;
        ++touched;
        const Vec3 place = Eigen::Map<const Vec3f>(contact.place).cast<double>();
        double nearest = 1;
        for (const Vec3& p : places) nearest = std::min(nearest, (p - place).norm());
        EXPECT_LT(nearest, contact.depth + 2 * offset + spacing);
      }
    }
  EXPECT_GT(touched, 20);
}

// A cube pressed onto the floor by gravity sinks by g h²/β at most, whatever the number of its samples: they
// share the stiffness.
TEST(SurfaceContacts, TheNumberOfSamplesDoesNotChangeTheStiffness) {
  std::map<double, double> sunk;
  for (const double spacing : {0.13, 0.06, 0.03}) {
    WorldSpec spec = testing::alone({"cube", cube({0, 0, 0.51}, 1, 2), {}, {}, BodyKind::deformable});
    BodySpec& body = spec.bodies[0];
    body.material.youngs_modulus_pa = 1e6, body.material.damping_ratio = 0.3;
    body.shape =
        shape_of(body.cage, rounded_box_surface(bounding_box(body.cage.positions), 0.02), 0.05, spacing);
    spec.bounds_m = {Vec3(-5, -5, 0), Vec3(5, 5, 10)};
    spec.walls = true;
    spec.gravity_m_s2 = {0, 0, -10};
    const World world = build_world(spec);
    Control coast;
    coast.steps = int(2 / world.dt_s);
    const State end = propagate(world, rest_state(world), coast).end;
    double mass = 0;
    for (int n = 0; n < world.nodes; ++n)
      if (world.bodies[0].cage.positions(n, 2) < 0.02) mass += world.tables64.node_mass[n];
    sunk[spacing] = -double(body_positions(world, end, 0).col(2).minCoeff());
    EXPECT_LT(mean_speed_m_s(world, end, 0), 1e-3);
    // The nodes below bear all of the mass.
    const double expected =
        10 * world.contact_dt_s * world.contact_dt_s / detail::surface_beta * world.bodies[0].mass_kg / mass;
    EXPECT_GT(sunk[spacing], 0.3 * expected);
    EXPECT_LT(sunk[spacing], 3 * expected);
  }
  EXPECT_NEAR(sunk[0.03] / sunk[0.06], 1, 0.3);
}

// A block that is held below is pushed into a wall with its foot, up to 2 mm. Samples just above the held
// nodes hang on them nearly alone; what they are set against must not fall to the others.
TEST_P(SurfaceContact, NoNodeBearsWhatHeldOnesDo) {
  WorldSpec spec = testing::alone({"block", cube({0, 0, 0.5}, 1, 3), {}, {}, BodyKind::deformable});
  BodySpec& body = spec.bodies[0];
  for (int n = 0; n < body.cage.positions.rows(); ++n)
    if (body.cage.positions(n, 2) < 0.01) body.fixed_nodes.push_back(n);
  body.shape = shape_of(body.cage, rounded_box_surface(bounding_box(body.cage.positions), 0.002), 0.02, 0.01);
  body.phong = GetParam();
  spec.bounds_m = {Vec3(-0.5, -5, -5), Vec3(5, 5, 5)};
  spec.walls = true;
  const World world = build_world(spec);
  Lane lane(world);
  lane.move(0, [](const Vec3f& p) { return Vec3f(p - 0.002f * (1 - p.z() / 0.05f) * Vec3f::UnitX()); });
  detail::SurfaceContacts<float> contacts(world, detail::kernels<float>(detail::best_isa(), 1), 1);
  std::vector<detail::ContactRecord<float>> records;
  contacts.record_to(&records);
  contacts.add_forces(0, lane.view());
  double heaviest = 0, told_in_all = 0, all = 0;
  for (const double mass : world.bodies[0].node_mass_kg) heaviest = std::max(heaviest, mass);
  const double most = detail::surface_beta * heaviest * 0.002 / (world.contact_dt_s * world.contact_dt_s);
  for (int n = 0; n < world.nodes; ++n) {
    EXPECT_LT(lane.f[3 * n], 1.1 * most) << n;
    all += double(lane.f[3 * n]);
  }
  for (const auto& one : records) told_in_all += double(one.force[0]);
  EXPECT_GT(all, 1);
  EXPECT_LT(told_in_all, most);
  if (!GetParam()) {  // whose weights are not negative
    EXPECT_NEAR(told_in_all, all, 1e-4 * all);
  }
}

// Nothing blows up, however many samples touch: cubes thrown at one another, face on face and edge on face.
TEST_P(SurfaceContact, ThrownBodiesComeApartWithTheirMomentumAndNoMoreEnergy) {
  const World built = build_world(two_balls(0.02, 0, GetParam()));
  for (const auto& [speed, substeps] :
       {std::pair(1.0, 1), std::pair(4.0, 1), std::pair(8.0, 1), std::pair(1.0, 8), std::pair(4.0, 2)}) {
    SCOPED_TRACE(fmt::format("{} m/s, {} substeps", speed, substeps));
    const World world = with_substeps(built, substeps);
    State state = rest_state(world);
    for (int n = 0; n < world.bodies[0].node_count(); ++n) state.velocities[3 * n] = float(speed);
    const double before = kinetic_energy_j(world, state);
    Control coast;
    coast.steps = int(0.6 / world.dt_s);
    const Rollout rollout = propagate(world, state, coast);
    ASSERT_EQ(rollout.outcome.status, RunStatus::ok) << rollout.outcome.reason;
    EXPECT_EQ(inverted_tets(world, rollout.end), 0);
    EXPECT_LT(kinetic_energy_j(world, rollout.end) + elastic_energy_j(world, rollout.end), 1.001 * before);
    EXPECT_GT(center_velocity_m_s(world, rollout.end, 1).x(), 0.6 * speed);
    EXPECT_LT(center_of_mass_m(world, rollout.end, 0).x(), center_of_mass_m(world, rollout.end, 1).x() - 0.7);
  }
}

// As many steps of the elastic forces as a step of contact has room for: one where a scene allows no more,
// and one between cages.
TEST(SurfaceContacts, StepsAreAsLongAsTheSmallestBodyAllows) {
  WorldSpec spec = two_balls();
  spec.bodies[1].cage = testing::grid({0.81 - 0.5, -0.5, -0.5}, {1, 1, 1}, 6, 6, 6);
  spec.bodies[1].shape = shape_of(spec.bodies[1].cage, ball_surface({0.81, 0, 0}, 0.4), 0.02, 0.03);
  for (double scale : {10.0, 0.1}) {
    WorldSpec scaled = spec;
    for (BodySpec& body : scaled.bodies) body.material.youngs_modulus_pa *= scale;
    const World world = build_world(scaled);
    // 6 V/A of a cube is its edge.
    EXPECT_LE(world.dt_s, std::max(1.5e-3, world.substep_s()));
    EXPECT_GT(world.dt_s + world.substep_s(), std::min(1.5e-3, 9 * world.substep_s()));
    EXPECT_EQ(world.substep_s(), double(float(world.substep_s())));
    EXPECT_EQ(world.contact_dt_s, double(float(world.dt_s)));
    EXPECT_EQ(world.substeps > 1, scale > 1);
    scaled.max_dt_s = 1.5 * world.substep_s();
    const World slower = build_world(scaled);
    EXPECT_EQ(slower.substeps, 1);
    EXPECT_EQ(slower.dt_s, world.substep_s());
  }
  for (BodySpec& body : spec.bodies) body.shape = nullptr;
  spec.bodies[1].cage.positions.col(0).array() += 1;
  EXPECT_EQ(build_world(spec).substeps, 1);
}

// Forces that are held for several steps feed no oscillation, even where nothing damps it: balls without
// damping fall on the floor and on one another, and the energy of all never grows.
TEST(SurfaceContacts, ForcesThatAreHeldGiveNoEnergy) {
  WorldSpec spec = two_balls(0.03, 0);
  for (BodySpec& body : spec.bodies) body.material.damping_ratio = 0;
  spec.bounds_m = {Vec3(-0.6, -0.6, -0.55), Vec3(1.4, 0.6, 5)};
  spec.walls = true, spec.gravity_m_s2 = {-1, 0, -3};
  for (const int substeps : {1, 2, 4, 8}) {
    SCOPED_TRACE(substeps);
    const World world = with_substeps(build_world(spec), substeps);
    const auto energy = [&](const State& state) {
      double sum = kinetic_energy_j(world, state) + elastic_energy_j(world, state);
      for (int b : {0, 1})
        sum -=
            world.bodies[std::size_t(b)].mass_kg * spec.gravity_m_s2.dot(center_of_mass_m(world, state, b));
      return sum;
    };
    State state = rest_state(world);
    const double before = energy(state), scale = world.bodies[0].mass_kg * 3 * 0.3;
    double highest = before;
    Control coast;
    coast.steps = int(0.05 / world.dt_s);
    for (int look = 0; look < 200; ++look) {
      state = propagate(world, state, coast).end;
      highest = std::max(highest, energy(state));
    }
    EXPECT_LT(highest, before + 0.02 * scale);
    EXPECT_LT(energy(state), before);
  }
}

// Friction goes on from substep to substep: on a slope of tan θ 0.4 a soft slab stays at μ 0.45 and falls
// asleep, and slides at μ 0.3 as Coulomb says, however many substeps a step has.
TEST(SurfaceContacts, FrictionHoldsAndSlidesInSubsteps) {
  const double angle = std::atan(0.4), g = 9.81;
  for (const int substeps : {1, 2, 4})
    for (const double friction : {0.45, 0.3}) {
      SCOPED_TRACE(fmt::format("{} substeps, friction {}", substeps, friction));
      Material material;
      material.youngs_modulus_pa = 2e4, material.friction = friction, material.damping_ratio = 0.3;
      WorldSpec spec;
      spec.bodies = {
          {"slab", grid({1, -0.5, 0}, {1, 1, 0.5}, 4, 4, 2), material, {}, BodyKind::deformable},
          {"slope", grid({0, -1, -0.5}, {6, 2, 0.5}, 12, 4, 1), material, {}, BodyKind::immovable}};
      for (BodySpec& body : spec.bodies)
        body.shape =
            shape_of(body.cage, rounded_box_surface(bounding_box(body.cage.positions), 0.02), 0.03, 0.04);
      spec.bodies[0].phong = true;
      spec.contact_offset_m = 0.005, spec.rest_speed_m_s = 0.001;
      spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
      spec.gravity_m_s2 = g * Vec3(std::sin(angle), 0, -std::cos(angle));
      const World world = with_substeps(build_world(spec), substeps);
      const bool holds = friction > 0.4;
      Control coast;
      coast.steps = int((holds ? 6 : 0.5) / world.dt_s);
      const State landed = propagate(world, rest_state(world), coast).end;
      coast.steps = int(0.5 / world.dt_s);
      const State end = propagate(world, landed, coast).end;
      if (holds) {
        EXPECT_LE((center_of_mass_m(world, end, 0) - center_of_mass_m(world, landed, 0)).norm(), 5e-4);
        EXPECT_EQ(mean_speed_m_s(world, end, 0), 0) << "it does not sleep";
      } else {
        const auto momentum = [&](const State& state) {  // along the slope
          double sum = 0;
          for (int n = 0; n < world.bodies[0].node_count(); ++n)
            sum += world.tables64.node_mass[n] * state.velocities[3 * n];
          return sum;
        };
        const double gained = (momentum(end) - momentum(landed)) / world.bodies[0].mass_kg,
                     coulombs = g * (std::sin(angle) - friction * std::cos(angle)) * coast.steps * world.dt_s;
        EXPECT_NEAR(gained, coulombs, 0.05 * coulombs);
      }
    }
}

// A rigid ball that is put on a slope of tan θ 0.08, in touch, rolls down by itself, though not as far as a
// ball without facets would, 5/14 g sin θ t².
TEST(SurfaceContacts, ABallInTouchRolls) {
  const double angle = std::atan(0.08), g = 9.81, radius = 0.4;
  Material material;
  material.friction = 0.5;
  WorldSpec spec;
  spec.bodies = {{"ball", cube({0, 0, radius}, 0.9, 3), material, {}, BodyKind::rigid},
                 {"slope", grid({-1, -1, -0.3}, {4, 2, 0.3}, 8, 4, 1), material, {}, BodyKind::immovable}};
  spec.bodies[0].shape = shape_of(spec.bodies[0].cage, ball_surface({0, 0, radius}, radius), 0.03, 0.03);
  spec.bodies[1].shape =
      shape_of(spec.bodies[1].cage, rounded_box_surface(bounding_box(spec.bodies[1].cage.positions), 0.02),
               0.03, 0.04);
  spec.contact_offset_m = 0.004;
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.gravity_m_s2 = g * Vec3(std::sin(angle), 0, -std::cos(angle));
  const World world = build_world(spec);
  Control coast;
  coast.steps = int(1 / world.dt_s);
  const State end = propagate(world, rest_state(world), coast).end;
  const double way = (center_of_mass_m(world, end, 0) - center_of_mass_m(world, rest_state(world), 0)).x(),
               of_round_ball = 5.0 / 14 * g * std::sin(angle);
  EXPECT_GT(way, 0.5 * of_round_ball);
  EXPECT_LT(way, 1.05 * of_round_ball);
}

// A ball falls on the floor and on a cube there, and all come to rest: what is loaded anew after each step
// knows nothing of sleep, nor of lists, and steps alike.
TEST(SurfaceContacts, StepsOneByOneAreAllAtOnce) {
  WorldSpec spec = two_balls(0.04, 0.5);
  for (BodySpec& body : spec.bodies) body.material.damping_ratio = 1;
  spec.bounds_m = {Vec3(-5, -5, -0.401), Vec3(5, 5, 5)};
  spec.walls = true, spec.gravity_m_s2 = {0, 0, -2}, spec.rest_speed_m_s = 0.05;
  for (BodySpec& body : spec.bodies) {
    const Vec3 center = body.name == "one" ? Vec3(0, 0, 0) : Vec3(0.81, 0, 0.1);
    body.cage = cube(center, 0.8, 3);
    body.shape = shape_of(body.cage, ball_surface(center, 0.395), 0.02, 0.04);
  }
  for (const int substeps : {1, 3}) {
    SCOPED_TRACE(substeps);
    const World world = with_substeps(build_world(spec), substeps);
    Control coast, one;
    coast.steps = int(4 / world.dt_s), one.steps = 1;
    const State whole = propagate(world, rest_state(world), coast).end;
    State stepped = rest_state(world);
    Batch batch(world, 1);
    for (int step = 0; step < coast.steps; ++step) {
      batch.load(0, stepped, one);
      batch.advance();
      batch.store(0, stepped);
    }
    EXPECT_EQ(stepped, whole);
    for (const float v : whole.velocities) ASSERT_EQ(v, 0);  // all sleep
  }
}

// A ball rests on a block while another goes about within its box, so that neither sleeps; then it is struck,
// and comes to rest again. Contacts that were kept are those that are found anew at each step.
TEST_P(SurfaceContact, WhatStaysTouchesAsItDid) {
  WorldSpec spec = two_balls(0.04, 0.5, GetParam());
  for (BodySpec& body : spec.bodies) body.material.damping_ratio = 1;
  spec.bodies.push_back({"block", cube({0, 0, -1.4}, 2, 2), {}, {}, BodyKind::immovable});
  spec.bodies[2].shape = shape_of(
      spec.bodies[2].cage, rounded_box_surface({Vec3(-1, -1, -2.3), Vec3(1, 1, -0.41)}, 0.02), 0.1, 0.08);
  spec.gravity_m_s2 = {0, 0, -2}, spec.rest_speed_m_s = 0.05;
  spec.robot = 1;
  spec.bodies[1].gravity_m_s2 = Vec3::Zero();
  const World world = build_world(spec);
  Batch batch(world, 1);
  const State start = rest_state(world);
  const auto run = [&](State state, Control control, bool anew) {
    for (int left = control.steps; left > 0; left -= control.steps) {
      if (anew) control.steps = 1, batch.load(0, start, control);  // forgets all lists
      batch.load(0, state, control);
      batch.advance();
      batch.store(0, state);
    }
    return state;
  };
  State state = start;
  int rested = 0, moved = 0;
  const std::pair<double, Vec3f> legs[] = {{2, {0, 0, 0}},    {0.3, {0, 0, 1}}, {0.3, {0, 0, -1}},
                                           {0.3, {-2, 0, 0}}, {0.3, {2, 0, 0}}, {1, {0, 0, 0}},
                                           {0.3, {0, 0, -1}}};
  for (const auto& [duration_s, push_m_s2] : legs) {
    Control control;
    control.manipulation = Manipulation::body, control.force_n = float(world.bodies[1].mass_kg) * push_m_s2;
    control.steps = int(duration_s / world.dt_s);
    const State whole = run(state, control, false);
    ASSERT_EQ(run(state, control, true), whole) << push_m_s2.transpose();
    state = whole;
    const bool rests =
        std::all_of(state.velocities.begin(), state.velocities.begin() + 3 * world.bodies[0].node_count(),
                    [](float v) { return v == 0; });
    (rests ? rested : moved)++;
  }
  EXPECT_GE(rested, 3);
  EXPECT_GE(moved, 1);
}

TEST_P(SurfaceContact, TheAgeOfListsChangesNothing) {
  const World world = build_world(barriers_with_bevels(GetParam()));
  Batch batch(world, 1);
  const State rest = rest_state(world);
  // Where a lane goes on from where it is, its lists are kept, unless it was elsewhere in between.
  const auto run = [&](State state, Control control, int calls, bool forget) {
    control.steps /= calls;
    for (int i = 0; i < calls; ++i) {
      if (forget) batch.load(0, rest, control);
      batch.load(0, state, control);
      batch.advance();
      batch.store(0, state);
    }
    return state;
  };
  State state = rest;
  Rng rng(5, 1);
  int touched = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    Control control;
    control.manipulation = Manipulation::body;
    control.force_n = Vec3f(300, 0, i < 20 ? 100.f : -100.f) + (400 * rng.direction()).cast<float>();
    control.steps = 150;
    const State whole = run(state, control, 1, true);
    ASSERT_EQ(run(state, control, 150, true), whole);
    ASSERT_EQ(run(state, control, 50, false), whole);
    state = whole;
    for (const PairForce& pair : pair_forces(contact_forces(world, state))) touched += pair.other > 0;
  }
  EXPECT_GT(touched, 5);
}

// Two balls that are thrown at one another: a state is clear as long as the deepest of its touches is, as
// another program finds them, whatever the lane saw before.
TEST_P(SurfaceContact, AStateIsClearUntilSurfacesAreTooDeep) {
  constexpr double most = 0.004;
  WorldSpec spec = two_balls(0.03, 0.2, GetParam());
  spec.max_overlap_m = most;
  const World world = build_world(spec);
  State start = start_state(world);
  for (int n = 0; n < world.moving_nodes; ++n)
    start.velocities[std::size_t(3 * n)] = n < world.bodies[1].first_node ? 6.f : -6.f;
  Batch batch(world, 4);
  Control coast;
  coast.steps = 400;
  batch.load(1, start, coast);
  int clear = 0, deep = 0;
  for (State now; batch.steps_left(1) > 2;) {
    batch.advance(2);
    batch.peek(1, now);
    double overlap = 0;
    for (const ContactForce& f : contact_forces(world, now)) overlap = std::max(overlap, f.depth_m - 0.005);
    ASSERT_EQ(batch.is_clear(1), overlap <= most) << overlap;
    (overlap <= most ? clear : deep) += 1;
  }
  EXPECT_GT(clear, 5);
  EXPECT_GT(deep, 3);
}

// Of places side by side some need more steps of Newton's method than others. Nodes, their slopes and the
// bends of edges are made up.
TEST(SurfaceContacts, APlaceIsMeasuredAloneAsBesideOthers) {
  const World world = build_world(two_balls(0.03, 0.2, true));
  const auto& tets = world.topology.tets;
  Rng rng(5, 0);
  const auto noise = [&](std::size_t count, double size) {
    std::vector<float> numbers(count);
    for (float& x : numbers) x = float(rng.uniform(-size, size));
    return numbers;
  };
  std::vector<float> places = noise(4 * std::size_t(world.nodes), 0.03),
                     slopes = noise(12 * std::size_t(world.nodes), 0.1), bends = noise(24 * tets.size(), 0.1);
  for (int i = 0; i < 3 * world.nodes; ++i) {
    places[std::size_t(i / 3 * 4 + i % 3)] += world.tables.rest_positions[std::size_t(i)];
    slopes[std::size_t(i / 3 * 12 + i % 3 * 5)] += 1;
  }
  const detail::SurfaceRows<float> rows{places.data(),
                                        0,
                                        nullptr,
                                        world.surfaces.rest_places.data(),
                                        slopes.data(),
                                        bends.data(),
                                        world.surfaces.weight_gradients.data()};
  std::vector<detail::PlaceInTet<float>> asked(100);
  for (auto& one : asked) {
    one.tet = int(rng.below(int(tets.size() / 2)));
    std::copy_n(tets[std::size_t(one.tet)].node, 4, one.node);
    for (int c = 0; c < 3; ++c)
      one.place[c] =
          (places[std::size_t(4 * one.node[0] + c)] + places[std::size_t(4 * one.node[1] + c)]) / 2;
  }
  for (const auto isa : {detail::Isa::sse2, detail::Isa::avx2, detail::Isa::avx512}) {
    if (!detail::machine_has(isa)) continue;
    const auto answers = [&](std::size_t first, std::size_t count) {
      std::vector<float> columns[8];
      float* at[8];
      for (int i = 0; i < 8; ++i) columns[i].resize(count + 16), at[i] = columns[i].data();
      detail::kernels<float>(isa, 1).find_bent_surfaces(asked.data() + first, int(count), rows,
                                                        world.surfaces.bodies[0].field, 3e-4f, at);
      std::vector<std::array<float, 8>> all(count);
      for (std::size_t k = 0; k < count; ++k)
        for (std::size_t i = 0; i < 8; ++i) all[k][i] = columns[i][k];
      return all;
    };
    const auto together = answers(0, asked.size());
    int found = 0;
    for (std::size_t k = 0; k < asked.size(); ++k) {
      if (!(together[k][4] < 1e9f)) continue;
      EXPECT_EQ(together[k], answers(k, 1)[0]) << int(isa) << " " << k;
      ++found;
    }
    EXPECT_GT(found, 50);
    EXPECT_LT(found, 100);
  }
}

TEST_P(SurfaceContact, SameBitsForAnyLanesNeighboursAndInstructionSet) {
  const World world = build_world(barriers_with_bevels(GetParam()));
  Control press;
  press.manipulation = Manipulation::body;
  press.force_n = {900, 0, -100};
  press.steps = 20;
  State pressed = rest_state(world);
  const auto touches_plate = [&] {
    const auto pairs = pair_forces(contact_forces(world, pressed));
    return std::any_of(pairs.begin(), pairs.end(),
                       [](const PairForce& p) { return p.other == 1 && p.contacts > 3; });
  };
  for (int i = 0; i < 60 && !touches_plate(); ++i) pressed = propagate(world, pressed, press).end;
  ASSERT_TRUE(touches_plate());
  Rng rng(21, 0);
  std::vector<Control> controls;
  for (int i = 0; i < 20; ++i) {
    Control& control = controls.emplace_back();
    control.manipulation = Manipulation::body;
    control.steps = 20 + rng.below(60);
    control.force_n = (800 * rng.direction()).cast<float>();
  }
  const auto run = [&](int lanes, InstructionSet set) {
    std::vector<Rollout> rollouts;
    for (const Control& control : controls) rollouts.push_back({&pressed, control, {}, {}});
    Batch batch(world, lanes, set);
    propagate(batch, rollouts);
    std::vector<State> ends;
    for (const Rollout& rollout : rollouts) ends.push_back(rollout.end);
    return ends;
  };
  const std::vector<State> expected = run(1, InstructionSet::sse2);
  for (const int lanes : {1, 4, 8, 16})
    for (const auto set : {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512}) {
      SCOPED_TRACE(fmt::format("{} lanes, set {}", lanes, int(set)));
      try {
        EXPECT_EQ(run(lanes, set), expected);
      } catch (const InputError& lacking) {
        std::puts(lacking.what());
      }
    }
}

// A bar of 0.2 × 0.4 in the form of a U, whose arms swing at one another.
TEST(SurfaceContacts, ABodyTouchesItself) {
  constexpr double arm = 1.6, radius = 0.25;
  constexpr double length = 2 * arm + M_PI * radius;
  TetMesh cage = testing::grid({0, -0.13, -0.23}, {length, 0.26, 0.46}, 26, 2, 2);
  for (int n = 0; n < cage.positions.rows(); ++n) {
    const Vec3 p = cage.positions.row(n);
    const double bend = (p.x() - arm) / radius;
    cage.positions.row(n) =
        bend < 0 ? Vec3(arm - p.x(), -radius - p.y(), p.z()).transpose()
        : bend > M_PI
            ? Vec3(p.x() - arm - M_PI * radius, radius + p.y(), p.z()).transpose()
            : Vec3(-(radius + p.y()) * std::sin(bend), -(radius + p.y()) * std::cos(bend), p.z()).transpose();
  }
  const testing::Distance bar = [](const Vec3& p) {
    const double across =
        p.x() < 0 ? std::abs(std::hypot(p.x(), p.y()) - radius) : std::abs(std::abs(p.y()) - radius);
    return std::max({across - 0.1, std::abs(p.z()) - 0.2, p.x() - (arm - 0.03)});
  };
  for (const bool self_contact : {false, true}) {
    SCOPED_TRACE(self_contact);
    WorldSpec spec = testing::alone({"bar", cage, {}, {}, BodyKind::deformable});
    spec.bodies[0].shape = shape_of(cage, bar, 0.03, 0.04);
    spec.bodies[0].self_contact = self_contact;
    spec.contact_offset_m = 0.005;
    const World world = build_world(spec);
    State state = rest_state(world);
    const Points rest = world.bodies[0].cage.positions;
    for (int n = 0; n < world.nodes; ++n)
      if (rest(n, 0) > 0) state.velocities[3 * n + 1] = float((rest(n, 1) > 0 ? -2 : 2) * rest(n, 0) / arm);
    Control coast;
    coast.steps = int(0.01 / world.dt_s);
    double least = 1;
    for (int i = 0; i < 60; ++i) {
      state = propagate(world, state, coast).end;
      const Points now = body_positions(world, state, 0);
      double lower = -1e9, upper = 1e9;  // the fine faces that look at one another, 0.03 in the cage
      for (int n = 0; n < world.nodes; ++n) {
        if (rest(n, 0) < 1.2) continue;
        if (rest(n, 1) < 0) lower = std::max(lower, now(n, 1) - 0.03);
        if (rest(n, 1) > 0) upper = std::min(upper, now(n, 1) + 0.03);
      }
      least = std::min(least, upper - lower);
    }
    if (self_contact) {
      EXPECT_LT(least, 0.012);
      EXPECT_GT(least, -5 * 4 * world.contact_dt_s);  // arms that meet at 4 m/s stop in the way of five steps
    } else {
      EXPECT_LT(least, -0.2);
    }
  }
}

TEST(SurfaceContacts, RefusesSurfacesThatOverlapAtTheStart) {
  WorldSpec spec = two_balls();
  spec.bodies[1].cage.positions.col(0).array() -= 0.03;
  auto moved = std::make_shared<ContactShape>(*spec.bodies[1].shape);
  moved->field.lower_m.x() -= 0.03;
  moved->samples.positions_m.col(0).array() -= 0.03;
  spec.bodies[1].shape = moved;
  spec.part_overlaps = false;
  try {
    build_world(spec);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("one and other overlap at the start, 0.0"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace limber::fem
