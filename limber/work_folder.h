// What is done with a planned motion in its work folder (Plan::save, or the command's -o). docs/library.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "limber/error.h"
#include "limber/export.h"
#include "limber/watcher.h"

namespace limber {

struct Promise {
  std::string name, value;
  bool kept = false;
};
// Every promise that limber makes of a work folder or a body's folder, checked anew from its files: replayed,
// searched again, measured. `scene`: a file or name of the one that the plan must be of; empty: its own word
// is taken. Throws InputError where it is no such folder.
LIMBER_API std::vector<Promise> verify(const std::filesystem::path& folder, const std::string& scene = {},
                                       const Context& = {});
// Of a body's folder: also that it is of this model, read again with the scale, axes and label that the body
// tells.
LIMBER_API std::vector<Promise> verify_body(const std::filesystem::path& folder,
                                            const std::filesystem::path& model, const Context& = {});

struct FilmOptions {
  int width = 0, height = 0;  // pixels; 0: the scene's
  std::string frames = {};    // "0-30,47-327:2"; empty: all
  std::string camera = "main";
  std::string name = {};               // of the film, as --as
  std::vector<std::string> sets = {};  // of film, cameras and looks
  std::filesystem::path video = {};    // .mp4, .webm or .gif; empty: film.mp4 in the folder
  bool resume = false;                 // frames that are right already are kept
};
struct Film {
  std::filesystem::path video;  // empty where not every frame is there
  int frames_painted = 0, frames_failed = 0;
};
// Paints the frames, and the film where ffmpeg is installed. Throws InputError, DiskError.
LIMBER_API Film render_film(const std::filesystem::path& folder, const FilmOptions& = {},
                            const Context& = {});

// formats: of "gltf", "pc2", "usd", "vtu". Of each the file to open; there may be more beside it.
LIMBER_API std::vector<std::filesystem::path> export_motion(const std::filesystem::path& folder,
                                                            const std::vector<std::string>& formats,
                                                            const std::filesystem::path& out = {},
                                                            const Context& = {});
// One HTML page; empty: report.html in the folder. The file that was written.
LIMBER_API std::filesystem::path write_report(const std::filesystem::path& folder,
                                              const std::filesystem::path& file = {}, const Context& = {});

LIMBER_API std::string library_version();

}  // namespace limber
