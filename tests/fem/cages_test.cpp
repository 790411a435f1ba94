// What takes longer: the laws over cages of real models, and sag under refinement (docs/dynamics.md).
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fem/detail/even_masses.h"
#include "fem/detail/make_body.h"
#include "meshing/cage.h"
#include "meshing/import.h"
#include "scenes/shapes.h"
#include "tests/fem/laws.h"
#include "tests/fem/modes.h"
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

// What is moved to light nodes of organs' cages makes the fastest mode slower and leaves the slow ones.
TEST(EvenMasses_slow, OfOrgansSlowModesStay) {
  const fs::path folder = fs::path(limber_shared_data) / "organs";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not here: nothing proved of organs";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".obj") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const TetMesh cage = cage_of(meshing::import_model(file, {.scale = 0.001}).surface, 160);
    for (const auto& [model, name, allowed] :
         {std::tuple(MaterialModel::springs, "springs", 0.035),
          std::tuple(MaterialModel::neo_hookean, "Neo-Hookean", 0.015)}) {
      BodySpec spec{"organ", cage, {}, {}};
      spec.material.poisson_ratio = 0.45, spec.material.model = model;
      Body body = detail::make_body(spec);
      body.stiffness_share = 1;
      const Eigen::VectorXd before = testing::frequencies2(body);
      detail::even_masses(body);
      const Eigen::VectorXd after = testing::frequencies2(body);
      const Eigen::Index fastest = before.size() - 1;
      Eigen::Index first = 0;  // a cage of p pieces has 6 p modes that move them as wholes
      while (before[first] < 1e-7 * before[fastest]) ++first;
      double largest = 0;
      for (Eigen::Index mode = first; mode < first + 10; ++mode)
        largest = std::max(largest, std::abs(std::sqrt(after[mode] / before[mode]) - 1));
      const double longer = std::sqrt(before[fastest] / after[fastest]);
      fmt::print(
          "{} of {} tets, {}: undamped step x {:.2f}, ten slowest frequencies off by at most {:.2f} %\n",
          file.stem().string(), cage.tets.rows(), name, longer, 100 * largest);
      EXPECT_LT(largest, allowed) << file << ' ' << name;
      EXPECT_GE(longer, 1 - 1e-9) << file << ' ' << name;
    }
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
