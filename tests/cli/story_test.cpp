// What a film tells of a motion, and when: pace, end, panes, outlines, cards, inset.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/hash.h"
#include "fem/observe.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "render/png_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

using testing::HasSubstr;

// A soft cube falls sideways against the wall x = 2, which nobody sees, and comes to rest on it.
constexpr const char* falling = R"(name = "falling"
[world]
bounds_m = [[0, 0, 0], [2, 2, 2]]
gravity_m_s2 = [3, 0, 0]
[[bodies]]
name = "cube"
role = "robot"
model = { box = { size_m = [0.6, 0.6, 0.6], triangle_m = 0.1 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 5e4, density_kg_m3 = 100, damping_ratio = 0.6 }
pose = { position_m = [0.7, 1, 1] }
[goal]
center_of_mass_m = [1, 1, 1]
radius_m = 0.3
[planner]
max_force_n = 100
[film]
size_px = [96, 64]
frames_per_second = 20
bounds_lines = false
[[cameras]]
name = "behind"
direction = [0.2, 1, 0.3]
)";

class Story_slow : public Program {
 protected:
  void SetUp() override {
    const Result simulated = limber_program({"simulate", scene(falling), "-o", out(), "--duration", "3"});
    ASSERT_EQ(simulated.code, exit_done) << simulated.err;
    planned = read_plan_folder(out());
    bodies = read_world_of(planned, out()).bodies;
  }
  struct Film {
    Json json;
    std::vector<render::Image8> frames;
  };
  Film film(const std::vector<std::string>& sets, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"render", out(), "--as", "try", "--json"};
    for (const std::string& set : sets) words.insert(words.end(), {"--set", set});
    words.insert(words.end(), more.begin(), more.end());
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_done) << result.err;
    Film made{result.json(), {}};
    for (int f = 0; f < made.json.at("frames"); ++f)
      made.frames.push_back(render::read_png(frame(fmt::format("{:04}.png", f))));
    return made;
  }
  fs::path frame(const std::string& name) const { return fs::path(out()) / "frames-try" / name; }
  std::string refusal(const std::vector<std::string>& words) const {
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_bad_input);
    return result.err;
  }
  // A stored frame: the wall presses the cube.
  std::vector<bool> touching() const {
    const fem::World world = world_of(planned, bodies);
    std::vector<bool> touching;
    for (const State& state : planned.plan.trajectory.frames)
      touching.push_back(!fem::contact_forces(world, state).empty());
    return touching;
  }
  PlanFolder planned;
  std::vector<PreparedBody> bodies;
};

int changed_pixels(const render::Image8& a, const render::Image8& b) {
  int changed = 0;
  for (std::size_t i = 0; i + 2 < a.rgb.size(); i += 3)
    changed += !std::equal(&a.rgb[i], &a.rgb[i] + 3, &b.rgb[i]);
  return changed;
}

// A hash tells what a frame is painted from, not how. So where the same film gets other pixels, its
// generation is another, too: else frames of before would be kept beside those of now.
TEST_F(Story_slow, OtherPicturesAreAnotherGeneration) {
  std::string pixels;
  for (const char* look : {"studio", "dark", "clinical", "paper"}) {
    const Result painted = limber_program(
        {"render",   out(),
         "--as",     "try",
         "--frames", "0",
         "--size",   "320x180",
         "--set",    std::string("film.look=") + look,
         "--set",    "film.caption=Words",
         "--set",    "film.clock=true",
         "--set",    "film.scale_bar=true",
         "--set",    look == std::string("paper") ? "film.outlines=true" : "bodies.cube.opacity=0.5",
         "--set",    look == std::string("dark") ? "film.color_by=speed" : "bodies.cube.look=tissue",
         "--set",    "film.inset={ camera = \"behind\" }"});
    ASSERT_EQ(painted.code, exit_done) << painted.err;
    pixels += render::pixel_hash(frame("0000.png")) + " ";
  }
  const std::map<int, std::string> known{{12, "e89683820f499354"},
                                         {13, "44c949fdf456bef5"},
                                         {14, "95bbf14ebadabe2a"},
                                         {15, "e83eccb4fe960a74"},
                                         {16, "73b2fd2d95d6d74c"}};
  ASSERT_TRUE(known.contains(picture_generation));
  EXPECT_EQ(known.at(picture_generation), hex(hash_of(std::string_view(pixels))))
      << "pictures are others than they were: raise picture_generation in limber/detail/film/shot.h, and "
         "write it and "
         "this hash into the list";
}

