// What takes longer: the laws over cages of real models, and sag under refinement (docs/dynamics.md).
#include <gtest/gtest.h>

#include <cmath>

#include "meshing/cage.h"
#include "meshing/import.h"
#include "scenes/shapes.h"
#include "tests/fem/laws.h"
#include "tests/places.h"

namespace limber::fem {
namespace {

using testing::alone;
using testing::both_models;
using testing::called;
using testing::grid;
using testing::nodes_where;
using testing::prove_at_most;
using testing::settled;
using testing::soft;

TetMesh cage_of(const SurfaceMesh& surface, int tets) {
  return meshing::build_cage(surface, {}, {.tets = tets}).mesh;
}

TEST(Cages, OfARabbitObeysTheLaws) {
  testing::prove_laws_of_any_mesh("cage of a rabbit", cage_of(scenes::make_bunny(), 600), 0.5);
}

// Organs of a body of 1.7 m, in millimetres.
TEST(Cages, OfOrgansObeyTheLaws) {
  for (const char* name : {"heart", "liver"}) {
    const fs::path file = fs::path(limber_shared_data) / "organs" / (std::string(name) + ".obj");
    if (!fs::exists(file)) GTEST_SKIP() << file << " is not here: nothing proved of organs";
    testing::prove_laws_of_any_mesh(std::string("cage of a ") + name,
                                    cage_of(meshing::import_model(file, {.scale = 0.001}).surface, 600),
                                    0.05);
  }
}

// How far the end of a bar of 4 × 1 × 1 m, held at the other, sags under a weight of ρg = 6 N/m³.
double tip_sag(int cells, MaterialModel model) {
  Material material;
  material.model = model;
  material.poisson_ratio = 0.3;
  material.damping_ratio = 0.5;
  BodySpec body = soft(grid({0, 0, 0}, {4, 1, 1}, 4 * cells, cells, cells), material);
  body.fixed_nodes = nodes_where(body.cage, [](const Vec3& p) { return p.x() < 1e-9; });
  WorldSpec spec = alone(body);
  spec.gravity_m_s2 = {0, 0, -0.06};
  const World world = build_world(spec);
  const auto [end, speed, rounds] = settled(world, rest_state(world), 3000);
  EXPECT_LT(speed, 2 * testing::still_m_s(world)) << rounds;
  double tip = 0;
  const auto last = nodes_where(body.cage, [](const Vec3& p) { return p.x() > 4 - 1e-9; });
  for (int n : last) tip -= (end.positions[3 * n + 2] - body.cage.positions(n, 2)) / double(last.size());
  return tip;
}

// Refined, and with nothing done about the mesh, a bar's sag goes to one value. Of Neo-Hookean tets that is
// the beam's, Euler and Bernoulli's with shear: q L⁴/8EI + q L²/2κGA. Springs on a grid keep moduli of their
// own (Elastic.ModuliOfAGridAreTheMaterials); Locking.ACantileverSagsAsABeam holds them to the beam.
TEST(Refined, ABarsSagGoesToOneValue) {
  const double q = 100 * 0.06, young = 5e3, shear = young / 2.6;
  const double beam = q * 256 / (8 * young / 12) + q * 16 / (2 * 5.0 / 6 * shear);
  for (const MaterialModel model : both_models) {
    const double coarse = tip_sag(2, model), middle = tip_sag(4, model), fine = tip_sag(8, model);
    const double shrinking = (fine - middle) / (middle - coarse);
    const double limit = fine + (fine - middle) * shrinking / (1 - shrinking);  // of a geometric series
    fmt::print("{}: 2, 4, 8 cells across sag {:.3f}, {:.3f}, {:.3f} of the beam's, in the limit {:.3f}\n",
               called(model), coarse / beam, middle / beam, fine / beam, limit / beam);
    prove_at_most(9, "cantilever: what refining from 4 to 8 cells changes, of what 2 to 4 did", called(model),
                  shrinking, 0.5);
    if (model == MaterialModel::neo_hookean)
      prove_at_most(9, "cantilever: limit of refinement over the beam, − 1", called(model),
                    std::abs(limit / beam - 1), 0.03);
  }
}

}  // namespace
}  // namespace limber::fem
