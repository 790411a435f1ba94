// What the keys of film and cameras, and the flags of `limber render`, do to the pictures.
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "limber/detail/film/render.h"
#include "limber/detail/plan/plan_folder.h"
#include "render/camera.h"
#include "render/png_file.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

using testing::HasSubstr;

// One plan for all of them.
class Filmed : public Program {
 protected:
  void SetUp() override {
    const Result planned = limber_program({"plan", scene(text()), "-o", out(), "--json"});
    ASSERT_EQ(planned.code, exit_done) << planned.err;
    frames = planned.json().at("frames");
  }
  virtual std::string text() const { return small_scene; }
  // Frame 3 under these flags.
  render::Image8 frame_3(std::vector<std::string> flags) const {
    std::vector<std::string> words{"render", out(), "--frames", "3", "--as", "try"};
    words.insert(words.end(), flags.begin(), flags.end());
    const Result result = limber_program(words);
    EXPECT_EQ(result.code, exit_done) << result.err;
    return render::read_png(picture("0003.png"));
  }
  fs::path picture(const std::string& name) const { return fs::path(out()) / "frames-try" / name; }
  int frames = 0;
};
using Filmed_slow = Filmed;  // stays out of the sanitizer runs

TEST_F(Filmed_slow, EveryKeyOfTheFilmChangesThePicture) {
  const render::Image8 plain = frame_3({});
  for (const char* set :
       {"film.color_by=strain",     "film.color_by=volume",       "film.color_by=speed",
        "film.cages=true",          "film.forces=true",           "film.path=true",
        "film.tree=true",           "film.side_by_side=true",     "film.clock=true",
        "film.caption=Hello",       "film.bounds_lines=false",    "film.background=#102030",
        "film.transparent=true",    "camera.turn_deg=90",         "camera.follow=robot",
        "camera.direction=[1,0,0]", "bodies.robot.color=#00ff00", "bodies.robot.opacity=0.5",
        "bodies.robot.metallic=1",  "bodies.robot.roughness=0.1", "film.scale_bar=true",
        "film.look=dark",           "film.look=clinical",         "film.look=paper",
        "bodies.robot.look=tissue", "bodies.robot.look=fabric"})
    EXPECT_NE(frame_3({"--set", set}), plain) << set;
  EXPECT_EQ(frame_3({}), plain);
  EXPECT_NE(frame_3({"--set", "bodies.robot.deformation=phong"}),
            frame_3({"--set", "bodies.robot.deformation=linear"}));
}

// Of what differs: left, top, right, bottom.
Eigen::Vector4i box_of_changes(const render::Image8& a, const render::Image8& b) {
  Eigen::Vector4i box(a.width, a.height, 0, 0);
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      if (const std::size_t at = 3 * (std::size_t(y) * std::size_t(a.width) + std::size_t(x));
          !std::equal(&a.rgb[at], &a.rgb[at] + 3, &b.rgb[at]))
        box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x + 1), std::max(box[3], y + 1)};
  return box;
}

TEST_F(Filmed_slow, WordsKeepClearOfTheLargestInset) {
  const std::vector<std::string> plain{"--size", "320x200", "--set",
                                       "cameras=[{ name = \"above\", direction = [0, 0, 1] }]"};
  std::vector<std::string> inset = plain;
  inset.insert(inset.end(), {"--set", "film.inset={ camera = \"above\", size = 0.5 }"});
  std::vector<std::string> words = inset;
  words.insert(words.end(),
               {"--set", "film.caption=A long line of words, and some more", "--set", "film.clock=true"});
  const render::Image8 before = frame_3(inset);
  const Eigen::Vector4i of_inset = box_of_changes(frame_3(plain), before),
                        of_words = box_of_changes(before, frame_3(words));
  ASSERT_GT(of_inset[2] - of_inset[0], 150);
  ASSERT_GT(of_words[2] - of_words[0], 20);
  EXPECT_TRUE(of_words[2] <= of_inset[0] || of_inset[2] <= of_words[0] || of_words[3] <= of_inset[1] ||
              of_inset[3] <= of_words[1])
      << of_inset.transpose() << " and " << of_words.transpose();
}

TEST_F(Filmed_slow, AnEarlierFilmIsToldToBeThat) {
  ASSERT_EQ(limber_program({"render", out(), "--size", "63x47"}).code, exit_done);
  const Result part =
      limber_program({"render", out(), "--size", "63x47", "--frames", "0-1", "--set", "film.look=dark"});
  EXPECT_EQ(part.code, exit_done) << part.err;
  EXPECT_THAT(part.out, HasSubstr("film.mp4 is of an earlier render, and not of these frames"));
  EXPECT_THAT(part.out,
              HasSubstr(fmt::format("{} of the frames that are there show it by other options", frames - 2)));
  const Result whole = limber_program({"render", out(), "--size", "63x47", "--set", "film.look=dark"});
  EXPECT_EQ(whole.code, exit_done) << whole.err;
  EXPECT_THAT(whole.out, Not(HasSubstr("earlier")));
  EXPECT_THAT(whole.out, HasSubstr("film.mp4 (64x48: films have even sides)"));
}

