#include "bench/dynamics/bullet.h"

#ifdef LIMBER_HAS_BULLET
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <set>
#include <vector>
#endif

#include "core/error.h"

namespace limber::bench {

#ifdef LIMBER_HAS_BULLET

bool has_bullet() { return true; }

struct BulletBody::Impl {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &constraints, &configuration, &solver};
  std::unique_ptr<btSoftBody> body;
  std::unique_ptr<btDeformableNeoHookeanForce> force;
};

BulletBody::BulletBody(const TetMesh& mesh, const fem::Material& material, double stretch, bool implicit)
    : impl_(std::make_unique<Impl>()) {
  Impl& all = *impl_;
  all.constraints.setDeformableSolver(&all.solver);
  all.world.setGravity(btVector3(0, 0, 0));
  all.world.getWorldInfo().m_gravity.setZero();
  all.world.setImplicit(implicit);
  all.world.setLineSearch(false);

  const int nodes = int(mesh.positions.rows()), tets = int(mesh.tets.rows());
  std::vector<btVector3> places;
  std::vector<btScalar> masses(std::size_t(nodes), 0);
  for (int n = 0; n < nodes; ++n) {
    const Vec3 p = mesh.positions.row(n);
    places.emplace_back(btScalar(p.x()), btScalar(p.y()), btScalar(p.z()));
  }
  for (int t = 0; t < tets; ++t) {
    const auto at = [&](int i) { return Vec3(mesh.positions.row(mesh.tets(t, i))); };
    for (int i = 0; i < 4; ++i)
      masses[std::size_t(mesh.tets(t, i))] +=
          btScalar(material.density_kg_m3 * signed_volume(at(0), at(1), at(2), at(3)) / 4);
  }
  all.body = std::make_unique<btSoftBody>(&all.world.getWorldInfo(), nodes, places.data(), masses.data());
  std::set<std::pair<int, int>> edges;
  for (int t = 0; t < tets; ++t) {
    const auto tet = mesh.tets.row(t);
    all.body->appendTetra(tet[0], tet[1], tet[2], tet[3]);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) edges.emplace(std::min(tet[i], tet[j]), std::max(tet[i], tet[j]));
  }
  for (const auto& [i, j] : edges) all.body->appendLink(i, j);
  btSoftBodyHelpers::generateBoundaryFaces(all.body.get());
  all.body->initializeDmInverse();
  all.body->m_tetraScratches.resize(tets), all.body->m_tetraScratchesTn.resize(tets);
  all.body->m_cfg.kDP = 0;
  all.body->m_sleepingThreshold = 0;
  all.body->setActivationState(DISABLE_DEACTIVATION);
  all.world.addSoftBody(all.body.get());
  const double young = material.youngs_modulus_pa, poisson = material.poisson_ratio;
  all.force = std::make_unique<btDeformableNeoHookeanForce>(
      btScalar(young / (2 * (1 + poisson))), btScalar(young * poisson / ((1 + poisson) * (1 - 2 * poisson))),
      btScalar(0.01));
  all.world.addForce(all.body.get(), all.force.get());
  for (int n = 0; n < nodes; ++n) all.body->m_nodes[n].m_x *= btScalar(stretch);
}

BulletBody::~BulletBody() { impl_->world.removeSoftBody(impl_->body.get()); }

void BulletBody::step(double dt_s, int steps) {
  for (int s = 0; s < steps; ++s) impl_->world.stepSimulation(btScalar(dt_s), 1, btScalar(dt_s));
}

double BulletBody::height_m() const {
  btScalar lower = BT_LARGE_FLOAT, upper = -lower;
  for (int n = 0; n < impl_->body->m_nodes.size(); ++n) {
    lower = std::min(lower, impl_->body->m_nodes[n].m_x.z());
    upper = std::max(upper, impl_->body->m_nodes[n].m_x.z());
  }
  return upper - lower;
}

#else

bool has_bullet() { return false; }
struct BulletBody::Impl {};
BulletBody::BulletBody(const TetMesh&, const fem::Material&, double, bool) {
  LIMBER_CHECK(false, has_bullet());
}
BulletBody::~BulletBody() = default;
void BulletBody::step(double, int) {}
double BulletBody::height_m() const { return 0; }

#endif

}  // namespace limber::bench