TEST_F(Story_slow, FilmsAreSlowWhereTheRobotIsTouchedAndQuickWhereItIsNot) {
  const Film steady = film({}), paced = film({"film.pace=contact", "film.pace_range=[0.2, 2]"});
  EXPECT_EQ(steady.json.at("time").at("speed"), Json({1, 1}));
  EXPECT_NEAR(paced.json.at("time").at("speed").at(0), 0.2, 0.01);
  EXPECT_GT(paced.json.at("time").at("speed").at(1), 1);
  EXPECT_EQ(paced.json.at("time").at("motion_s"), steady.json.at("time").at("motion_s"));
  // It falls for a quarter of the time, and lies on the wall for the rest.
  EXPECT_GT(paced.frames.size(), 2 * steady.frames.size());
  EXPECT_EQ(paced.frames.front(), steady.frames.front());
  EXPECT_EQ(paced.frames.back(), steady.frames.back());
  EXPECT_EQ(changed_pixels(paced.frames.back(), paced.frames[paced.frames.size() - 2]), 0);

  const Film asked = film({"film.pace=contact", "film.pace_range=[0.2, 2]", "film.length_s=8"});
  EXPECT_EQ(asked.frames.size(), 161u);
  EXPECT_EQ(asked.frames.back(), steady.frames.back());
  EXPECT_THAT(
      refusal({"render", out(), "--set", "film.pace=contact", "--set", "film.length_s=1"}),
      HasSubstr("film.length_s = 1: with film.pace_range = [0.25, 1.5] this motion can take 2 to 12 s"));
  EXPECT_THAT(refusal({"render", out(), "--set", "film.length_s=1"}), HasSubstr("film.pace = \"contact\""));
}

TEST_F(Story_slow, AFilmMayEndHalfASecondAfterTheLastMotion) {
  const Film whole = film({}), ended = film({"film.end=rest"});
  ASSERT_LT(ended.frames.size(), whole.frames.size());
  for (std::size_t f = 0; f < ended.frames.size(); ++f) EXPECT_EQ(ended.frames[f], whole.frames[f]) << f;
  EXPECT_GT(ended.json.at("time").at("left_out_s"), 0.5);
  // A frame before half a second before the end something moves, and afterwards nothing does.
  const std::vector<State>& states = planned.plan.trajectory.frames;
  const auto farthest = [&](std::size_t frame) {
    double most = 0;
    for (std::size_t i = 0; i < states.back().positions.size(); ++i)
      most = std::max(most, std::abs(double(states[frame].positions[i] - states.back().positions[i])));
    return most;
  };
  const std::size_t at_rest = ended.frames.size() - 1 - 10;
  EXPECT_GT(farthest(at_rest - 1), 0.003 * 0.6 / std::sqrt(3));
  for (std::size_t f = at_rest; f < states.size(); ++f) EXPECT_LE(farthest(f), 0.003 * 0.6);
  for (const Film& film : {whole, ended})
    EXPECT_NEAR(film.json.at("time").at("motion_s").get<double>() +
                    film.json.at("time").at("left_out_s").get<double>(),
                3, 1e-9);
}

// Where the cube presses the wall, and five frames before and after, something is drawn beside the cube: at
// the wall, which the camera sees from its edge, to the right.
TEST_F(Story_slow, APaneStandsWhereAWallIsTouchedAndNowhereElse) {
  const Film without = film({}), with = film({"film.panes=true"}, {"--passes", "object"});
  const std::vector<bool> touched = touching();
  ASSERT_EQ(with.frames.size(), touched.size());
  EXPECT_FALSE(touched.front());
  int shown = 0;
  for (int f = 0; f < int(touched.size()); ++f) {
    bool near = false;
    for (int k = std::max(0, f - 5); k <= std::min(int(touched.size()) - 1, f + 5); ++k)
      near = near || touched[std::size_t(k)];
    const int changed = changed_pixels(with.frames[std::size_t(f)], without.frames[std::size_t(f)]);
    EXPECT_EQ(changed > 0, near) << f;
    shown += changed > 0;
  }
  EXPECT_GT(shown, 20);
  // A transparent surface of no pass.
  const render::Raster16 object = render::read_png_16(frame(fmt::format("{:04}.object.png", 40)));
  for (const std::uint16_t level : object.levels) ASSERT_TRUE(level == 0 || level == 257);
  // The floor is drawn already.
  const std::string down =
      std::string(falling).replace(std::string(falling).find("[3, 0, 0]"), 9, "[0, 0, -3]");
  ASSERT_EQ(limber_program({"simulate", scene(down), "-o", out(), "--duration", "1"}).code, exit_done);
  EXPECT_EQ(film({}).frames, film({"film.panes=true"}).frames);
}