// Wherever the bodies are in the picture, no letter is on them.
TEST_F(Filmed_slow, WordsStandWhereNoBodyIs) {
  std::set<std::pair<bool, bool>> corners;
  for (const double x : {-1.0, 1.0})
    for (const double z : {-1.0, 1.0}) {
      const std::string camera = fmt::format(
          "cameras=[{{ name = \"near\", keyframes = [{{ at = 0, eye_m = [{0}, -4, {1}], target_m = [{0}, 1, "
          "{1}] }}] }}]",
          2 + 2.3 * x, 0.45 + 1.1 * z);
      const std::vector<std::string> plain{"--camera", "near",   "--set", camera,
                                           "--passes", "object", "--set", "film.bounds_lines=false"};
      std::vector<std::string> with_words = plain;
      with_words.insert(with_words.end(), {"--set", "film.caption=Hello", "--set", "film.clock=true"});
      const render::Image8 before = frame_3(plain);
      const render::Raster16 object = render::read_png_16(picture("0003.object.png"));
      const render::Image8 after = frame_3(with_words);
      int words = 0, on_body = 0;
      double middle_x = 0, middle_y = 0;
      for (std::size_t i = 0; i < object.levels.size(); ++i) {
        if (std::equal(&before.rgb[3 * i], &before.rgb[3 * i] + 3, &after.rgb[3 * i])) continue;
        ++words, on_body += object.levels[i] != 0;
        middle_x += double(i % std::size_t(before.width)), middle_y += double(i / std::size_t(before.width));
      }
      ASSERT_GT(words, 20);
      EXPECT_EQ(on_body, 0) << camera;
      corners.insert({middle_x / words < before.width / 2.0, middle_y / words < before.height / 2.0});
      // Bodies that are cut away are in no one's way: of equal corners it is the first.
      const std::string all =
          "film.cuts=[{ point_m = [0, 0, -1], normal = [0, 0, 1], bodies = [\"robot\", \"block\"] }]";
      std::vector<std::string> bare{"--camera", "near", "--set", camera, "--set", "film.bounds_lines=false",
                                    "--set",    all};
      const render::Image8 nothing = frame_3(bare);
      bare.insert(bare.end(), {"--set", "film.caption=Hello"});
      const Eigen::Vector4i box = box_of_changes(nothing, frame_3(bare));
      EXPECT_LT(box[2], nothing.width / 2 + 8) << camera;
      EXPECT_GT(box[1], nothing.height / 2) << camera;
    }
  EXPECT_GT(corners.size(), 1u) << "bodies stood in the way of none";
}

TEST_F(Filmed_slow, WhatWouldChangeTheMotionIsRefused) {
  for (const char* set : {"film.frames_per_second=10", "film.speed=0.5", "planner.seed=3", "goal.radius_m=1",
                          "bodies.robot.material.density_kg_m3=7"}) {
    const Result refused = limber_program({"render", out(), "--set", set});
    EXPECT_EQ(refused.code, exit_bad_input);
    EXPECT_THAT(refused.err, HasSubstr("the motion is planned already")) << set;
  }
  EXPECT_THAT(limber_program({"render", out(), "--camera", "left"}).err, HasSubstr("there are: main"));
  EXPECT_THAT(limber_program({"render", out(), "--set", "film.caption=心"}).err,
              HasSubstr("no letters for 心"));
  EXPECT_THAT(limber_program({"render", out(), "--as", "../x"}).err, HasSubstr("letters, digits"));
  EXPECT_THAT(limber_program({"render", out(), "--passes", "scalar"}).err, HasSubstr("film.color_by=strain"));
  EXPECT_THAT(limber_program({"render", out(), "--bits", "16", "--set", "film.clock=true"}).err,
              HasSubstr("film.clock=false"));
}

// The range of colours is that of the whole motion, so a part of the frames, or a chunk, has the same.
TEST_F(Filmed_slow, AFrameIsTheSameByItself) {
  const render::Image8 alone = frame_3({"--set", "film.color_by=strain"});
  ASSERT_EQ(limber_program({"render", out(), "--as", "whole", "--set", "film.color_by=strain"}).code,
            exit_done);
  EXPECT_EQ(render::read_png(fs::path(out()) / "frames-whole" / "0003.png"), alone);
  EXPECT_TRUE(fs::exists(fs::path(out()) / "film-whole.mp4"));
  EXPECT_TRUE(fs::exists(fs::path(out()) / "sheet-whole.png"));
  EXPECT_FALSE(fs::exists(fs::path(out()) / "film.mp4"));
}

