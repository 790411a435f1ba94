// Masses that are moved to light nodes (docs/dynamics.md, "Masses of nodes"): no motion that anybody sees
// knows of it, and the step is longer.
#include "fem/detail/even_masses.h"

#include <gtest/gtest.h>

#include "fem/detail/make_body.h"
#include "tests/fem/modes.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::ball;
using testing::frequencies2;

// A ball on whose poles stand small tets: six nodes with a hundredth of the mean mass.
BodySpec spiked_ball() {
  BodySpec spec{"ball", ball({0.3, 0, 1}, 0.5, 4), {}, {}};
  TetMesh& cage = spec.cage;
  const Triangles faces = boundary_triangles(cage.tets);
  const Eigen::Index nodes = cage.positions.rows(), tets = cage.tets.rows();
  constexpr int spikes = 6;
  cage.positions.conservativeResize(nodes + spikes, 3), cage.tets.conservativeResize(tets + spikes, 4);
  for (int k = 0; k < spikes; ++k) {
    const Eigen::RowVector3i face = faces.row(k * (faces.rows() / spikes));
    const Vec3 a = cage.positions.row(face[0]), b = cage.positions.row(face[1]),
               c = cage.positions.row(face[2]);
    cage.positions.row(nodes + k) =
        ((a + b + c) / 3 + 0.2 * (b - a).norm() * (b - a).cross(c - a).normalized()).transpose();
    cage.tets.row(tets + k) << face[0], face[1], face[2], int(nodes) + k;
  }
  spec.material.poisson_ratio = 0.45;
  return spec;
}

// Σ m, Σ m x, Σ m x xᵀ about the middle of the ball.
Eigen::Matrix4d moments(const Body& body) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (int n = 0; n < body.node_count(); ++n) {
    Eigen::Vector4d x;
    x << 1, body.cage.positions.row(n).transpose() - Vec3(0.3, 0, 1);
    sum += body.node_mass_kg[std::size_t(n)] * x * x.transpose();
  }
  return sum;
}

TEST(EvenMasses, NoRigidMotionSeesThem) {
  Body body = detail::make_body(spiked_ball());
  body.stiffness_share = 1;
  const Eigen::Matrix4d before = moments(body);
  const std::vector<double> masses = body.node_mass_kg;
  detail::even_masses(body);
  EXPECT_NE(body.node_mass_kg, masses);
  EXPECT_LT((moments(body) - before).cwiseAbs().maxCoeff(), 1e-9 * before(0, 0));
  for (std::size_t n = 0; n < masses.size(); ++n) EXPECT_GE(body.node_mass_kg[n], 0.5 * masses[n]);
}

TEST(EvenMasses, SlowModesStayAndTheFastestSlowsDown) {
  Body body = detail::make_body(spiked_ball());
  body.stiffness_share = 1;
  const Eigen::VectorXd before = frequencies2(body);
  detail::even_masses(body);
  const Eigen::VectorXd after = frequencies2(body);
  for (int mode = 6; mode < 18; ++mode)  // the first six move the body as a whole
    EXPECT_NEAR(std::sqrt(after[mode] / before[mode]), 1, 0.02) << mode;
  EXPECT_LT(after[after.size() - 1], before[before.size() - 1] / 1.44);
}

// Masses of two pieces do not mix.
TEST(EvenMasses, EachPieceKeepsItsOwn) {
  BodySpec spec = spiked_ball();
  const Eigen::Index nodes = spec.cage.positions.rows(), tets = spec.cage.tets.rows();
  spec.cage.positions.conservativeResize(2 * nodes, 3), spec.cage.tets.conservativeResize(2 * tets, 4);
  spec.cage.positions.bottomRows(nodes) = 0.1 * spec.cage.positions.topRows(nodes);
  spec.cage.positions.bottomRows(nodes).col(0).array() += 2;
  spec.cage.tets.bottomRows(tets) = spec.cage.tets.topRows(tets).array() + int(nodes);
  Body body = detail::make_body(spec);
  body.stiffness_share = 1;
  const auto mass = [&](Eigen::Index from) {
    double sum = 0;
    for (Eigen::Index n = from; n < from + nodes; ++n) sum += body.node_mass_kg[std::size_t(n)];
    return sum;
  };
  const double first = mass(0), second = mass(nodes);
  const std::vector<double> masses = body.node_mass_kg;
  detail::even_masses(body);
  EXPECT_NE(body.node_mass_kg, masses);
  EXPECT_NEAR(mass(0), first, 1e-9 * first);
  EXPECT_NEAR(mass(nodes), second, 1e-9 * second);
}

// A lone tet's masses follow from its moments, and bodies without elastic forces have no use for others.
TEST(EvenMasses, OthersStay) {
  BodySpec tet = spiked_ball(), rigid = spiked_ball(), still = spiked_ball();
  tet.cage.positions = tet.cage.positions.topRows(4).eval();
  tet.cage.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.1;
  tet.cage.tets = Tets(1, 4);
  tet.cage.tets << 0, 1, 2, 3;
  rigid.kind = BodyKind::rigid, still.kind = BodyKind::immovable;
  for (const BodySpec& spec : {tet, rigid, still}) {
    Body body = detail::make_body(spec);
    body.stiffness_share = 1;
    const std::vector<double> masses = body.node_mass_kg;
    detail::even_masses(body);
    EXPECT_EQ(body.node_mass_kg, masses) << spec.name;
  }
}

}  // namespace
}  // namespace limber::fem
