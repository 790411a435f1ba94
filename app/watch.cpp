#include "app/watch.h"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "app/commands.h"
#include "app/model_content.h"
#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "scenes/library.h"
#include "scenes/scene.h"

namespace limber::app {

namespace {

constexpr std::chrono::milliseconds between_looks{200};

// The scene, its models and what these name; of a scene that cannot be read the scene alone.
std::vector<fs::path> files_of(const SceneOptions& options) {
  std::vector<fs::path> files{scenes::find_scene(options.scene)};
  try {
    const scenes::Scene scene = scenes::read_scene_file(files.front(), options.sets);
    std::vector<fs::path> folders = options.data;
    folders.push_back(scene.folder);
    for (const auto* bodies : {&scene.bodies, &scene.scenery})
      for (const scenes::BodySpec& body : *bodies)
        if (const auto* model = std::get_if<scenes::FileModel>(&body.model))
          if (const auto file = scenes::find_model(model->file, folders)) {
            files.push_back(*file);
            for (const fs::path& named : files_named_in(read_file(*file), *file)) files.push_back(named);
          }
  } catch (const InputError&) {  // told when the picture is made
  }
  return files;
}

}  // namespace

std::vector<Stamp> stamps_of(const std::vector<fs::path>& files) {
  std::vector<Stamp> stamps;
  for (const fs::path& file : files) {
    struct stat found = {};
    if (::stat(file.c_str(), &found) == 0)
      stamps.push_back(
          {std::int64_t(found.st_size), found.st_mtim.tv_sec * 1'000'000'000 + found.st_mtim.tv_nsec});
    else
      stamps.emplace_back();
  }
  return stamps;
}

bool Edits::are_done(const std::vector<Stamp>& now) {
  const bool at_rest = now == last_;
  last_ = now;
  if (!at_rest || now == read_ || std::find(now.begin(), now.end(), Stamp()) != now.end()) return false;
  read_ = now;
  return true;
}

Outcome watch_still(StillOptions options) {
  options.scene.scene = scenes::find_scene(options.scene.scene).string();
  for (;;) {
    const std::vector<fs::path> files = files_of(options.scene);
    Edits edits(stamps_of(files));
    try {
      fmt::print("{}", render_still(options).text);
      std::fflush(stdout);
    } catch (const InputError& error) {
      log::warn("{}", error.what());
    }
    do {
      throw_if_stopped();
      std::this_thread::sleep_for(between_looks);
    } while (!edits.are_done(stamps_of(files)));
  }
}

}  // namespace limber::app