TEST_F(Filmed_slow, PassesAgreeWithOneAnother) {
  frame_3({"--passes", "depth,normal,object,scalar", "--bits", "16", "--set", "film.color_by=volume"});
  const render::Raster16 depth = render::read_png_16(picture("0003.depth.png")),
                         normal = render::read_png_16(picture("0003.normal.png")),
                         object = render::read_png_16(picture("0003.object.png")),
                         scalar = render::read_png_16(picture("0003.scalar.png"));
  ASSERT_EQ(depth.channels, 1);
  ASSERT_EQ(normal.channels, 3);
  ASSERT_EQ(object.channels, 1);
  ASSERT_EQ(scalar.channels, 2);
  std::set<int> seen;
  for (std::size_t i = 0; i < depth.levels.size(); ++i) {
    const int number = object.levels[i] / 257;  // 8 bit
    seen.insert(number);
    EXPECT_EQ(depth.levels[i] == 65535, number == 0) << i;
    EXPECT_EQ(scalar.levels[2 * i + 1], number == 0 ? 0 : 65535);
    double length = 0;
    for (std::size_t c = 0; c < 3; ++c) length += std::pow(normal.levels[3 * i + c] / 32767.5 - 1, 2);
    EXPECT_NEAR(length, number == 0 ? 0 : 1, 0.01);
  }
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2}));
  const Json key = read_json(picture("passes.json"));
  EXPECT_EQ(key.at("objects"), Json({"", "robot", "block"}));
  const double low = key.at("scalar").at("range").at(0), high = key.at("scalar").at("range").at(1);
  EXPECT_EQ(low, -high);
  EXPECT_GT(high, 0);

  // By its camera and depth, each pixel of a body is a place within the bounds, and some lie on the ground.
  const Json& shown = key.at("cameras").at(3);
  render::Camera camera;
  for (int i = 0; i < 3; ++i)
    camera.eye[i] = shown.at("eye_m")[i], camera.target[i] = shown.at("target_m")[i];
  camera.fov_deg = shown.at("fov_deg");
  const double nearest = key.at("depth_m")[0], farthest = key.at("depth_m")[1],
               tangent = std::tan(camera.fov_deg * EIGEN_PI / 360);
  const render::Mat4 world_from_camera = render::camera_from_world(camera).inverse();
  Box there;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const std::uint16_t level = depth.levels[std::size_t(y * depth.width + x)];
      if (level == 65535) continue;
      const double z = nearest + level / 65535.0 * (farthest - nearest),
                   pixel = 2 * tangent * z / depth.height;
      const Vec3 seen_at((x + 0.5 - 0.5 * depth.width) * pixel, (0.5 * depth.height - y - 0.5) * pixel, -z);
      there.include((world_from_camera * seen_at.homogeneous()).head<3>());
    }
  EXPECT_NEAR(there.lower.z(), 0, 0.1);
  EXPECT_GT(there.lower.minCoeff(), -0.1);
  EXPECT_LT((there.upper - Vec3(4, 2, 2)).maxCoeff(), 0.1);
  EXPECT_NEAR(key.at("light").at("ground_m"), 0, 1e-12);
}

// The robot, then robot and block together.
TEST_F(Filmed_slow, TheSubjectFillsItsShareOfThePicture) {
  for (const bool both : {false, true}) {
    ASSERT_EQ(limber_program({"render", out(), "--as", "try", "--passes", "object", "--set",
                              both ? "camera.subject=['robot', 'block']" : "camera.subject=robot", "--set",
                              "camera.fill=0.6", "--set", "camera.direction=[0,0,1]", "--set",
                              "film.bounds_lines=false"})
                  .code,
              exit_done);
    int left = 1 << 20, right = -1, top = 1 << 20, bottom = -1, width = 0, height = 0;
    for (int f = 0; f < frames; ++f) {
      const render::Raster16 object = render::read_png_16(picture(fmt::format("{:04}.object.png", f)));
      width = object.width, height = object.height;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          if (const int level = object.levels[std::size_t(y) * std::size_t(width) + std::size_t(x)];
              level == 257 || (both && level == 514))
            left = std::min(left, x), right = std::max(right, x + 1), top = std::min(top, y),
            bottom = std::max(bottom, y + 1);
    }
    EXPECT_NEAR(std::max(double(right - left) / width, double(bottom - top) / height), 0.6, 0.01);
  }
  EXPECT_THAT(limber_program({"render", out(), "--set", "camera.subject=robt"}).err,
              HasSubstr("robot, block"));
}

