// Films of work folders, and pictures of scenes before they are planned. docs/rendering.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "limber/motion.h"

namespace limber {

inline const std::vector<std::string> pass_names{"depth", "normal", "object", "scalar"};

struct FilmOptions {
  std::string frames = {};  // "0-30,47-327:2"; empty: all
  std::string chunk = {};   // "i/n": the i-th of n parts of these frames; empty: 1/1
  bool resume = false;      // keep the frames that already show what they should
  std::string size = {};    // pixels, "1920x1080"; empty: the scene's
  std::string camera = "main";
  std::vector<std::string> passes = {};  // of pass_names, beside each frame
  int bits = 8;                          // a channel, 8 or 16
  std::vector<std::string> sets = {};    // of film, cameras and the looks of bodies
  // Names frames-NAME/, film-NAME.mp4 and sheet-NAME.png; empty: the camera's, and none for "main".
  std::string name = {};
  // .mp4, .webm or .gif, made when every frame is there; nothing: film.mp4 in the folder.
  std::optional<std::filesystem::path> video = {};
};

// These tables tell their fields, by name and in order, to whoever asks: f("frames", frames).

// How a film tells its motion.
struct FilmTime {
  double seconds = 0, motion_s = 0;  // of film, and of the motion that they show
  double left_out_s = 0;             // at the end, in which nothing is seen to move
  double slowest = 0, quickest = 0;  // of the motion's own speed
  template <class Fields>
  void fields(Fields& f) {
    std::array<double, 2> speed{slowest, quickest};
    f("seconds", seconds), f("motion_s", motion_s), f("left_out_s", left_out_s), f("speed", speed);
    slowest = speed[0], quickest = speed[1];
  }
};

struct RenderedFilm {
  std::int64_t frames = 0, wanted = 0, painted = 0, failed = 0;  // of the film; of them: asked for, …
  std::array<int, 2> size{};                                     // pixels
  std::string camera;
  std::vector<std::string> sets, passes;  // as they were asked for
  int bits = 8;
  FilmTime time;
  std::string trajectory_hash;
  double cpu_s = 0;
  std::filesystem::path folder;                      // of the frames
  std::optional<std::filesystem::path> film, sheet;  // where every frame is there
  // Where some lack: a film of before, and frames that show something else than this one's.
  std::optional<std::filesystem::path> old_film;
  int others = 0;
  // Those that manifest.json tells.
  template <class Fields>
  void fields(Fields& f) {
    f("frames", frames), f("wanted", wanted), f("painted", painted), f("failed", failed), f("size", size);
    f("camera", camera), f("sets", sets), f("passes", passes), f("bits", bits), f("time", time);
    f("trajectory_hash", trajectory_hash), f("cpu_s", cpu_s), f("folder", folder);
    f.if_there("film", film), f.if_there("sheet", sheet);
  }
};
// Paints the frames, and makes the film where ffmpeg is installed. A frame that fails does not stop the
// others. A film that shows these frames already is kept with `resume`, and where several that share the
// folder find all frames in place, one makes it. Throws InputError, DiskError, and Interrupted with the
// frames that are finished kept.
LIMBER_API RenderedFilm render_film(const std::filesystem::path& folder, const FilmOptions& = {},
                                    const Context& = {});

// Plans and films, as far as that is not done.
struct PlannedFilm {
  KeptPlan plan;
  RenderedFilm film;
};
LIMBER_API PlannedFilm plan_and_render(const PlanOptions&, const FilmOptions&, const Context& = {});

// The start of a scene, before any plan.
struct StillOptions {
  SceneSource scene = {};
  std::string camera = "main", size = {};         // as of FilmOptions
  std::optional<std::filesystem::path> out = {};  // a PNG; nothing: the scene's name.png
};
struct WrittenStill {
  std::filesystem::path file;
  std::pair<int, int> size_px;
};
// Throws InputError where `out` does not end in .png, and as render_film().
LIMBER_API WrittenStill paint_still(const StillOptions&, const Context& = {});

// One sheet of a scene before it is planned: what each camera sees at the start, at each goal and at the end,
// with the ways that are to be gone.
struct StoryboardOptions {
  SceneSource scene = {};
  std::string size = {};  // of one picture; empty: 640 pixels wide, of the film's shape
  std::optional<std::filesystem::path> out = {};  // a PNG; nothing: the scene's name-storyboard.png
};
struct WrittenStoryboard {
  std::filesystem::path file;
  std::pair<int, int> size_px;  // of the sheet
  std::vector<std::string> cameras, moments;
};
// Throws as paint_still().
LIMBER_API WrittenStoryboard paint_storyboard(const StoryboardOptions&, const Context& = {});

}  // namespace limber
