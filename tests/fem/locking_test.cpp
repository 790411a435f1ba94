// The same material in coarse and fine meshes (docs/dynamics.md, "One material, any mesh").
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/random.h"
#include "fem/detail/locking.h"
#include "fem/detail/make_body.h"
#include "fem/detail/make_elements.h"
#include "fem/reference.h"
#include "fem/stiffness_share.h"
#include "tests/fem/laws.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::both_models;
using testing::called;
using testing::cube;
using testing::grid;
using testing::nodes_where;
using testing::prove_at_most;

// How far the middle of mass goes under so small a gravity that forces are linear, or the middle of the mass
// of some nodes: K u = f by conjugate gradients, K as differences of the double reference's forces.
Vec3 sag(
    BodySpec body, const Vec3& gravity_m_s2,
    const std::function<bool(const Vec3&)>& counts = [](const Vec3&) { return true; }) {
  const World world = build_world(alone(std::move(body)));
  const auto& mass = world.tables64.node_mass;
  const auto& inverse_mass = world.tables64.inverse_mass;
  const ReferenceState rest = reference_state(rest_state(world));
  const auto size = Eigen::Index(rest.positions.size());
  const auto stiffness_times = [&](const Eigen::VectorXd& u) {
    const double nudge = 1e-6 / u.cwiseAbs().maxCoeff();
    Eigen::VectorXd force[2];
    for (const int side : {0, 1}) {
      ReferenceState state = rest;
      for (Eigen::Index k = 0; k < size; ++k) state.positions[k] += (side ? nudge : -nudge) * u[k];
      const std::vector<double> f = elastic_forces(world, state);
      force[side] = Eigen::Map<const Eigen::VectorXd>(f.data(), size);
    }
    Eigen::VectorXd product = (force[0] - force[1]) / (2 * nudge);
    for (Eigen::Index k = 0; k < size; ++k) product[k] *= inverse_mass[k / 3] > 0;
    return product;
  };
  Eigen::VectorXd r(size), u = Eigen::VectorXd::Zero(size);
  for (Eigen::Index k = 0; k < size; ++k)
    r[k] = inverse_mass[k / 3] > 0 ? mass[k / 3] * gravity_m_s2[k % 3] : 0;
  Eigen::VectorXd p = r;
  const double enough = 1e-8 * r.squaredNorm();
  int left = 5000;
  for (; left > 0 && r.squaredNorm() > enough; --left) {
    const Eigen::VectorXd q = stiffness_times(p);
    const double before = r.squaredNorm(), step = before / p.dot(q);
    u += step * p, r -= step * q;
    p = r + r.squaredNorm() / before * p;
  }
  EXPECT_GT(left, 0);
  Vec3 moved = Vec3::Zero();
  double counted = 0;
  for (Eigen::Index n = 0; n < size / 3; ++n)
    if (counts(Eigen::Map<const Vec3>(&rest.positions[std::size_t(3 * n)])))
      moved += mass[n] * u.segment<3>(3 * n), counted += mass[n];
  return moved / counted;
}

// The plate of the paper's Barriers: 0.35 × 3 × 2.2 m, held at the floor and at both side walls.
BodySpec plate(int nx, int ny, int nz, const Material& material) {
  BodySpec body{"plate", grid({0, 0, 0}, {0.35, 3, 2.2}, nx, ny, nz), material, {}};
  body.fixed_nodes =
      nodes_where(body.cage, [](const Vec3& p) { return p.y() < 1e-9 || p.y() > 3 - 1e-9 || p.z() < 1e-9; });
  return body;
}

// Barriers1 and Barriers2 are one material: 270 tets and 1,100 sag alike under the same load. Without the law
// they do not, by far.
TEST(Locking_slow, ThePlatesOfBothBarriersSagAlike) {
  for (const MaterialModel model : both_models) {
    SCOPED_TRACE(int(model));
    Material material;
    material.model = model;
    const auto ratio = [&](bool mesh_independent) {
      material.mesh_independent = mesh_independent;
      const Vec3 load(0.05, 0, 0);
      return sag(plate(2, 9, 3, material), load).x() / sag(plate(2, 11, 10, material), load).x();
    };
    prove_at_most(9, "plates of Barriers1 and Barriers2: sag of one over the other, − 1", called(model),
                  std::abs(ratio(true) - 1), 0.03);
    EXPECT_LT(ratio(false), 0.6);
  }
}

// A cantilever of slender shape and of the scenes' stuff, 1 m thick, against Euler and Bernoulli's beam, with
// the little that shear adds (Timoshenko, κ = 5/6): w(x) under its own weight, averaged over the length, and
// at its end. What the beam leaves out: its root cannot bulge, so over about a quarter of the edge bending is
// stiffer by 1/(1 − ν²), and with moments that grow as (L − x)² that is 5 · (¼/4) ν² of the sag, 2 % at ν =
// ¼. One more per cent is for the share.
TEST(Locking_slow, ACantileverSagsAsABeam) {
  constexpr double length = 4, edge = 1, gravity = 0.02;
  for (const MaterialModel model : both_models)
    for (const int cells : {2, 3}) {
      Material material;
      material.model = model;
      material.poisson_ratio = model == MaterialModel::springs ? 0.25 : 0;
      material.mesh_independent = true;
      BodySpec bar{"bar", grid({0, 0, 0}, {length, edge, edge}, 4 * cells, cells, cells), material, {}};
      bar.fixed_nodes = nodes_where(bar.cage, [](const Vec3& p) { return p.x() < 1e-9; });
      const double young = material.youngs_modulus_pa, shear = young / (2 * (1 + material.poisson_ratio));
      const double load = material.density_kg_m3 * edge * edge * gravity, inertia = std::pow(edge, 4) / 12;
      const double bending = load * std::pow(length, 4) / (20 * young * inertia);
      const double shearing = load * length * length / (3 * (5.0 / 6) * shear * edge * edge);
      const std::string where = fmt::format("{}, {} cells across", called(model), cells);
      prove_at_most(9, "cantilever of 4 × 1 × 1 m: mean sag over Timoshenko's beam, − 1", where,
                    std::abs(sag(bar, {0, 0, -gravity}).z() / -(bending + shearing) - 1), 0.03);
      const auto at_end = [](const Vec3& p) { return p.x() > length - 1e-6; };
      const double end = load * std::pow(length, 4) / (8 * young * inertia) +
                         load * length * length / (2 * (5.0 / 6) * shear * edge * edge);
      prove_at_most(9, "cantilever of 4 × 1 × 1 m: sag of its end over Timoshenko's beam, − 1", where,
                    std::abs(sag(bar, {0, 0, -gravity}, at_end).z() / -end - 1), 0.03);
    }
}

