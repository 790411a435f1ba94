// Elements as the kernels walk them (docs/dynamics.md, "Lanes"): each edge with a tet or alone, and the
// multiplication and sum that are rounded once.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "core/random.h"
#include "fem/detail/kernels.h"
#include "fem/reference.h"
#include "tests/core/node_order.h"
#include "tests/fem/laws.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

World body_of(const TetMesh& mesh, MaterialModel model) {
  BodySpec body{"body", mesh, {}, {}};
  body.material.model = model;
  return build_world(testing::alone(body));
}

std::vector<TetMesh> meshes() {
  return {testing::ball({0, 0, 0}, 0.5, 6), testing::leaning_grid({0, 0, 0}, {1, 1, 1}, 3, 4, 5),
          testing::grid({0, 0, 0}, {1, 1, 1}, 1, 1, 1)};
}

template <class Visit>
void for_each_run(const detail::ElementTables<double>& tables, const Visit& visit) {
  const auto all = elements_of(tables);
  for (const detail::Run& run : tables.runs) [&]<int... Kind>(std::integer_sequence<int, Kind...>) {
      ((run.kind == Kind ? visit(all.template list_of<Kind>(run)) : void()), ...);
    }
  (std::make_integer_sequence<int, detail::kinds>());
}

// Edge → stiffness and damping of whatever acts along it.
using OfEdges = std::multimap<std::pair<int, int>, std::pair<double, double>>;
std::pair<double, double> numbers_of(const detail::SpringLaw<double>& law) {
  return {law.stiffness, law.damping};
}
std::pair<double, double> numbers_of(const detail::DashpotLaw<double>& law) { return {0, law.damping}; }

TEST(Stars, EveryEdgeAndEveryTetIsThereOnce) {
  for (const TetMesh& mesh : meshes())
    for (const MaterialModel model : testing::both_models) {
      SCOPED_TRACE(fmt::format("{} tets, {}", mesh.tets.rows(), testing::called(model)));
      const World world = body_of(mesh, model);
      OfEdges expected, found;
      const auto expect = [&](const auto& edges) {
        for (const auto& e : edges) expected.emplace(std::minmax(e.node[0], e.node[1]), numbers_of(e.law));
      };
      expect(world.elements.springs), expect(world.elements.dashpots);
      std::multiset<std::set<int>> tets;
      int alone = 0;
      for_each_run(world.tables64.elements, [&](const auto& list) {
        for (int k = 0; k < list.count; ++k) {
          const auto& element = list.elements[k];
          const auto add = [&](int far, const auto& law) {
            found.emplace(std::minmax(element.node[0], element.node[far]), numbers_of(law));
          };
          if constexpr (requires { element.law.solid; }) {
            tets.insert({std::begin(element.node), std::end(element.node)});
            const auto at = [&](int i) -> Vec3 { return mesh.positions.row(element.node[i]); };
            EXPECT_GT(signed_volume(at(0), at(1), at(2), at(3)), 0);
            if constexpr (requires { element.law.edge; })
              for (std::size_t i = 0; i < std::size(element.law.edge); ++i)
                add(int(i) + 1, element.law.edge[i]);
          } else {
            add(1, element.law), ++alone;
          }
        }
      });
      std::multiset<std::set<int>> all_tets;
      for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
        const auto q = mesh.tets.row(t);
        all_tets.insert({q.begin(), q.end()});
      }
      EXPECT_EQ(found, expected);
      EXPECT_EQ(tets, all_tets);
      // Five tets take three edges each and there are eighteen.
      EXPECT_EQ(alone > 0, mesh.tets.rows() == 5);
    }
}

