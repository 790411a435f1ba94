// Names beside a shot: at each frame apart, with lines that do not cross and end where their bodies are seen;
// steady, and the same whoever makes the shot.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "fem/observe.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/film/start.h"
#include "render/label_places.h"

namespace limber::detail {
namespace {

// A ball that flies behind a wall and past three others, before a transparent surface.
constexpr const char* text = R"(name = "names"
[world]
bounds_m = [[-3, -3, -2], [3, 3, 2]]
[[bodies]]
name = "flyer"
role = "robot"
model = { sphere = { diameter_m = 0.7, triangle_m = 0.1 } }
cage = { tets = 60 }
material = { youngs_modulus_pa = 5e3, density_kg_m3 = 100 }
pose = { position_m = [-2, 0.6, 0] }
[[bodies]]
name = "wall"
role = "obstacle"
kind = "rigid"
model = { box = { size_m = [1.2, 0.1, 1.4], triangle_m = 0.3 } }
cage = { cells = [1, 1, 1] }
pose = { position_m = [0, 0, 0] }
[[bodies]]
name = "stone_left"
role = "obstacle"
kind = "rigid"
model = { sphere = { diameter_m = 0.5, triangle_m = 0.1 } }
cage = { tets = 60 }
pose = { position_m = [-0.9, 0.2, 1] }
[[bodies]]
name = "stone_right"
role = "obstacle"
kind = "rigid"
model = { sphere = { diameter_m = 0.5, triangle_m = 0.1 } }
cage = { tets = 60 }
pose = { position_m = [0.9, 0.2, -1] }
[[bodies]]
name = "veil"
role = "scenery"
opacity = 0.3
model = { sphere = { diameter_m = 1, triangle_m = 0.1 } }
pose = { position_m = [2, 0.4, 0.8] }
[film]
size_px = [480, 270]
frames_per_second = 15
bounds_lines = false
caption = "Names"
labels = true
[camera]
direction = [0, -1, 0.1]
[[cameras]]
name = "turning"
direction = [0, -1, 0.3]
turn_deg = 200
)";

class Labels_slow : public testing::Test {
 protected:
  static Start start_of(const std::vector<std::string>& sets) {
    const scenes::Scene scene = scenes::read_scene(text, "names", sets);
    std::vector<LoadedModel> models;
    for (const scenes::BodySpec& body : scene.bodies) models.push_back(load_model(scene, body, {}));
    return loaded_start(scene, models, {});
  }
  // The robot goes to the right, 4 m.
  static plan::Plan flight(const fem::World& world, int frames) {
    plan::Plan plan;
    const State begin = fem::start_state(world);
    const fem::Body& robot = world.bodies[std::size_t(world.robot)];
    for (int f = 0; f < frames; ++f) {
      State state = begin;
      state.step = f;
      for (int n = 0; n < robot.node_count(); ++n)
        state.positions[std::size_t(3 * (robot.first_node + n))] += float(4.0 * f / std::max(1, frames - 1));
      plan.trajectory.frames.push_back(state);
    }
    return plan;
  }
};

bool overlap(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

TEST_F(Labels_slow, AreApartAndPointAtWhatIsSeen) {
  for (const auto& [camera, frames] : {std::pair("main", 90), {"turning", 120}, {"main", 1}}) {
    SCOPED_TRACE(camera);
    const Start start = start_of({});
    const plan::Plan plan = flight(start.world, frames);
    Output output;
    output.occlusion = false, output.passes = {"object"};
    const Shot shot(start.scene, camera, plan, start.world, start.bodies, start.scenery, {480, 270}, output),
        again(start.scene, camera, plan, start.world, start.bodies, start.scenery, {480, 270}, output);
    Shot::Painter painter(shot);
    std::map<std::string, int> shown, places;
    std::map<std::string, Shot::Name> last;
    int looked_at = 0, astray = 0;
    for (int f = 0; f < shot.frames(); ++f) {
      const std::vector<Shot::Name> names = shot.names_at(f);
      EXPECT_EQ(shot.hash_of(f), again.hash_of(f));
      std::map<std::string, Shot::Name> here;
      for (std::size_t a = 0; a < names.size(); ++a) {
        ++shown[names[a].words];
        here[names[a].words] = names[a];
        EXPECT_GT(names[a].share, 0);
        EXPECT_LE(names[a].share, 1);
        for (std::size_t b = a + 1; b < names.size(); ++b) {
          EXPECT_FALSE(overlap(names[a].place.box, names[b].place.box));
          EXPECT_FALSE(collide(names[a].place, names[a].end, names[b].place, names[b].end)) << f;
        }
      }
      for (const auto& [words, name] : here) {
        const auto before = last.find(words);
        if (before == last.end()) {
          EXPECT_TRUE(f == 0 || name.share < 0.3) << words << " jumps in at " << f;
          continue;
        }
        EXPECT_LE(std::abs(name.share - before->second.share), 0.3) << words << " at " << f;
        if (name.place == before->second.place) {
          EXPECT_LT((name.end - before->second.end).norm(), 12) << words << " at " << f;
        } else {  // it changes places unseen
          ++places[words];
          EXPECT_LT(std::min(name.share, before->second.share), 0.3) << words << " at " << f;
        }
      }
      for (const auto& [words, name] : last)
        EXPECT_TRUE(here.count(words) == 1 || name.share < 0.3) << words << " jumps out at " << f;
      last = here;
      if (f % 7 != 0) continue;
      const auto& object = std::get<render::Raster8>(painter.paint(f).passes.at("object"));
      for (const Shot::Name& name : names) {
        if (name.words == "Veil") continue;  // the pass has only what is opaque
        ++looked_at;
        bool found = false;
        for (int dy = -2; dy <= 2; ++dy)
          for (int dx = -2; dx <= 2; ++dx) {
            const int x = std::clamp(int(name.end.x()) + dx, 0, 479),
                      y = std::clamp(int(name.end.y()) + dy, 0, 269);
            found = found || object.levels[std::size_t(y * 480 + x)] == name.body + 1;
          }
        astray += int(!found);
      }
    }
    // Between two sights, 0.3 s apart, something may come before an end.
    EXPECT_LE(astray, looked_at / 20) << looked_at;
    EXPECT_GT(looked_at, frames == 1 ? 3 : 40);
    for (const char* words : {"Wall", "Left stone", "Right stone", "Veil"})
      EXPECT_GT(shown[words], shot.frames() / 2) << words;
    EXPECT_GT(shown["Flyer"], shot.frames() / 5);
    for (const auto& [words, changes] : places) EXPECT_LE(changes, 4) << words;
  }
}

// Before and after it passes behind the wall the flyer is named, while it is behind it is not.
TEST_F(Labels_slow, AreGoneWhereTheirBodiesAreHidden) {
  const Start start = start_of({"film.labels=[\"flyer\"]"});
  const plan::Plan plan = flight(start.world, 90);
  Output output;
  output.occlusion = false;
  const Shot shot(start.scene, "main", plan, start.world, start.bodies, start.scenery, {480, 270}, output);
  EXPECT_EQ(shot.names_at(0).size(), 1u);
  EXPECT_EQ(shot.names_at(45).size(), 0u);
  EXPECT_EQ(shot.names_at(89).size(), 1u);
}

// No line ends in the inset, or runs through it.
TEST_F(Labels_slow, KeepClearOfAnInset) {
  const std::string inset = "film.inset={ camera = \"turning\", size = 0.5 }";
  const Start start = start_of({inset}), bare = start_of({"film.labels=false"}),
              unnamed = start_of({inset, "film.labels=false"});
  const plan::Plan plan = flight(start.world, 90);
  const auto shot_of = [&](const Start& of) {
    Output output;
    output.occlusion = false;
    return std::make_unique<Shot>(of.scene, "main", plan, of.world, of.bodies, of.scenery,
                                  std::pair(480, 270), output);
  };
  const auto picture_of = [&](const Start& of) {
    return std::get<render::Image8>(Shot::Painter(*shot_of(of)).paint(0).frame);
  };
  const render::Image8 with = picture_of(unnamed), without = picture_of(bare);
  Eigen::Vector4d box(480, 270, 0, 0);
  for (int y = 0; y < 270; ++y)
    for (int x = 0; x < 480; ++x)
      if (const std::size_t at = 3 * std::size_t(480 * y + x);
          !std::equal(&with.rgb[at], &with.rgb[at] + 3, &without.rgb[at])) {
        box.head<2>() = box.head<2>().cwiseMin(Eigen::Vector2d(x, y));
        box.tail<2>() = box.tail<2>().cwiseMax(Eigen::Vector2d(x + 1, y + 1));
      }
  ASSERT_NEAR(box[2] - box[0], 240, 10);
  const auto shot = shot_of(start);
  int shown = 0;
  for (int f = 0; f < shot->frames(); ++f)
    for (const Shot::Name& name : shot->names_at(f)) {
      ++shown;
      EXPECT_FALSE(overlap(name.place.box, box)) << name.words << ' ' << f;
      EXPECT_FALSE(runs_through(name.place, name.end, box)) << name.words << ' ' << f;
    }
  EXPECT_GT(shown, 2 * shot->frames());
}

TEST_F(Labels_slow, WhatIsCutAwayIsNotPointedAt) {
  const Start start = start_of({"film.labels=[\"wall\"]",
                                "film.cuts=[{ point_m = [0.2, 0, 0], normal = [-1, 0, "
                                "0], bodies = [\"wall\"] }]"});
  const plan::Plan plan = flight(start.world, 1);
  const Shot shot(start.scene, "main", plan, start.world, start.bodies, start.scenery, {480, 270}, {});
  ASSERT_EQ(shot.names_at(0).size(), 1u);
  const Start whole = start_of({"film.labels=[\"wall\"]"});
  const Shot of_whole(whole.scene, "main", plan, whole.world, whole.bodies, whole.scenery, {480, 270}, {});
  // The wall is 1.2 m wide, of which the right 0.4 m are left.
  EXPECT_GT(shot.names_at(0)[0].end.x(), 240);
  EXPECT_NE(shot.hash_of(0), of_whole.hash_of(0));
}

}  // namespace
}  // namespace limber::detail