// A share that is told is taken, and the world is the same as where it is found.
TEST(Locking, AShareThatIsKnownIsTaken) {
  Material material;
  material.mesh_independent = true;
  BodySpec body{"cube", cube({0, 0, 0}, 1, 3), material, {}};
  const World found = build_world(alone(body));
  ASSERT_LT(found.bodies[0].stiffness_share, 0.95);
  body.stiffness_share = found.bodies[0].stiffness_share;
  const World told = build_world(alone(body));
  EXPECT_EQ(told.bodies[0].stiffness_share, found.bodies[0].stiffness_share);
  EXPECT_EQ(told.dt_s, found.dt_s);
  body.stiffness_share = 4;
  const World stiffer = build_world(alone(body));
  EXPECT_EQ(stiffer.bodies[0].stiffness_share, 4);
  EXPECT_LT(stiffer.dt_s, found.dt_s);
}

// A cube has many modes that are equally soft; which of them an eigensolver gives is up to rounding, and its
// share is not. A third of a turn about a diagonal takes a cube to itself.
TEST(Locking, WhereABodyStandsDoesNotChangeItsShare) {
  for (const MaterialModel model : both_models)
    for (const int cells : {2, 3}) {
      Material material;
      material.model = model;
      material.mesh_independent = true;
      const auto share_of = [&](TetMesh cage) {
        return 512 * stiffness_share_of({"cube", std::move(cage), material, {}});
      };
      const TetMesh here = cube({0, 0, 0}, 0.6, cells);
      const double share = share_of(here);
      for (const Vec3& to : {Vec3(0.1, 0, 0), Vec3(0.6, 1, 1.3), Vec3(-1.0 / 3, 7.7, 0.01)}) {
        TetMesh there = here, turned = here;
        there.positions.rowwise() += to.transpose();
        for (int axis = 0; axis < 3; ++axis)
          turned.positions.col(axis) = here.positions.col((axis + 1) % 3).array() + to[axis];
        EXPECT_NEAR(share_of(there), share, 1) << to.transpose();
        EXPECT_NEAR(share_of(turned), share, 1) << to.transpose();
      }
    }
}

// Pieces that nothing joins move apart without any stiffness, and are none the softer for it.
TEST(Locking, TwoPiecesHaveTheShareOfOne) {
  Material material;
  material.mesh_independent = true;
  const TetMesh one = cube({0, 0, 0}, 0.6, 2);
  const Eigen::Index nodes = one.positions.rows(), tets = one.tets.rows();
  TetMesh two{Points(2 * nodes, 3), Tets(2 * tets, 4)};
  two.positions << one.positions, one.positions.rowwise() + Eigen::RowVector3d(1, 0, 0.3);
  two.tets << one.tets, (one.tets.array() + int(nodes)).matrix();
  EXPECT_NEAR(512 * stiffness_share_of({"two", two, material, {}}),
              512 * stiffness_share_of({"one", one, material, {}}), 1);
}

// The solves say whether they came as near as they should: in a bar of one material they do, and they cannot
// where what shows them the way is of another material than what they are to solve.
TEST(Locking_slow, AGuessIsSaidToBeOne) {
  Material material;
  material.mesh_independent = true;
  const BodySpec bar{"bar", grid({0, 0, 0}, {4, 1, 1}, 12, 6, 5), material, {}};
  Body body = detail::make_body(bar);
  body.stiffness_share = 1;
  const auto is_found = [&](const std::vector<detail::Lame>& of_tet) {
    return detail::locking_share(body.cage, body.fixed, of_tet, body.node_mass_kg,
                                 detail::make_elements(body))
        .is_found;
  };
  std::vector<detail::Lame> of_tet(std::size_t(body.cage.tets.rows()), {2e3, 2e3});
  EXPECT_TRUE(is_found(of_tet));
  Rng rng(5, 0);
  for (detail::Lame& lame : of_tet) lame.mu = lame.lambda = std::pow(10, rng.uniform(-3, 12));
  EXPECT_FALSE(is_found(of_tet));
}

// The finer the mesh, the less there is to mend.
TEST(Locking_slow, FineMeshesNeedLess) {
  for (const MaterialModel model : both_models) {
    double before = 0.6;
    for (const int cells : {3, 5, 8}) {
      Material material;
      material.model = model;
      material.mesh_independent = true;
      const World world = build_world(alone({"cube", cube({0, 0, 0}, 1, cells), material, {}}));
      const double missing = std::abs(world.bodies[0].stiffness_share - 1);
      EXPECT_LT(missing, 0.75 * before);
      before = missing;
    }
  }
}

}  // namespace
}  // namespace limber::fem