// Forces of each law by itself, straight from its formula, against those of the stars; with velocities.
TEST(Stars, ForcesAreTheSumOfTheLaws) {
  for (const TetMesh& mesh : meshes())
    for (const MaterialModel model : testing::both_models) {
      SCOPED_TRACE(fmt::format("{} tets, {}", mesh.tets.rows(), testing::called(model)));
      const World world = body_of(mesh, model);
      ReferenceState state = testing::at_rest(world);
      Rng rng(61, 0);
      for (double& x : state.positions) x += rng.uniform(-0.04, 0.04);
      for (double& v : state.velocities) v = rng.uniform(-1, 1);
      const auto at = [&](const std::vector<double>& all, int n) {
        return Eigen::Map<const Vec3>(&all[3 * n]);
      };
      std::vector<Vec3> expected(std::size_t(world.nodes), Vec3::Zero());
      const auto pull = [&](const int* node, double along, double drag) {  // along d, and drag × d·w
        const Vec3 d = at(state.positions, node[1]) - at(state.positions, node[0]),
                   w = at(state.velocities, node[1]) - at(state.velocities, node[0]);
        const Vec3 force = (along + drag * d.dot(w) / d.squaredNorm()) * d;
        expected[std::size_t(node[0])] += force, expected[std::size_t(node[1])] -= force;
      };
      for (const auto& [node, law] : world.elements.springs) {
        const double length = (at(state.positions, node[1]) - at(state.positions, node[0])).norm();
        pull(node, law.stiffness * (1 - law.rest_length / length), law.damping);
      }
      for (const auto& [node, law] : world.elements.dashpots) pull(node, 0, law.damping);
      const auto edges_of = [&](const std::vector<double>& all, const int* node) {
        Eigen::Matrix3d e;
        for (int i = 0; i < 3; ++i) e.col(i) = at(all, node[i + 1]) - at(all, node[0]);
        return e;
      };
      const auto push = [&](const int* node, const Eigen::Matrix3d& on) {  // columns: on nodes 1 to 3
        for (int i = 0; i < 3; ++i) expected[std::size_t(node[i + 1])] += on.col(i);
        expected[std::size_t(node[0])] -= on.rowwise().sum();
      };
      const auto volume = [&](const int* node, const detail::VolumeLaw<double>& law) -> Eigen::Matrix3d {
        const Eigen::Matrix3d e = edges_of(state.positions, node), w = edges_of(state.velocities, node);
        const double v6 = e.determinant();
        const Eigen::Matrix3d gradient = v6 * e.inverse().transpose();
        return -(law.stiffness * (v6 - law.rest_volume6) + law.inverted_stiffness * std::min(v6, 0.0) +
                 law.damping * gradient.cwiseProduct(w).sum()) *
               gradient;
      };
      for (const auto& [node, law] : world.elements.volumes) push(node, volume(node, law));
      for (const auto& [node, law] : world.elements.neo_hookeans) {
        const Eigen::Matrix3d e = edges_of(state.positions, node);
        const double* six = law.metric;
        Eigen::Matrix3d m;
        m << six[0], six[1], six[2], six[1], six[3], six[4], six[2], six[4], six[5];
        const double trace = (e.transpose() * e * m).trace();
        push(node, volume(node, law.volume) - trace / (trace + law.scale) * e * m);
      }
      const std::vector<double> forces = elastic_forces(world, state);
      double largest = 0, off = 0;
      for (int n = 0; n < world.nodes; ++n) {
        largest = std::max(largest, expected[std::size_t(n)].norm());
        off = std::max(off, (at(forces, n) - expected[std::size_t(n)]).norm());
      }
      EXPECT_GT(largest, 0);
      EXPECT_LT(off, 1e-11 * largest);
    }
}