// Dark lines, on the cube alone.
TEST_F(Story_slow, OutlinesAreDrawnOnBodies) {
  const Film plain = film({}, {"--passes", "object"}), lined = film({"film.outlines=true"});
  const render::Raster16 object = render::read_png_16(frame("0000.object.png"));
  int darker = 0, brighter = 0;
  for (std::size_t i = 0; i < object.levels.size(); ++i) {
    int change = 0;
    for (std::size_t c = 0; c < 3; ++c)
      change += lined.frames[0].rgb[3 * i + c] - plain.frames[0].rgb[3 * i + c];
    darker += change<0, brighter += change> 0;
  }
  EXPECT_GT(darker, 30);
  EXPECT_EQ(brighter, 0);
  EXPECT_THAT(refusal({"render", out(), "--bits", "16", "--set", "film.outlines=true"}),
              HasSubstr("--set film.outlines=false"));
}

TEST_F(Story_slow, CardsComeBeforeAndAfterTheMotionAndLeaveItAsItIs) {
  const Film plain = film({}),
             told = film({"film.title={ text = \"Cube\\nfalls\", duration_s = 1 }",
                          "film.end_card={ text = \"End\", duration_s = 0.5, ground = \"plain\" }"});
  ASSERT_EQ(told.frames.size(), 20 + plain.frames.size() + 10);
  for (std::size_t f = 0; f < plain.frames.size(); ++f) ASSERT_EQ(told.frames[20 + f], plain.frames[f]) << f;
  // The title stands, and gives way in half a second.
  EXPECT_EQ(told.frames[0], told.frames[9]);
  double before = std::numeric_limits<double>::infinity();
  for (std::size_t f = 10; f < 20; ++f) {
    double away = 0;
    for (std::size_t i = 0; i < told.frames[f].rgb.size(); ++i)
      away += std::abs(told.frames[f].rgb[i] - plain.frames[0].rgb[i]);
    EXPECT_GT(away, 0);
    EXPECT_LT(away, before);
    before = away;
  }
  // The end comes within a quarter of a second, and stands.
  const std::size_t end = 20 + plain.frames.size();
  EXPECT_NE(told.frames[end], plain.frames.back());
  EXPECT_NE(told.frames[end + 2], told.frames[end + 4]);
  EXPECT_EQ(told.frames[end + 5], told.frames[end + 9]);
  // A part of the frames, by another worker, is the same.
  const std::vector<std::string> words{
      "render",   out(),  "--as",  "part",
      "--frames", "15,3", "--set", "film.title={ text = \"Cube\\nfalls\", duration_s = 1 }"};
  ASSERT_EQ(limber_program(words).code, exit_done);
  for (const int f : {3, 15})
    EXPECT_EQ(render::read_png(fs::path(out()) / "frames-part" / fmt::format("{:04}.png", f)),
              told.frames[std::size_t(f)]);
  // While the title can be read no other words are there; they come before the motion does.
  const std::string title = "film.title={ text = \"Cube\", duration_s = 1 }";
  const Film wordless = film({title}),
             captioned = film({title, "film.caption=A long caption", "film.clock=true"});
  for (std::size_t f = 0; f <= 16; ++f) EXPECT_EQ(wordless.frames[f], captioned.frames[f]) << f;
  for (std::size_t f = 18; f <= 20; ++f)
    EXPECT_GT(changed_pixels(wordless.frames[f], captioned.frames[f]), 50) << f;
  EXPECT_THAT(refusal({"render", out(), "--set", "film.title={ text = \" \\n\" }"}),
              HasSubstr("film.title.text has no words"));
  for (const char* set : {"film.title={ text = \"心\" }", "film.end_card={ text = \"心\" }"})
    EXPECT_THAT(refusal({"render", out(), "--set", set}), HasSubstr("no letters for 心"));
  EXPECT_THAT(refusal({"render", out(), "--set", "film.title={ text = \"a\\tb\" }"}),
              HasSubstr("letters that cannot be seen"));
  EXPECT_THAT(
      refusal({"render", out(), "--set", "film.title={ text = \"1\\n2\\n3\\n4\\n5\\n6\\n7\\n8\\n9\" }"}),
      HasSubstr("9 lines; at most 8"));
  EXPECT_THAT(refusal({"render", out(), "--bits", "16", "--set", "film.title={ text = \"A\" }"}),
              HasSubstr("a scene without film.title"));
}

