#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "core/error.h"
#include "scenes/library.h"
#include "scenes/models.h"
#include "scenes/scene.h"
#include "tests/core/temporary_folder.h"
#include "tests/places.h"

namespace limber::scenes {
namespace {

using testing::HasSubstr;

// An environment variable that has a value as long as the test lives.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) { ::setenv(name, value.c_str(), 1); }
  ~Environment() { ::unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
};

void put(const fs::path& file, const std::string& text) {
  make_folder(file.parent_path());
  write_file(file, text);
}

TEST(Library_slow, ScenesThatComeWithLimberAreGood) {
  for (const KnownScene& known : known_scenes()) {
    SCOPED_TRACE(known.name);
    const Scene scene = read_scene_file(known.file);
    EXPECT_EQ(scene.name, known.name);
    EXPECT_FALSE(scene.description.empty());
    EXPECT_EQ(scene.folder, known.file.parent_path());
    for (const BodySpec& body : scene.bodies) {
      SCOPED_TRACE(body.name);
      auto surface = made_surface(body);
      ASSERT_TRUE(surface);
      const auto map = world_from_model(body, surface->positions, true);
      transform(map, surface->positions);
      const Box box = bounding_box(surface->positions);
      if (body.role != Role::obstacle || body.kind != Kind::rigid) {  // bones do not move, and may reach out
        EXPECT_TRUE((box.lower.array() >= scene.bounds_m.lower.array()).all());
        EXPECT_TRUE((box.upper.array() <= scene.bounds_m.upper.array()).all());
      }
      if (auto cage = made_cage(body)) {
        transform(map, cage->positions);
        EXPECT_NO_THROW(fixed_nodes(body, scene.bounds_m, cage->positions));
      }
    }
  }
}

TEST(Library, Barriers1IsTheTableOfThePaper) {
  const Scene scene = read_scene_file(find_scene("barriers1"), {"planner.preset=paper"});
  EXPECT_EQ(scene.bounds_m.size(), Vec3(10, 3, 3));
  EXPECT_EQ(scene.gravity_m_s2, Vec3::Zero());
  EXPECT_EQ(scene.planner.iterations, 1000);
  EXPECT_EQ(scene.planner.min_duration_s, 0.2);
  EXPECT_EQ(scene.planner.max_duration_s, 1);
  int tets = 0;
  for (const BodySpec& body : scene.bodies) {
    tets += int(made_cage(body)->tets.rows());
    EXPECT_EQ(body.material.youngs_modulus_pa, 5e3);
    EXPECT_EQ(body.material.poisson_ratio, 0.48);
    EXPECT_EQ(body.material.density_kg_m3, 100);
  }
  EXPECT_EQ(tets, 675);
  // The gap over the lower plate and under the upper one is 0.8, less than the robot's 1.
  EXPECT_NEAR(scene.bounds_m.upper.z() - start_box(scene.bodies[1])->upper.z(), 0.8, 1e-12);
  EXPECT_NEAR(start_box(scene.bodies[2])->lower.z() - scene.bounds_m.lower.z(), 0.8, 1e-12);
}

// The same bodies and the same search: only the cages of the plates, the name and the limit differ.
TEST(Library, Barriers2IsBarriers1WithFinerPlates) {
  const Scene coarse = read_scene_file(find_scene("barriers1")),
              fine = read_scene_file(find_scene("barriers2"));
  int tets = 0;
  ASSERT_EQ(fine.bodies.size(), coarse.bodies.size());
  for (std::size_t b = 0; b < fine.bodies.size(); ++b) {
    const TetMesh cage = *made_cage(fine.bodies[b]), coarse_cage = *made_cage(coarse.bodies[b]);
    tets += int(cage.tets.rows());
    EXPECT_NEAR(volume(cage), volume(coarse_cage), 1e-12);
    EXPECT_EQ(fine.bodies[b].material.youngs_modulus_pa, coarse.bodies[b].material.youngs_modulus_pa);
    EXPECT_EQ(fine.bodies[b].pose.position_m, coarse.bodies[b].pose.position_m);
  }
  EXPECT_EQ(tets, 2335);
  EXPECT_EQ(fine.planner.max_force_n, coarse.planner.max_force_n);
  EXPECT_EQ(fine.goal.radius_m, coarse.goal.radius_m);
}

// Every window is narrower than the ball, the one straight to the goal most of all; the ball is a quarter as
// stiff.
TEST(Library, WindowsAreNarrowerThanTheBall) {
  const Scene scene = read_scene_file(find_scene("windows"));
  const BodySpec &ball = scene.bodies[0], &walls = scene.bodies[1];
  std::vector<double> widths;
  for (const Box& hole : std::get<BlocksModel>(walls.model).holes) {
    Vec3 size = hole.size();
    std::sort(size.begin(), size.end());
    EXPECT_NEAR(size[0], 0.4, 1e-12);
    EXPECT_NEAR(size[1], size[2], 1e-12) << "square";
    widths.push_back(size[2]);
  }
  ASSERT_EQ(widths.size(), 4U);
  const double expected[] = {0.9, 1.5, 1.4, 1.3};
  for (std::size_t w = 0; w < 4; ++w) EXPECT_NEAR(widths[w], expected[w], 1e-12);
  EXPECT_NEAR(start_box(ball)->size().x(), 1.6, 1e-12);
  EXPECT_NEAR(walls.material.youngs_modulus_pa, 4 * ball.material.youngs_modulus_pa, 1e-9);
  EXPECT_NEAR(scene.goal.center_of_mass_m.y(), ball.pose.position_m.y(), 1e-12)
      << "straight through the first window";
}

// The walls are those of windows. Every 4 s the leaves meet before the first window of the way round, and
// part until it is free.
TEST(Library, TheMovingDoorClosesTheFirstWindowEveryFourSeconds) {
  const Scene scene = read_scene_file(find_scene("moving_door")),
              windows = read_scene_file(find_scene("windows"));
  const auto& holes = std::get<BlocksModel>(scene.bodies[1].model).holes;
  const auto& same = std::get<BlocksModel>(windows.bodies[1].model).holes;
  ASSERT_EQ(holes.size(), same.size());
  for (std::size_t h = 0; h < holes.size(); ++h)
    EXPECT_TRUE(holes[h].lower == same[h].lower && holes[h].upper == same[h].upper) << h;
  const Box window = holes[1];
  ASSERT_EQ(scene.motions.size(), 2U);
  const auto leaf_at = [&](int side, std::size_t keyframe) {
    const MotionSpec& motion = scene.motions[std::size_t(side)];
    const BodySpec& body = scene.bodies[std::size_t(motion.body)];
    Box leaf = *start_box(body);
    const Vec3 way = motion.keyframes[keyframe].position_m - body.pose.position_m;
    leaf.lower += way, leaf.upper += way;
    return leaf;
  };
  const auto& frames = scene.motions[0].keyframes;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    SCOPED_TRACE(k);
    EXPECT_EQ(frames[k].at_s, scene.motions[1].keyframes[k].at_s);
    if (k >= 4) {
      EXPECT_NEAR(frames[k].at_s, frames[k - 4].at_s + 4, 1e-12);
    }
    const Box left = leaf_at(0, k), right = leaf_at(1, k);
    EXPECT_LT(left.upper.y(), window.lower.y()) << "before the wall";
    EXPECT_LT(left.lower.z(), window.lower.z());
    EXPECT_GT(left.upper.z(), window.upper.z());
    if (k % 4 == 1 || k % 4 == 2) {
      EXPECT_LT(right.lower.x() - left.upper.x(), 0.02) << "closed";
      EXPECT_LT(left.lower.x(), window.lower.x());
      EXPECT_GT(right.upper.x(), window.upper.x());
    } else {
      EXPECT_LT(left.upper.x(), window.lower.x()) << "open";
      EXPECT_GT(right.lower.x(), window.upper.x());
    }
  }
}

// Between the robot's corner and the goal's, 16 balls of 0.8 to 1.2 m cover six tenths of the floor with the
// robot, and none touches another or a wall.
TEST(Library, TheCrowdFillsItsFloorAndTouchesNothing) {
  const Scene scene = read_scene_file(find_scene("crowd"));
  ASSERT_EQ(scene.bodies.size(), 17U);
  const auto diameter = [](const BodySpec& body) { return std::get<SphereModel>(body.model).diameter_m; };
  double covered = 0;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    SCOPED_TRACE(scene.bodies[b].name);
    EXPECT_EQ(scene.bodies[b].role, b == 0 ? Role::robot : Role::free);
    const double d = diameter(scene.bodies[b]);
    EXPECT_TRUE(d >= 0.8 && d <= 1.2) << d;
    covered += std::numbers::pi / 4 * d * d;
    const Vec3 place = scene.bodies[b].pose.position_m;
    EXPECT_GT((place - scene.bounds_m.lower).minCoeff(), d / 2);
    EXPECT_GT((scene.bounds_m.upper - place).minCoeff(), d / 2);
    for (std::size_t other = 0; other < b; ++other)
      EXPECT_GT((place - scene.bodies[other].pose.position_m).norm(),
                (d + diameter(scene.bodies[other])) / 2 + 0.02);
  }
  const Vec3 size = scene.bounds_m.size();
  EXPECT_NEAR(covered / (size.x() * size.y()), 0.6, 0.005);
  const Vec3 way = scene.goal.center_of_mass_m - scene.bodies[0].pose.position_m;
  for (int axis = 0; axis < 2; ++axis) EXPECT_GT(way[axis], size[axis] - 1.5);
}

