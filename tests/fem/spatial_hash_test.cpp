// The paper's own detection, optimised spatial hashing (Teschner, Heidelberger, Müller, Pomeranets, Gross
// 2003), as a reference: what it finds, brute force and the lists of contact.h find too, pair for pair.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "core/random.h"
#include "fem/detail/contact.h"
#include "fem/world.h"
#include "meshing/cage.h"
#include "meshing/import.h"
#include "scenes/shapes.h"
#include "tests/fem/proofs.h"
#include "tests/fem/worlds.h"
#include "tests/places.h"

namespace limber::fem {
namespace {

using Pairs = std::map<int, int>;  // vertex → the first tet that has it

struct Scene {
  const World& world;
  std::vector<float> x;

  Vec3 node(int n) const { return Eigen::Map<const Vec3f>(&x[3 * n]).cast<double>(); }
  // The least barycentric coordinate; negative outside, and of a tet that is flat or inverted.
  double inside(int vertex, int tet) const {
    const int* n = world.topology.tets[tet].node;
    const Vec3 p = node(vertex), a = node(n[0]), b = node(n[1]), c = node(n[2]), d = node(n[3]);
    const double all = signed_volume(a, b, c, d);
    if (!(all > 0)) return -1;
    return std::min({signed_volume(p, b, c, d), signed_volume(a, p, c, d), signed_volume(a, b, p, d),
                     signed_volume(a, b, c, p)}) /
           all;
  }
  void note(int vertex, int tet, Pairs& pairs) const {
    if (!(inside(vertex, tet) >= 0)) return;
    const auto [at, is_new] = pairs.try_emplace(vertex, tet);
    if (!is_new) at->second = std::min(at->second, tet);
  }
};

Pairs by_brute_force(const Scene& scene, int from, int into) {
  Pairs pairs;
  const auto &body = scene.world.topology.bodies[from], &other = scene.world.topology.bodies[into];
  for (const int v : body.surface_nodes)
    for (int t = other.first_tet; t < other.last_tet; ++t) scene.note(v, t, pairs);
  return pairs;
}

// First pass: every vertex into the table, by its cell; second: every tet looks into the cells of its box.
Pairs by_spatial_hash(const Scene& scene, int from, int into, double cell) {
  constexpr unsigned table_size = 1999;
  const auto cell_of = [&](double x) { return int(std::floor(x / cell)); };
  const auto hash = [&](int i, int j, int k) {
    return (unsigned(i) * 73856093u ^ unsigned(j) * 19349663u ^ unsigned(k) * 83492791u) % table_size;
  };
  const auto &body = scene.world.topology.bodies[from], &other = scene.world.topology.bodies[into];
  std::vector<std::vector<int>> table(table_size);
  for (const int v : body.surface_nodes) {
    const Vec3 p = scene.node(v);
    table[hash(cell_of(p.x()), cell_of(p.y()), cell_of(p.z()))].push_back(v);
  }
  Pairs pairs;
  for (int t = other.first_tet; t < other.last_tet; ++t) {
    Box box;
    for (const int n : scene.world.topology.tets[t].node) box.include(scene.node(n));
    for (int i = cell_of(box.lower.x()); i <= cell_of(box.upper.x()); ++i)
      for (int j = cell_of(box.lower.y()); j <= cell_of(box.upper.y()); ++j)
        for (int k = cell_of(box.lower.z()); k <= cell_of(box.upper.z()); ++k)
          for (const int v : table[hash(i, j, k)]) scene.note(v, t, pairs);
  }
  return pairs;
}

// Those of the steppers; from scratch, as of two bodies that have just met.
Pairs by_lists(detail::Contacts<float>& contacts, const Scene& scene, int from) {
  const World& world = scene.world;
  std::vector<float> still(scene.x.size(), 0.f), lower, upper, travel(world.bodies.size(), 0.f);
  for (const auto& body : world.topology.bodies) {
    Box box;
    for (int n = body.first_node; n < body.last_node; ++n) box.include(scene.node(n));
    for (int c = 0; c < 3; ++c) lower.push_back(float(box.lower[c])), upper.push_back(float(box.upper[c]));
  }
  contacts.forget(0);
  Pairs pairs;
  const auto& body = world.topology.bodies[from];
  for (const auto& contact : contacts.find(0,
                                           {scene.x.data(),
                                            still.data(),
                                            still.data(),
                                            {3, 1},
                                            {3, 1},
                                            1,
                                            lower.data(),
                                            upper.data(),
                                            travel.data(),
                                            travel.data()},
                                           0, 1)) {
    const auto& point = world.topology.points[contact.point];
    const bool vertex = point.node[0] == point.node[1];
    if (vertex && point.node[0] >= body.first_node && point.node[0] < body.last_node)
      pairs.emplace(point.node[0], contact.tet);
  }
  return pairs;
}

// Within rounding of a face a pair may be missing, or be that of the tet behind the face.
int differing(const Scene& scene, const Pairs& expected, const Pairs& found) {
  int differing = 0;
  for (const auto& [vertex, tet] : expected) {
    if (scene.inside(vertex, tet) < 1e-4) continue;
    const auto at = found.find(vertex);
    differing +=
        at == found.end() || (at->second != tet && std::abs(scene.inside(vertex, at->second)) >= 1e-4);
  }
  for (const auto& [vertex, tet] : found)
    differing += scene.inside(vertex, tet) >= 1e-4 && !expected.contains(vertex);
  return differing;
}

TetMesh sized(TetMesh mesh, double size, const Vec3& center) {
  const Box box = bounding_box(mesh.positions);
  for (int n = 0; n < mesh.positions.rows(); ++n) {
    const Vec3 p = mesh.positions.row(n);
    mesh.positions.row(n) = (center + size / box.size().maxCoeff() * (p - box.center())).transpose();
  }
  return mesh;
}

// `count` random places of two bodies, turned, moved and bent.
int compare(const char* name, const TetMesh& a, const TetMesh& b, int count, std::uint64_t seed) {
  WorldSpec spec = testing::alone({"a", sized(a, 1, {0, 0, 0}), {}, {}});
  spec.bodies.push_back({"b", sized(b, 1, {3, 0, 0}), {}, {}});
  const World world = build_world(spec);
  detail::Contacts<float> contacts(world, detail::kernels<float>(detail::best_isa(), 1), 1);
  Rng rng(seed, 0);
  int pairs = 0;
  for (int i = 0; i < count; ++i) {
    Scene scene{world, world.tables.rest_positions};
    for (const int body : {0, 1}) {
      const Vec3 axis = rng.direction(), move = 0.4 * Vec3(rng.direction());
      const Eigen::AngleAxisd turn(rng.uniform(0, 3), axis);
      const double wave = rng.uniform(4, 8), size = 0.04;
      for (int n = world.topology.bodies[body].first_node; n < world.topology.bodies[body].last_node; ++n) {
        const Vec3 p = turn * (scene.node(n) - Vec3(3 * body, 0, 0));
        const Vec3 q = p + move + size * Vec3(std::sin(wave * p.y()), std::sin(wave * p.z()), 0);
        Eigen::Map<Vec3f>(&scene.x[3 * n]) = q.cast<float>();
      }
    }
    for (const int from : {0, 1}) {
      const Pairs expected = by_brute_force(scene, from, 1 - from);
      const Pairs hashed = by_spatial_hash(scene, from, 1 - from, rng.uniform(0.1, 0.4));
      const std::string where = fmt::format("{}, scene {}", name, i);
      testing::prove_at_most(12, "pairs of the lists that are not those of brute force", where,
                             differing(scene, expected, by_lists(contacts, scene, from)), 0);
      testing::prove_at_most(12, "scenes whose pairs by the spatial hash are not those of brute force", where,
                             hashed != expected, 0);
      pairs += int(expected.size());
    }
  }
  return pairs;
}

TEST(SpatialHash_slow, ListsAndBruteForceAgreeInAThousandScenes) {
  const int pairs =
      compare("ball and cube", testing::ball({0, 0, 0}, 0.5, 3), testing::cube({0, 0, 0}, 1, 3), 1000, 3);
  EXPECT_GT(pairs, 10000);
}

TEST(SpatialHash_slow, AgreesOnCagesOfRealModels) {
  meshing::CageOptions options;
  options.tets = 300;
  const TetMesh rabbit = meshing::build_cage(scenes::make_bunny(), {}, options).mesh;
  EXPECT_GT(compare("rabbit and cube", rabbit, testing::cube({0, 0, 0}, 1, 3), 50, 4), 300);
  const auto heart = std::filesystem::path(limber_shared_data) / "organs/heart.obj";
  if (!std::filesystem::exists(heart))
    GTEST_SKIP() << "SKIPPED: no " << heart << "; configure with -DLIMBER_SHARED_DATA=";
  const TetMesh cage = meshing::build_cage(meshing::import_model(heart).surface, {}, options).mesh;
  EXPECT_GT(compare("heart and rabbit", cage, rabbit, 50, 5), 300);
}

}  // namespace
}  // namespace limber::fem