TEST_F(Filmed_slow, AFrameWithoutItsPassIsNotWhole) {
  const std::vector<std::string> words{"render", out(), "--resume", "--json", "--passes", "depth"};
  ASSERT_EQ(limber_program(words).json().at("painted"), frames);
  EXPECT_EQ(limber_program(words).json().at("painted"), 0);
  fs::remove(fs::path(out()) / "frames" / "0002.depth.png");
  EXPECT_EQ(limber_program(words).json().at("painted"), 1);
}

// The key light comes from over the shoulder of whoever films the first frame: where that is moved, all is
// lit otherwise, though the other frames' cameras stay.
TEST_F(Filmed_slow, WhoMovesTheFirstCameraPaintsAllFramesAnew) {
  const auto painted = [&](const std::string& eye) {
    std::string keyframes = "{ at = 0, eye_m = " + eye + ", target_m = [2, 1, 1] }";
    for (const char* at : {"0.01", "0.02", "1"})  // a path through keyframes bends for the nearest alone
      keyframes += fmt::format(", {{ at = {}, eye_m = [0, -5, 2], target_m = [2, 1, 1] }}", at);
    return limber_program({"render", out(), "--resume", "--json", "--as", "moved", "--set",
                           "camera.keyframes=[" + keyframes + "]"})
        .json()
        .at("painted");
  };
  ASSERT_EQ(painted("[0, -5, 2]"), frames);
  EXPECT_EQ(painted("[0, -5, 2]"), 0);
  EXPECT_EQ(painted("[-3, -4, 2]"), frames);
}

