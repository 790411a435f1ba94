// Films of work folders.
#pragma once

#include <fmt/format.h>

#include "core/json_fields.h"
#include "limber/detail/film/shot.h"
#include "limber/detail/plan/plan.h"
#include "limber/film.h"

namespace limber::detail {

struct RenderOptions : FilmOptions {
  fs::path folder;
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

// Plans and films, as far as that is not done.
PlannedFilm plan_and_film(const PlanOptions&, const FilmOptions&);

}  // namespace limber::detail
