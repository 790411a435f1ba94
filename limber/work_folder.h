// What is done with a motion in its work folder (Plan::save, limber/motion.h, or the command's -o).
// docs/verify.md, docs/files.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "limber/scene.h"

namespace limber {

struct Promise {
  std::string name, value;
  bool kept = false;
};
// Every promise that limber makes of a work folder, a body's folder or one of many models (a row for each),
// checked anew from its files: replayed, searched again (which takes as long as the search did), measured.
// `scene`: a file or name of the one that the plan must be of, without edits but those that change nothing;
// empty: its own word is taken. Throws InputError where it is no such folder.
LIMBER_API std::vector<Promise> verify(const std::filesystem::path& folder, const std::string& scene = {},
                                       const Context& = {});
// The same with the scene that the plan must be of: edits, preset and folders of models as it was read with.
// All keys must have the same values.
LIMBER_API std::vector<Promise> verify(const std::filesystem::path& folder, const Scene&,
                                       const Context& = {});

// What no promise is made of.
struct Finding {
  std::string what, value;
};

struct VerifyOptions {
  std::filesystem::path folder = {};
  std::optional<std::filesystem::path> model = {};  // of a body's folder: the one that it must be of
  // Of a work folder: also a CSV with the figures of every frame.
  std::optional<std::filesystem::path> observables = {};
  SceneSource scene = {};  // the one that the plan must be of; none where its `scene` is empty
  bool remake = false;     // of large bodies shells are made again, too
  bool film = false;       // films, too
  int repaint = 5;         // frames of each that are painted again
};

struct Verdict {
  bool all_kept = true;
  std::vector<Promise> promises;
  std::vector<Finding> measured;
  // Figures of the replayed motion, the text of a JSON object (docs/files.md); empty of a body, and of a plan
  // that cannot be replayed.
  std::string motion_json;
  // What scene it is that all is derived from; likewise.
  struct Scene {
    std::string name, text_hash;
    std::vector<std::string> sets;
  };
  std::optional<Scene> scene;
};
// The same with all that can be asked. Throws InputError where the folder is none of these.
LIMBER_API Verdict verify(const VerifyOptions&, const Context& = {});

// Of a body's folder: also that it is of this model, read again with the scale, axes and label that the body
// tells.
LIMBER_API std::vector<Promise> verify_body(const std::filesystem::path& folder,
                                            const std::filesystem::path& model, const Context& = {});

inline const std::vector<std::string> motion_formats{"gltf", "pc2", "usd", "vtu"};

struct ExportOptions {
  std::filesystem::path folder = {};
  std::vector<std::string> formats = {};          // of motion_formats
  std::optional<std::filesystem::path> out = {};  // default: export in the folder
  std::string frames = {};                        // as of FilmOptions
};

// Tells its fields, by name and in order, to whoever asks, as ExportedMotion does: f("files", files).
struct WrittenFiles {
  std::filesystem::path open;  // the one to open
  int files = 0;               // how many there are
  std::uintmax_t bytes = 0;
  template <class Fields>
  void fields(Fields& f) {
    f("open", open), f("files", files), f("bytes", bytes);
  }
};

struct ExportedMotion {
  std::vector<int> frames;  // those of the motion that were wanted
  int frames_of_motion = 0;
  std::string trajectory_hash;
  std::filesystem::path folder;
  // By name: how each bends, "linear" or "phong".
  std::vector<std::pair<std::string, std::string>> bodies = {};
  std::vector<std::pair<std::string, WrittenFiles>> formats = {};  // by name
  // As manifest.json has them.
  template <class Fields>
  void fields(Fields& f) {
    std::uint64_t count = frames.size();
    f("frames", count), f("frame_list", frames), f("trajectory_hash", trajectory_hash), f("folder", folder);
    f("deformation", bodies), f("formats", formats);
  }
};
// Throws InputError, DiskError.
LIMBER_API ExportedMotion export_motion(const ExportOptions&, const Context& = {});
// formats: of motion_formats. Of each the file to open; there may be more beside it.
LIMBER_API std::vector<std::filesystem::path> export_motion(const std::filesystem::path& folder,
                                                            const std::vector<std::string>& formats,
                                                            const std::filesystem::path& out = {},
                                                            const Context& = {});

enum class FilmInPage { none, embedded, of_another_plan, too_large };

struct WrittenReport {
  std::filesystem::path file;
  std::size_t bytes = 0;
  FilmInPage film = FilmInPage::none;
  bool all_kept = false;  // promises, checked anew
};
// One page in HTML that needs nothing else; nothing: report.html in the folder. Verifies, and takes as long.
// Throws as verify() does, or DiskError.
LIMBER_API WrittenReport write_report(const std::filesystem::path& folder,
                                      const std::optional<std::filesystem::path>& file = {},
                                      const Context& = {});

LIMBER_API std::string library_version();

}  // namespace limber
