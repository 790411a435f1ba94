// Pairs of bodies that may meet are found without asking all of them, and nothing shows it but the clock.
#include "fem/detail/near_pairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "fem/detail/contact.h"
#include "fem/detail/surface_contact.h"
#include "tests/fem/lane.h"
#include "tests/fem/shapes.h"
#include "tests/fem/worlds.h"

namespace limber::fem {
namespace {

using testing::cube;
using testing::Lane;

constexpr double pitch = 1.5;

// Cubes of edge 1 on a lattice: every fifth is held, so that nothing can push it, and every seventh touches
// itself. With shapes they touch at rounded surfaces.
WorldSpec many_cubes(int n, bool with_shapes) {
  WorldSpec spec;
  const int side = int(std::ceil(std::cbrt(n)));
  for (int k = 0; k < n; ++k) {
    const Vec3 middle = pitch * Vec3(k % side, k / side % side, k / side / side);
    BodySpec body{"c" + std::to_string(k), cube(middle, 1, 1), {}, {}, BodyKind::deformable};
    if (k % 5 == 3) body.kind = BodyKind::immovable;
    body.self_contact = k % 7 == 2;
    if (with_shapes)
      body.shape = testing::shape_of(
          body.cage, testing::rounded_box_surface(bounding_box(body.cage.positions), 0.1), 0.08, 0.25);
    spec.bodies.push_back(std::move(body));
  }
  spec.bounds_m = {Vec3::Constant(-20), Vec3::Constant(20)};
  spec.walls = false;
  spec.contact_offset_m = 0.02;
  return spec;
}

// Each body that moves goes some way at random, now and then a long one.
void wander(Lane& lane, Rng& rng) {
  for (int b = 0; b < int(lane.world.bodies.size()); ++b) {
    if (!lane.world.bodies[std::size_t(b)].moving) continue;
    const Vec3f way = (rng.uniform(0, 1) < 0.05 ? 1.5f : 0.05f) * rng.direction().cast<float>();
    lane.move(b, [&](const Vec3f& p) { return Vec3f(p + way); });
  }
}

bool boxes_meet(const Lane& lane, std::size_t a, std::size_t b, float apart) {
  for (std::size_t c = 0; c < 3; ++c)
    if (lane.lower[3 * a + c] - apart > lane.upper[3 * b + c] ||
        lane.lower[3 * b + c] - apart > lane.upper[3 * a + c])
      return false;
  return true;
}

TEST(NearPairs, AreThoseOfAllPairs) {
  const World world = build_world(many_cubes(60, false));
  const std::size_t bodies = world.bodies.size();
  for (const float reach : {0.f, 0.1f}) {
    Lane lane(world);
    Rng rng(3, std::uint64_t(100 * reach));
    detail::NearPairs<float> near(world, world.tables.skin, std::vector<float>(bodies, reach), 1);
    int meeting = 0, found_without = 0, kept = 0;
    for (int step = 0; step < 200; ++step) {
      SCOPED_TRACE(step);
      if (step % 50 == 49) near.forget(0);
      std::vector<detail::NearPair>& pairs = near.find(0, lane.view());
      for (std::size_t p = 1; p < pairs.size(); ++p) ASSERT_TRUE(pairs[p - 1] < pairs[p]);
      for (detail::NearPair& pair : pairs) pair.list < 0 ? void(pair.list = near.free_list()) : void(++kept);
      std::vector<int> lists;
      for (const detail::NearPair& pair : pairs) lists.push_back(pair.list);
      std::sort(lists.begin(), lists.end());
      ASSERT_EQ(std::adjacent_find(lists.begin(), lists.end()), lists.end()) << "two pairs have one list";
      auto next = pairs.begin();
      for (std::size_t a = 0; a < bodies; ++a)
        for (std::size_t b = a; b < bodies; ++b) {
          const bool found = next != pairs.end() && std::size_t(next->a) == a && std::size_t(next->b) == b;
          next += found;
          if (a == b) {
            ASSERT_EQ(found, world.bodies[a].moving && world.bodies[a].self_contact) << a;
          } else if (!world.bodies[a].pushed() && !world.bodies[b].pushed()) {
            ASSERT_FALSE(found) << a << " " << b;
          } else {
            const bool meet = boxes_meet(lane, a, b, 2 * reach);
            ASSERT_TRUE(found || !meet) << a << " " << b;
            meeting += meet, found_without += found && !meet;
          }
        }
      ASSERT_EQ(next, pairs.end());
      wander(lane, rng);
      if (step == 150) lane.lower[3] = lane.upper[4] = std::numeric_limits<float>::quiet_NaN();
    }
    EXPECT_GT(meeting, 1000);
    EXPECT_LT(found_without, 5 * meeting) << "not all pairs";
    EXPECT_GT(kept, 100);
  }
}

// The second way: pair after pair, ascending, each in a world of these two alone.
template <class Each>
void for_each_pair(const Lane& lane, const WorldSpec& spec, const Each& each) {
  for (std::size_t a = 0; a < spec.bodies.size(); ++a)
    for (std::size_t b = a + 1; b < spec.bodies.size(); ++b) {
      if (!lane.world.bodies[a].pushed() && !lane.world.bodies[b].pushed()) continue;
      WorldSpec two = spec;
      two.bodies = {spec.bodies[a], spec.bodies[b]};
      for (BodySpec& body : two.bodies) body.self_contact = false;
      two.robot = lane.world.bodies[a].pushed() ? 0 : 1;
      const World world = build_world(two);
      Lane alone(world);
      const std::size_t from[2] = {a, b};
      const auto for_each_number = [&](const auto& visit) {
        for (std::size_t i = 0; i < 2; ++i) {
          const Body &here = world.bodies[i], &there = lane.world.bodies[from[i]];
          for (int k = 0; k < 3 * here.node_count(); ++k)
            visit(std::size_t(3 * here.first_node + k), std::size_t(3 * there.first_node + k));
        }
      };
      for_each_number([&](std::size_t here, std::size_t there) {
        alone.x[here] = lane.x[there], alone.v[here] = lane.v[there];
      });
      alone.update_boxes();
      each(int(a), int(b), alone, for_each_number);
    }
}

WorldSpec without_self_contact(WorldSpec spec) {
  for (BodySpec& body : spec.bodies) body.self_contact = false;
  return spec;
}

TEST(NearPairs, GiveTheForcesOfAllPairsBetweenCages) {
  const WorldSpec spec = without_self_contact(many_cubes(20, false));
  const World world = build_world(spec);
  detail::Contacts<float> contacts(world, detail::kernels<float>(detail::best_isa(), 1), 1);
  Lane lane(world);
  Rng rng(4, 0);
  int pushed = 0;
  for (int step = 0; step < 12; ++step) {
    for (int i = 0; i < 5; ++i) wander(lane, rng), contacts.near_pairs(0, lane.view());
    for (float& v : lane.v) v = float(rng.uniform(-0.3, 0.3));
    std::fill(lane.f.begin(), lane.f.end(), 0.f);
    contacts.add_forces(0, lane.view());
    std::vector<float> all(lane.f.size(), 0.f);
    for_each_pair(lane, spec, [&](int, int, Lane& two, const auto& for_each_number) {
      ASSERT_EQ(two.world.contact_dt_s, world.contact_dt_s);
      for_each_number([&](std::size_t here, std::size_t there) { two.f[here] = all[there]; });
      detail::Contacts<float>(two.world, detail::kernels<float>(detail::best_isa(), 1), 1)
          .add_forces(0, two.view());
      for_each_number([&](std::size_t here, std::size_t there) {
        pushed += two.f[here] != all[there];
        all[there] = two.f[here];
      });
    });
    ASSERT_EQ(lane.f, all) << step;
  }
  EXPECT_GT(pushed, 500);
}

TEST(NearPairs, GiveTheTouchesOfAllPairsOfSurfaces) {
  const WorldSpec spec = without_self_contact(many_cubes(20, true));
  const World world = build_world(spec);
  detail::SurfaceContacts<float> contacts(world, detail::kernels<float>(detail::best_isa(), 1), 1);
  Lane lane(world);
  Rng rng(5, 0);
  std::size_t touches = 0;
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE(step);
    for (int i = 0; i < 5; ++i) wander(lane, rng), contacts.near_pairs(0, lane.view());
    const auto& found = contacts.find(0, lane.view());
    std::size_t next = 0;
    for_each_pair(lane, spec, [&](int a, int b, Lane& two, const auto&) {
      detail::SurfaceContacts<float> alone(two.world, detail::kernels<float>(detail::best_isa(), 1), 1);
      for (const auto& one : alone.find(0, two.view())) {
        ASSERT_LT(next, found.size());
        const auto& other = found[next++];
        ASSERT_EQ(other.body, one.body == 0 ? a : b);
        ASSERT_EQ(other.against, one.against == 0 ? a : b);
        ASSERT_EQ(other.depth, one.depth);
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(other.place[c], one.place[c]);
          ASSERT_EQ(other.normal[c], one.normal[c]);
        }
      }
    });
    ASSERT_EQ(next, found.size());
    touches += next;
  }
  EXPECT_GT(touches, 500u);
}

}  // namespace
}  // namespace limber::fem