// The other camera's picture, small, in a corner in which no body is; and nothing else changes.
TEST_F(Story_slow, AnInsetIsTheOtherCamerasPictureInACorner) {
  const Film plain = film({}), with = film({"film.inset={ camera = \"behind\", size = 0.25 }"});
  ASSERT_EQ(with.frames.size(), plain.frames.size());
  std::set<std::vector<int>> boxes;
  for (std::size_t f = 0; f < plain.frames.size(); f += 7) {
    std::vector<int> box{96, 64, 0, 0};
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 96; ++x) {
        const std::size_t at = 3 * std::size_t(96 * y + x);
        if (!std::equal(&with.frames[f].rgb[at], &with.frames[f].rgb[at] + 3, &plain.frames[f].rgb[at]))
          box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x + 1), std::max(box[3], y + 1)};
      }
    boxes.insert(box);
  }
  for (const std::vector<int>& box : boxes) {
    EXPECT_LE(box[2] - box[0], 24 + 2);
    EXPECT_LE(box[3] - box[1], 16 + 2);
    EXPECT_TRUE(box[2] < 48 || box[0] >= 48);
    EXPECT_TRUE(box[3] < 32 || box[1] >= 32);
  }
  EXPECT_NE(with.frames.front(), plain.frames.front());
  // Its own film has none of itself.
  EXPECT_EQ(film({"film.inset={ camera = \"behind\" }"}, {"--camera", "behind"}).frames,
            film({}, {"--camera", "behind"}).frames);
  EXPECT_THAT(refusal({"render", out(), "--set", "film.inset={ camera = \"above\" }"}),
              HasSubstr("no camera \"above\"; there are: main, behind"));
  EXPECT_THAT(refusal({"render", out(), "--set", "film.inset={ camera = \"behind\" }", "--set",
                       "film.side_by_side=true"}),
              HasSubstr("take one of them"));
}

// From straight above, the cube that rests at the wall x = 2 is on the right; to a camera that rose there
// from that wall's side, looking towards −x, it is below the middle.
TEST_F(Story_slow, ACameraMayLookStraightDown) {
  for (const auto& [before, up, place] :
       {std::tuple("", Vec3(0, 1, 0), Eigen::Vector2d(1, 0)),
        {"{ at = 0, eye_m = [1, -4, 1], target_m = [1, 1, 1] }, ", Vec3(0, 1, 0), Eigen::Vector2d(1, 0)},
        {"{ at = 0, eye_m = [6, 1, 1], target_m = [1, 1, 1] }, ", Vec3(-1, 0, 0), Eigen::Vector2d(0, 1)}}) {
    SCOPED_TRACE(before);
    film({std::string("cameras=[{ name = \"above\", keyframes = [") + before +
          "{ at = 1, eye_m = [1, 1, 6], target_m = [1, 1, 0] }] }]"},
         {"--camera", "above", "--passes", "object"});
    const Json cameras = read_json(frame("passes.json")).at("cameras");
    const Json told = cameras.back().at("up");
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(told[std::size_t(i)].get<double>(), up[i], 1e-12);
    const render::Raster16 object =
        render::read_png_16(frame(fmt::format("{:04}.object.png", cameras.size() - 1)));
    Eigen::Vector2d middle(0, 0);
    int seen = 0;
    for (int y = 0; y < object.height; ++y)
      for (int x = 0; x < object.width; ++x)
        if (object.levels[std::size_t(y * object.width + x)] > 0)
          middle += Eigen::Vector2d(x + 0.5, y + 0.5), ++seen;
    ASSERT_GT(seen, 20);
    const Eigen::Vector2d aside = middle / seen - 0.5 * Eigen::Vector2d(object.width, object.height);
    EXPECT_GT(aside.dot(place), 5);
    EXPECT_LT(std::abs(aside.x() * place.y() - aside.y() * place.x()), 2);
  }
}

// passes.json tells where in each picture the robot is touched: on the cube's right, where the wall is.
TEST_F(Story_slow, PassesTellWhereTheRobotIsTouched) {
  film({"film.pace=contact"}, {"--passes", "object,depth"});
  const Json key = read_json(frame("passes.json"));
  const int frames = int(key.at("contacts").size());
  ASSERT_GT(frames, 60);
  EXPECT_EQ(key.at("contacts").at(0), Json::array());
  EXPECT_FALSE(key.at("contacts").at(std::size_t(frames) - 1).empty());
  const double near = key.at("depth_m").at(0), far = key.at("depth_m").at(1);
  for (int f = 0; f < frames; ++f) {
    if (key.at("contacts").at(std::size_t(f)).empty()) continue;
    const render::Raster16 object = render::read_png_16(frame(fmt::format("{:04}.object.png", f)));
    int left = object.width, right = 0;
    for (int y = 0; y < object.height; ++y)
      for (int x = 0; x < object.width; ++x)
        if (object.levels[std::size_t(y) * std::size_t(object.width) + std::size_t(x)])
          left = std::min(left, x), right = std::max(right, x + 1);
    for (const Json& contact : key.at("contacts").at(std::size_t(f))) {
      EXPECT_GT(contact.at(0), 0.5 * (left + right)) << f;  // the wall is seen from its edge, to the right
      EXPECT_LT(contact.at(0), right + 1) << f;
      EXPECT_GT(contact.at(2), near);
      EXPECT_LT(contact.at(2), far);
      EXPECT_GT(contact.at(3), 0);
      EXPECT_EQ(contact.at(4), 0);  // a wall
    }
  }
}

}  // namespace
}  // namespace limber::detail