// What an adversary does to a film, the rest of the folder being as it was: each is named, and so is the
// film.
TEST_F(Filmed_slow, EveryFalseWordOfAFilmIsNamed) {
  ASSERT_EQ(limber_program({"render", out(), "--size", "64x48"}).code, exit_done);
  ASSERT_EQ(limber_program({"render", out(), "--size", "64x48", "--as", "deep", "--passes", "depth", "--bits",
                            "16", "--frames", "0-3", "--set", "film.clock=false", "--set", "film.caption="})
                .code,
            exit_done);
  const Result good = limber_program({"verify", out(), "--film"});
  ASSERT_EQ(good.code, exit_done) << good.out;
  EXPECT_THAT(good.out, HasSubstr("film-deep: frames that are painted again have the same pixels"));
  // A film of another kind, made later, does not make the first a false one.
  ASSERT_EQ(
      limber_program({"render", out(), "--size", "64x48", "--resume", "--video", out() + "/film.webm"}).code,
      exit_done);
  const Result both = limber_program({"verify", out(), "--film"});
  EXPECT_EQ(both.code, exit_done) << both.out;
  EXPECT_THAT(both.out, HasSubstr("film.mp4"));
  fs::remove(fs::path(out()) / "film.webm");
  ASSERT_EQ(limber_program({"render", out(), "--size", "64x48"}).code, exit_done);

  const fs::path work = out(), keep = out("keep");
  fs::copy(work, keep, fs::copy_options::recursive);
  const auto named = [&](const std::string& what, const std::string& promise, const auto& change) {
    fs::remove_all(work);
    fs::copy(keep, work, fs::copy_options::recursive);
    change();
    const Result result = limber_program({"verify", out(), "--film", "--repaint", std::to_string(frames)});
    EXPECT_EQ(result.code, 1) << what << '\n' << result.out << result.err;
    std::istringstream lines(result.out);
    bool broken = false;
    for (std::string line; std::getline(lines, line);)
      broken =
          broken || (line.find("BROKEN") != std::string::npos && line.find(promise) != std::string::npos);
    EXPECT_TRUE(broken) << what << '\n' << result.out;
  };
  const auto told = [&](const std::string& pointer, const Json& value, const char* stage = "render") {
    named(std::string(stage) + pointer, "manifest.json tells of this film", [&] {
      Json manifest = read_json(work / "manifest.json");
      manifest.at(stage)[Json::json_pointer(pointer)] = value;
      write_json(work / "manifest.json", manifest);
    });
  };
  told("/frames", frames + 1), told("/wanted", frames + 1), told("/painted", frames + 1), told("/failed", 1);
  told("/failed", -1), told("/trajectory_hash", std::string(16, '0')), told("/time/seconds", 1);
  told("/time/motion_s", 1), told("/time/left_out_s", 1), told("/time/speed", {2, 2}),
      told("/quality", "best");
  told("/camera", "near"), told("/bits", 12), told("/passes", {"beauty"}, "render-deep"), told("/sets", 7);
  told("/size", "large"), told("/sheet", nullptr), told("/folder", "/etc");

  const auto number = [](int frame) { return fmt::format("{:04}.png", frame); };
  const std::string says = "each frame says", pixels = "painted again",
                    film = "made again from its frames: the", sheet = "contact sheet";
  const auto entry = [&](const std::string& key, const Json& value, const std::string& promise,
                         const std::string& stage = "render") {
    named(stage + " with other " + key, promise, [&] {
      Json manifest = read_json(work / "manifest.json");
      manifest.at(stage)[key] = value;
      write_json(work / "manifest.json", manifest);
    });
  };
  entry("size", {64, 64}, "do not; the first is"), entry("sets", {"film.forces=true"}, says),
      entry("bits", 16, says);
  entry("sets", {"film.look=dark"}, says, "render-deep"), entry("passes", Json::array(), says, "render-deep");
  named("no frame 2", says, [&] { fs::remove(work / "frames" / number(2)); });
  named("a frame for another", says, [&] {
    fs::copy_file(work / "frames" / number(1), work / "frames" / number(2),
                  fs::copy_options::overwrite_existing);
  });
  named("no pass", says, [&] { fs::remove(work / "frames-deep" / "0001.depth.png"); });
  // Another's pixels under the hash of what should be seen, and of what is.
  const auto texts = [](const fs::path& file, const auto& picture) {
    return render::Texts{
        {"limber-hash", *render::frame_hash(file)},
        {"limber-pixels", hash_of_shown(*render::frame_hash(file), render::pixel_hash(picture))}};
  };
  named("the last frame's pixels", pixels, [&] {
    const fs::path last = work / "frames" / number(frames - 1);
    render::Image8 picture = render::read_png(last);
    picture.rgb[3 * 64 * 24 + 3 * 32] ^= 8;
    render::write_png(last, picture, texts(last, picture));
  });
  named("the second frame's pixels", pixels, [&] {
    const fs::path second = work / "frames" / number(1);
    render::Image8 picture = render::read_png(second);
    picture.rgb[0] ^= 1;
    render::write_png(second, picture, texts(second, picture));
  });
  named("a pass' depths", pixels, [&] {
    const fs::path pass = work / "frames-deep" / "0003.depth.png";
    render::Raster16 depths = render::read_png_16(pass);
    depths.levels[64 * 24 + 32] ^= 256;
    render::write_png(pass, depths, texts(pass, depths));
  });
  // Painted over by a program that keeps texts; and what a viewer would show otherwise.
  const std::string files = "files are as limber wrote them";
  named("pixels that the file does not know of", files, [&] {
    const fs::path second = work / "frames" / number(1);
    render::Image8 picture = render::read_png(second);
    render::Texts kept = texts(second, picture);
    picture.rgb[0] ^= 1;
    render::write_png(second, picture, kept);
  });
  named("no hash of pixels", files, [&] {
    const fs::path second = work / "frames" / number(1);
    render::write_png(second, render::read_png(second), {{"limber-hash", *render::frame_hash(second)}});
  });
  named("a pass' depths that the file does not know of", files, [&] {
    const fs::path pass = work / "frames-deep" / "0001.depth.png";
    render::Raster16 depths = render::read_png_16(pass);
    const render::Texts kept = texts(pass, depths);
    depths.levels[0] ^= 1;
    render::write_png(pass, depths, kept);
  });
  named("a gamma", files, [&] {
    const fs::path second = work / "frames" / number(1);
    // Of 1 / 10, after the header: length, kind, 100000 gamma, checksum.
    const std::string gamma("\0\0\0\4gAMA\0\0\x27\x10\x4c\x57\xc2\x4c", 16);
    write_file(second, read_file(second).insert(33, gamma));
    ASSERT_TRUE(render::inspect_png(second)) << "its checksum";
  });
  named("another text", files, [&] {
    const fs::path second = work / "frames" / number(1);
    const render::Image8 picture = render::read_png(second);
    render::Texts more = texts(second, picture);
    more["Software"] = "another";
    render::write_png(second, picture, more);
  });
  named("another frame's pixels and their hash", files, [&] {
    const fs::path first = work / "frames" / number(0), second = work / "frames" / number(1);
    render::Texts kept = texts(first, render::read_png(first));
    kept.at("limber-hash") = *render::frame_hash(second);
    render::write_png(second, render::read_png(first), kept);
  });
  named("words behind the end", files, [&] {
    const fs::path second = work / "frames" / number(1);
    write_file(second, read_file(second) + "hello");
  });
  named("pixels that can't be had", files, [&] {  // a whole file, by its checksums
    const fs::path second = work / "frames" / number(1), small = work / "small.png";
    render::write_png(small, render::filled(16, 16, Vec3(0, 0, 0)));
    const std::string large_file = read_file(second), small_file = read_file(small);
    write_file(second, large_file.substr(0, large_file.find("IDAT") - 4) +
                           small_file.substr(small_file.find("IDAT") - 4));
    fs::remove(small);
    ASSERT_TRUE(render::inspect_png(second));
  });
  named("depths of a pass that is not told of", pixels, [&] {
    const fs::path frame = work / "frames" / number(1), pass = work / "frames" / "0001.depth.png";
    const render::Raster8 depths{64, 48, 1, std::vector<std::uint8_t>(64 * 48, 7)};
    render::write_png(
        pass, depths,
        {{"limber-hash", *render::frame_hash(frame)},
         {"limber-pixels", hash_of_shown(*render::frame_hash(frame), render::pixel_hash(depths))}});
    write_json(work / "frames" / "passes.json", read_json(keep / "frames-deep" / "passes.json"));
  });
  named("a table that is not limber's", "manifest.json holds what limber writes", [&] {
    Json manifest = read_json(work / "manifest.json");
    manifest["certified"] = {{"by", "somebody"}};
    write_json(work / "manifest.json", manifest);
  });
  named("a picture of another ending", "no other pictures",
        [&] { fs::copy_file(work / "frames" / number(1), work / "frames" / "0001.PNG"); });
  named("a frame beyond the last", "no other pictures",
        [&] { fs::copy_file(work / "frames" / number(1), work / "frames" / "0500.png"); });
  for (const char* film_of_nobody : {"film.mov", "FILM.mp4", "film.MKV"})
    named(film_of_nobody, "no other pictures",
          [&] { fs::copy_file(work / "film.mp4", work / film_of_nobody); });
  named("a pass of nobody", "no other pictures",
        [&] { fs::copy_file(work / "frames" / number(1), work / "frames" / "0002.depth.png"); });
  named("another key of passes", "passes.json says", [&] {
    Json key = read_json(work / "frames-deep" / "passes.json");
    key.at("depth_m")[1] = key.at("depth_m")[1].get<double>() + 1;
    write_json(work / "frames-deep" / "passes.json", key);
  });
  named("a key of passes, and no passes", "passes.json says",
        [&] { fs::copy_file(work / "frames-deep" / "passes.json", work / "frames" / "passes.json"); });
  named("a film of which a frame failed", "manifest.json tells of this film", [&] {
    Json manifest = read_json(work / "manifest.json");
    manifest.at("render")["failed"] = 1, manifest.at("render")["painted"] = frames - 1;
    write_json(work / "manifest.json", manifest);
  });
  named("a part of a film, and less of it", "manifest.json tells of this film", [&] {
    for (const char* file : {"0003.png", "0003.depth.png"}) fs::remove(work / "frames-deep" / file);
  });
  named("a folder of frames of no film", "manifest.json tells of each",
        [&] { fs::copy(work / "frames", work / "frames-near", fs::copy_options::recursive); });
  named("no film", film, [&] { fs::remove(work / "film.mp4"); });
  named("another film", film, [&] { fs::resize_file(work / "film.mp4", 100); });
  named("another film of its name", film, [&] { write_file(work / "film.gif", "GIF89a;"); });
  named("another film here, and the good one elsewhere", film, [&] {
    Json manifest = read_json(work / "manifest.json");
    manifest.at("render")["film"] = (keep / "film.mp4").string();
    manifest.at("render")["sheet"] = (keep / "sheet.png").string();
    write_json(work / "manifest.json", manifest);
    fs::resize_file(work / "film.mp4", 100);
  });
  named("a film that is told to be none", "manifest.json tells of each", [&] {
    Json manifest = read_json(work / "manifest.json");
    manifest.at("render").erase("film"), manifest.at("render").erase("sheet");
    write_json(work / "manifest.json", manifest);
  });
  named("a film more", "manifest.json tells of each",
        [&] { fs::copy_file(work / "film.mp4", work / "film-near.mp4"); });
  named("no sheet", sheet, [&] { fs::remove(work / "sheet.png"); });
  named("another sheet", sheet, [&] {
    fs::copy_file(work / "frames" / number(0), work / "sheet.png", fs::copy_options::overwrite_existing);
  });
  // Of a folder that was copied, its own film is looked at, not that of where it came from.
  fs::remove_all(work);
  fs::copy(keep, work, fs::copy_options::recursive);
  EXPECT_EQ(limber_program({"verify", keep.string(), "--film"}).code, exit_done);
  fs::remove(keep / "film.mp4");
  EXPECT_EQ(limber_program({"verify", keep.string(), "--film"}).code, 1);
  fs::copy_file(work / "film.mp4", keep / "film.mp4");
  // No film, and nothing to look at.
  fs::remove_all(work);
  fs::copy(keep, work, fs::copy_options::recursive);
  Json manifest = read_json(work / "manifest.json");
  manifest.erase("render"), manifest.erase("render-deep");
  write_json(work / "manifest.json", manifest);
  const Result untold = limber_program({"verify", out(), "--film"});
  EXPECT_EQ(untold.code, 1);
  EXPECT_THAT(untold.out, HasSubstr("manifest.json tells of no film"));
  for (const char* made : {"film.mp4", "sheet.png", "frames", "frames-deep"}) fs::remove_all(work / made);
  const Result none = limber_program({"verify", out(), "--film"});
  EXPECT_EQ(none.code, exit_bad_input);
  EXPECT_THAT(none.err, HasSubstr("limber render"));
}