TEST(Library, SqueezeLeavesSixTenthsOfTheBall) {
  const Scene scene = read_scene_file(find_scene("squeeze"));
  const Vec3 slit = std::get<BlocksModel>(scene.bodies[1].model).holes[0].size();
  EXPECT_NEAR(slit.y(), 0.6 * start_box(scene.bodies[0])->size().y(), 1e-12);
}

TEST(Library, BunnyGateIsNarrowerThanEitherBunny) {
  const Scene scene = read_scene_file(find_scene("bunny_gate"));
  const double gap_m = start_box(scene.bodies[2])->lower.y() - start_box(scene.bodies[1])->upper.y();
  EXPECT_NEAR(gap_m, 0.5, 1e-12);
  const auto& bunny = scene.bodies[std::size_t(scene.robot)];
  SurfaceMesh made = *made_surface(bunny);
  transform(world_from_model(bunny, made.positions, true), made.positions);
  const Box box = bounding_box(made.positions);
  EXPECT_GT(box.size().y(), 1.2 * gap_m);
  EXPECT_NEAR(box.size().z(), 1, 1e-12);
  EXPECT_NEAR(box.lower.z(), bunny.pose.position_m.z(), 1e-12);
}

TEST(Library, FindsByFileFolderAndName) {
  TemporaryFolder folder;
  put(folder / "mine/scene.toml", "x");
  put(folder / "barriers1/scene.toml", "x");
  EXPECT_EQ(find_scene((folder / "mine/scene.toml").string()), folder / "mine/scene.toml");
  EXPECT_EQ(find_scene((folder / "mine").string()), folder / "mine/scene.toml");
  const Environment environment("LIMBER_SCENES", "/no/such/folder:" + folder.path().string());
  EXPECT_EQ(find_scene("mine"), folder / "mine/scene.toml");
  EXPECT_EQ(find_scene("barriers1"), folder / "barriers1/scene.toml") << "LIMBER_SCENES comes first";
}

