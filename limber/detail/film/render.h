// Films of work folders.
#pragma once

#include <fmt/format.h>

#include <array>

#include "core/json_fields.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/plan/plan.h"

namespace limber::detail {

struct RenderOptions {
  fs::path folder;
  std::string frames;   // "1-30,47-327:2"; empty: all
  std::string chunk;    // "i/n"; empty: 1/1
  bool resume = false;  // keep the frames that already show what they should
  std::string size;     // "1920x1080"; empty: the scene's
  std::string camera = "main";
  std::vector<std::string> passes;  // of depth, normal, object, scalar
  int bits = 8;                     // a channel, 8 or 16
  std::vector<std::string> sets;    // of film, cameras and the looks of bodies
  // Names frames-NAME/, film-NAME.mp4 and sheet-NAME.png; empty: the camera's, and none for "main".
  std::string name;
  std::optional<fs::path> video;  // default film.mp4 in the folder, made when every frame is there
};

// What manifest.json tells of a film.
struct FilmTold {
  struct Time {
    double seconds = 0, motion_s = 0, left_out_s = 0;
    std::array<double, 2> speed{};  // slowest, quickest
    template <class Fields>
    void fields(Fields& f) {
      f("seconds", seconds), f("motion_s", motion_s), f("left_out_s", left_out_s), f("speed", speed);
    }
  };
  std::int64_t frames = 0, wanted = 0, painted = 0, failed = 0;
  std::array<int, 2> size{};
  std::string camera;
  std::vector<std::string> sets, passes;
  int bits = 8;
  Time time;
  std::string trajectory_hash;
  double cpu_s = 0;
  fs::path folder;
  std::optional<fs::path> film, sheet;
  template <class Fields>
  void fields(Fields& f) {
    f("frames", frames), f("wanted", wanted), f("painted", painted), f("failed", failed), f("size", size);
    f("camera", camera), f("sets", sets), f("passes", passes), f("bits", bits), f("time", time);
    f("trajectory_hash", trajectory_hash), f("cpu_s", cpu_s), f("folder", folder);
    f.if_there("film", film), f.if_there("sheet", sheet);
  }
};

struct RenderedFilm {
  int frames = 0;  // of the film
  std::size_t wanted = 0, painted = 0, failed = 0;
  std::pair<int, int> size_px;
  std::string camera;
  std::vector<std::string> sets, passes;  // as they were asked for
  int bits = 8;
  TimeTold time;
  std::string trajectory_hash;
  double cpu_s = 0;
  fs::path folder;                      // of the frames
  std::optional<fs::path> film, sheet;  // where every frame is there
  // Where some lack: a film of before, and frames that show something else than this one's.
  std::optional<fs::path> old_film;
  int others = 0;
};

// Where the pictures of a frame are: 0007.png, and of its passes 0007.depth.png and so on.
struct FrameFiles {
  fs::path folder;
  fs::path of(int frame, const std::string& pass = "") const {
    return folder / fmt::format("{:04}{}{}.png", frame, pass.empty() ? "" : ".", pass);
  }
};

// The texts of a frame's PNG, and of its passes': the hash of what it shows, and one of that and its pixels.
inline constexpr const char *hash_of_frame = "limber-hash", *hash_of_pixels = "limber-pixels";
std::string hash_of_shown(const std::string& frame_hash, const std::string& pixel_hash);

// What a film is made of: a folder's plan under the scene that it is filmed as, and the shot of it.
struct Filming {
  explicit Filming(const RenderOptions&);  // throws InputError
  Filming(const Filming&) = delete;
  Filming& operator=(const Filming&) = delete;
  bool is_good(int frame) const;        // its files are there, and say the hash of what they should show
  std::vector<fs::path> paths() const;  // of all frames
  fs::path video(const RenderOptions&) const;
  std::string film_hash(const fs::path& video) const;  // of what the film shows, when each frame is good
  render::Image8 sheet() const;                        // of frames that are there
  RenderedFilm told(const RenderOptions&) const;       // but for what was painted, and written

  std::string suffix;  // of its names in the folder
  FrameFiles files;
  Output output;
  PlanFolder planned;
  BodiesAndWorld of_plan;
  std::vector<SurfaceMesh> scenery;
  std::pair<int, int> size_px;
  std::optional<Shot> shot;
};

// Paints these frames on all threads, this one's with `painter`, which costs to be made (nullptr: makes one).
// Returns what failed, which does not stop the others. Throws DiskError.
struct FailedFrame {
  int frame;
  std::string why;
};
std::vector<FailedFrame> paint_frames(const Filming&, const std::vector<int>& frames,
                                      Shot::Painter* painter = nullptr);

// A frame that fails does not stop the others. A film that shows these frames already is kept with `resume`,
// and where several that share the folder find all frames in place, one makes it. Throws InputError,
// DiskError, and Interrupted with the frames that are finished kept.
RenderedFilm render(const RenderOptions&);
FilmTold told_of(const RenderedFilm&);

// Plans and films, as far as that is not done.
struct PlannedFilm {
  KeptPlan plan;
  RenderedFilm film;
};
PlannedFilm plan_and_film(const PlanOptions&, RenderOptions);

}  // namespace limber::detail