class SlowMotion_slow : public Filmed {
  std::string text() const override {
    std::string edited = replaced("frames_per_second = 5\n", "frames_per_second = 5\nspeed = 0.5\n");
    return edited.replace(edited.find("seed = 1"), 8, "seed = 10") +
           "[[cameras]]\nname = \"above\"\ndirection = [0, 0, 1]\n"
           "[[bodies]]\nname = \"veil\"\nrole = \"scenery\"\nopacity = 0.4\n"
           "model = { sphere = { diameter_m = 1.5 } }\npose = { position_m = [2, 1, 1] }\n";
  }
};

TEST_F(SlowMotion_slow, HasTwiceTheFramesOfTheSameMotion) {
  const Result normal = limber_program({"plan", scene(), "-o", out("normal"), "--seed", "10", "--json"});
  const int usual = normal.json().at("frames");
  EXPECT_NEAR(frames, 2 * usual, 1);
}

TEST_F(SlowMotion_slow, SceneryIsSeenAndOtherCamerasHaveTheirOwnFilm) {
  const render::Image8 seen = frame_3({});
  EXPECT_NE(frame_3({"--set", "bodies.veil.color=#00ff00"}), seen);
  const Result above = limber_program({"render", out(), "--camera", "above", "--frames", "3"});
  ASSERT_EQ(above.code, exit_done) << above.err;
  EXPECT_NE(render::read_png(fs::path(out()) / "frames-above" / "0003.png"), seen);
  fs::remove(fs::path(out()) / "scenery" / "veil.ply");
  const Result broken = limber_program({"render", out()});
  EXPECT_EQ(broken.code, exit_bad_input);
  EXPECT_THAT(broken.err, HasSubstr("limber plan"));
}