// A mesh is the same in any order of its nodes and tets: only sums are rounded otherwise. But springs are
// fitted one after the other in a few sweeps, which end a little elsewhere.
TEST(Stars, ForcesFollowTheOrderOfNodesAndTets) {
  for (const TetMesh& mesh : meshes())
    for (const MaterialModel model : testing::both_models)
      for (const MeshOrder& order : {shuffled_order(mesh, 91), banded_order(mesh)}) {
        SCOPED_TRACE(fmt::format("{} tets, {}", mesh.tets.rows(), testing::called(model)));
        const World world = body_of(mesh, model), other = body_of(reordered(mesh, order), model);
        Rng rng(63, 0);
        ReferenceState state = testing::at_rest(world), moved = testing::at_rest(other);
        testing::shake(state, 0.04, rng);
        const auto carry = [&](const std::vector<double>& from, std::vector<double>& to) {
          for (std::size_t p = 0; p < order.node_from_place.size(); ++p)
            for (std::size_t c = 0; c < 3; ++c)
              to[3 * p + c] = from[3 * std::size_t(order.node_from_place[p]) + c];
        };
        carry(state.positions, moved.positions), carry(state.velocities, moved.velocities);
        std::vector<double> expected(state.positions.size());
        carry(elastic_forces(world, state), expected);
        const std::vector<double> forces = elastic_forces(other, moved);
        double off = 0;
        for (std::size_t k = 0; k < forces.size(); ++k)
          off = std::max(off, std::abs(forces[k] - expected[k]));
        EXPECT_GT(testing::largest(expected), 0);
        const double of_largest = model == MaterialModel::springs ? 1e-3 : 1e-11;
        EXPECT_LT(off, of_largest * testing::largest(expected));
      }
}

// Where no instruction multiplies and adds with one rounding it is put together from others: the same bits,
// also where numbers are tiny, huge or none at all.
TEST(Stars, AnyInstructionSetRoundsAlike) {
  using namespace detail;
  if (!machine_has(Isa::avx2)) GTEST_SKIP() << "this machine has SSE2 alone";
  Rng rng(62, 0);
  for (const auto& [cells, model] : {std::pair(2, MaterialModel::springs),
                                     {2, MaterialModel::neo_hookean},
                                     {1, MaterialModel::springs},
                                     {1, MaterialModel::neo_hookean}}) {
    const World world = body_of(testing::grid({0, 0, 0}, {1, 1, 1}, cells, cells, cells), model);
    for (const int lanes : {1, 4, 8, 16})
      for (int round = 0; round < 60; ++round) {
        const Layout layout = state_layout(lanes), force = force_layout(lanes);
        std::vector<float> x(std::size_t(world.nodes * layout.node + 64)), v(x.size());
        // Places near rest; or of any size, whose squares overflow and vanish.
        const double most = round < 30 ? 0.2 : round < 50 ? 18 : 37;
        for (int n = 0; n < world.nodes; ++n)
          for (int c = 0; c < 3; ++c)
            for (int l = 0; l < lanes; ++l) {
              const double rest = world.tables64.rest_positions[std::size_t(3 * n + c)];
              const double size = std::pow(10, rng.uniform(-most, most));
              x[std::size_t(layout.at(n, c) + l)] = float(round < 30 ? rest + rng.uniform(-0.3, 0.3) : size);
              (lanes == 1 ? x[std::size_t(layout.at(n, c) + 4)] : v[std::size_t(layout.at(n, c) + l)]) =
                  float(rng.uniform(-1, 1) * size);
            }
        const auto forces = [&](Isa isa) {
          std::vector<float> f(std::size_t(world.nodes * force.node + 64));
          kernels<float>(isa, lanes)
              .elastic(elements_of(world.tables.elements), x.data(), lanes == 1 ? x.data() + 4 : v.data(),
                       f.data());
          return f;
        };
        const std::vector<float> emulated = forces(Isa::sse2), fused = forces(Isa::avx2);
        for (std::size_t k = 0; k < fused.size(); ++k) {
          if (std::isnan(fused[k]) && std::isnan(emulated[k])) continue;
          ASSERT_EQ(std::bit_cast<unsigned>(emulated[k]), std::bit_cast<unsigned>(fused[k]))
              << lanes << " lanes, round " << round << ": " << emulated[k] << " and " << fused[k];
        }
      }
  }
}

}  // namespace
}  // namespace limber::fem
