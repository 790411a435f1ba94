#include "limber/edits.h"

#include <sys/stat.h>

#include <algorithm>

#include "limber/detail/body/model_content.h"
#include "limber/detail/interface/working_for.h"
#include "scenes/library.h"
#include "scenes/scene.h"

namespace limber {

namespace {

std::vector<std::filesystem::path> files_of(const SceneSource& options) {
  std::vector<std::filesystem::path> files{scenes::find_scene(options.scene)};
  try {
    const scenes::Scene scene = scenes::read_scene_file(files.front(), options.sets);
    std::vector<std::filesystem::path> folders = options.data;
    folders.push_back(scene.folder);
    for (const auto* bodies : {&scene.bodies, &scene.scenery})
      for (const scenes::BodySpec& body : *bodies)
        if (const auto* model = std::get_if<scenes::FileModel>(&body.model))
          if (const auto file = scenes::find_model(model->file, folders)) {
            files.push_back(*file);
            for (const std::filesystem::path& named : detail::files_named_in(read_file(*file), *file))
              files.push_back(named);
          }
  } catch (const InputError&) {  // told when the picture is made
  }
  return files;
}

}  // namespace

std::vector<std::filesystem::path> files_shown(const SceneSource& scene, const Context& context) {
  return detail::working_for(context, [&] { return files_of(scene); });
}

std::vector<Stamp> stamps_of(const std::vector<std::filesystem::path>& files) {
  std::vector<Stamp> stamps;
  for (const std::filesystem::path& file : files) {
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

}  // namespace limber