class WithoutScenery_slow : public Filmed {
 protected:
  std::string text() const override {
    return small_scene + std::string(
                             "[[bodies]]\nname = \"veil\"\nrole = \"scenery\"\n"
                             "model = { file = \"nowhere.obj\" }\n");
  }
};

TEST_F(WithoutScenery_slow, AModelThatIsNotFoundIsLeftOutAndTheRestIsAsWithoutIt) {
  const render::Image8 seen = frame_3({});
  const Result proved = limber_program({"verify", out()});
  EXPECT_EQ(proved.code, exit_done) << proved.out << proved.err;
  EXPECT_EQ(proved.err, "");
  const Result again = limber_program({"plan", scene(text()), "-o", out()});
  EXPECT_THAT(again.err, HasSubstr("nowhere.obj was not found in "));
  EXPECT_THAT(again.err, HasSubstr(". It is left out of the pictures."));
  fs::create_directory(fs::path(scene(text())).parent_path() / "nowhere.obj");
  EXPECT_THAT(limber_program({"plan", scene(text()), "-o", out()}).err, HasSubstr("nowhere.obj is a folder"));
  // What is left of no body, for verify to tell.
  fs::create_directory(fs::path(out()) / "bodies" / "left_over");
  write_file(fs::path(out()) / "bodies" / "robot" / "goal.msh", "");
  const Result told = limber_program({"verify", out()});
  EXPECT_EQ(told.code, exit_done) << told.out << told.err;
  EXPECT_THAT(told.out, HasSubstr("not looked at"));
  EXPECT_THAT(told.out, HasSubstr("bodies/left_over, bodies/robot/goal.msh\n"));
  ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
  EXPECT_EQ(frame_3({}), seen);
}

std::vector<Json> events_of(const std::string& text) {
  std::vector<Json> events;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) events.push_back(Json::parse(line));
  return events;
}