TEST(Library, UnknownSceneNamesTheNearest) {
  try {
    find_scene("bariers1");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean \"barriers1\"? known scenes: barriers1, barriers2, "
                                        "body_parts, bunny_gate, colon, crowd, dilation, falling_objects, "
                                        "heart_and_lung, knot, mattress, moving_door, "
                                        "squeeze, there_and_back, torso, windows"));
  }
}

TEST(Library, ModelsAreLookedForBesideTheSceneThenInTheCache) {
  TemporaryFolder folder;
  const Environment environment("LIMBER_MODELS", (folder / "cache").string());
  const std::vector<fs::path> folders{folder / "scene", folder / "data"};
  EXPECT_FALSE(find_model("a.off", folders));
  put(folder / "cache/a.off", "cache");
  EXPECT_EQ(find_model("a.off", folders), folder / "cache/a.off");
  put(folder / "data/a.off", "data");
  EXPECT_EQ(find_model("a.off", folders), folder / "data/a.off");
  put(folder / "scene/a.off", "scene");
  EXPECT_EQ(find_model("a.off", folders), folder / "scene/a.off");
  EXPECT_EQ(find_model((folder / "data/a.off").string(), {}), folder / "data/a.off");
  EXPECT_FALSE(find_model((folder / "none.off").string(), folders));
  EXPECT_FALSE(find_model("cache", folders)) << "a folder is not a model";
  EXPECT_THAT(how_to_get_model("b.off", folders), HasSubstr("put it into one of these folders"));
  put(folder / "scene/setup", "");
  EXPECT_THAT(how_to_get_model("b.off", folders), HasSubstr("scene/setup to fetch it"));
}

// The set-up step with a made-up apt-get before the real one.
int run_setup(const TemporaryFolder& folder, const std::string& apt_get) {
  put(folder / "bin/apt-get", "#!/bin/sh\n" + apt_get + "\n");
  fs::permissions(folder / "bin/apt-get", fs::perms::owner_all);
  return std::system(fmt::format("PATH={}:$PATH LIMBER_MODELS={} {}/scenes/bunny_gate/setup > {} 2>&1",
                                 (folder / "bin").string(), (folder / "models").string(), limber_source_dir,
                                 (folder / "said").string())
                         .c_str());
}

TEST(BunnyGateSetup, EndsWellAndSaysSoWithoutThePackage) {
  TemporaryFolder folder;
  for (const char* apt_get : {"exit 100", "exit 0", "echo junk > libcgal-demo_1_all.deb"}) {
    EXPECT_EQ(run_setup(folder, apt_get), 0);
    EXPECT_THAT(read_file(folder / "said"), HasSubstr("the scene will use made models instead"));
    EXPECT_TRUE(fs::is_empty(folder / "models")) << "left something behind";
  }
}

TEST(BunnyGateSetup, IsDoneWhenTheModelIsThere) {
  TemporaryFolder folder;
  put(folder / "models/bunny00.off", "OFF\n37706 75408 0\n");
  EXPECT_EQ(run_setup(folder, "exit 100"), 0);
  EXPECT_THAT(read_file(folder / "said"), HasSubstr("bunny00.off is there"));
}

TEST(Library, CacheFollowsTheEnvironment) {
  const Environment cache("XDG_CACHE_HOME", "/x");
  EXPECT_EQ(model_cache(), "/x/limber/models");
  const Environment models("LIMBER_MODELS", "/m");
  EXPECT_EQ(model_cache(), "/m");
}

}  // namespace
}  // namespace limber::scenes