// Every line is an event; the frames told are those on the disk, and stdout has what it has without.
TEST_F(Filmed_slow, ProgressTellsEveryFrameWithItsHash) {
  ASSERT_EQ(limber_program({"render", out(), "--frames", "1"}).code, exit_done);
  const std::string file = out("progress.jsonl");
  const std::vector<std::string> words{"render", out(), "--resume", "--json", "--frames", "0-4,9999"};
  for (const std::string& where : {std::string("json"), file}) {
    SCOPED_TRACE(where);
    fs::remove(fs::path(out()) / "frames" / "0002.png");
    std::vector<std::string> told = words;
    told.insert(told.end(), {"--progress", where});
    const Result result = limber_program(told);
    ASSERT_EQ(result.code, exit_done) << result.err;
    const bool on_stderr = where == "json";
    const std::vector<Json> events = events_of(on_stderr ? result.err : read_file(file));
    EXPECT_EQ(result.err.find("left out") == std::string::npos, false);
    std::map<int, std::string> hashes;
    std::set<std::string> kinds;
    for (const Json& event : events) {
      kinds.insert(event.at("event"));
      if (event.at("event") == "frames") {
        EXPECT_EQ(event.at("wanted"), 5);
      }
      if (event.at("event") != "frame") continue;
      hashes[event.at("frame")] = event.at("hash");
      EXPECT_EQ(event.at("done"), hashes.size());
      EXPECT_GE(event.at("seconds"), 0);
    }
    EXPECT_EQ(kinds.contains("warning"), on_stderr);
    EXPECT_THAT(kinds, testing::IsSupersetOf({"frames", "stage", "frame", "stage_end", "end"}));
    EXPECT_EQ(events.back().at("event"), "end");
    EXPECT_EQ(events.back().at("exit_code"), exit_done);
    EXPECT_EQ(int(hashes.size()), result.json().at("painted"));
    EXPECT_EQ(hashes.size(), on_stderr ? 4u : 1u);  // the second time only the missing one
    for (const auto& [frame, hash] : hashes)
      EXPECT_EQ(render::frame_hash(fs::path(out()) / "frames" / fmt::format("{:04}.png", frame)), hash);
  }
  EXPECT_EQ(limber_program(words).err.find('{'), std::string::npos);
  EXPECT_EQ(limber_program({"render", out(), "--progress", "yes"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"render", out(), "--progress", out("no/such.jsonl")}).code, exit_disk);
  const Result failed = limber_program({"render", out("none"), "--progress", "json"});
  EXPECT_EQ(failed.code, exit_bad_input);
  EXPECT_EQ(events_of(failed.err).back().at("exit_code"), exit_bad_input);
}

// Nothing touches the robot in the goal, so what the forces add to the pictures of the settle is its own
// arrow.
TEST_F(Filmed_slow, TheSettleHasAnArrow) {
  const plan::Trajectory path = read_plan_folder(out()).plan.trajectory;
  int first_of_settle = 0;
  while (path.frames[std::size_t(first_of_settle)].step < path.end.step - path.settle_steps)
    ++first_of_settle;
  ASSERT_LT(first_of_settle, frames - 2);
  const std::string settle = fmt::format("{}-{}", first_of_settle, frames - 1);
  for (const char* forces : {"false", "true"})
    ASSERT_EQ(limber_program({"render", out(), "--frames", settle, "--as", forces, "--set",
                              fmt::format("film.forces={}", forces)})
                  .code,
              exit_done);
  int changed = 0;
  for (int f = first_of_settle; f < frames; ++f) {
    const std::string name = fmt::format("{:04}.png", f);
    changed += render::read_png(fs::path(out()) / "frames-true" / name).rgb !=
               render::read_png(fs::path(out()) / "frames-false" / name).rgb;
  }
  EXPECT_GT(changed, (frames - first_of_settle) / 2);
}

// A scene whose film changed is filmed anew, not planned anew.
TEST_F(Program_slow, RunFilmsAnewWhatIsFilmedOtherwise) {
  ASSERT_EQ(limber_program({"run", scene(), "-o", out()}).code, exit_done);
  const std::string plan = limber_program({"info", out(), "--json"}).out;
  const auto before = render::read_png(fs::path(out()) / "frames" / "0003.png");
  const Result again = limber_program({"run", scene(replaced("#c0392b", "#00ff00")), "-o", out(), "--json"});
  ASSERT_EQ(again.code, exit_done) << again.err;
  EXPECT_GT(again.json().at("render").at("painted"), 0);
  EXPECT_NE(render::read_png(fs::path(out()) / "frames" / "0003.png"), before);
  EXPECT_EQ(Json::parse(plan).at("tree_hash"),
            Json::parse(limber_program({"info", out(), "--json"}).out).at("tree_hash"));
}

}  // namespace
}  // namespace limber::detail
