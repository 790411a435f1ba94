#include "scenes/library.h"

#include <dlfcn.h>
#include <fmt/ranges.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>

#include "core/error.h"
#include "scenes/detail/schema.h"

namespace limber::scenes {

namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}
bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

// Of the program, or of the library that a program has loaded.
fs::path folder_of_this_code() {
  Dl_info info;
  link_map* map = nullptr;
  const void* here = reinterpret_cast<const void*>(&folder_of_this_code);
  if (dladdr1(here, &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) == 0) return {};
  const bool in_program = map->l_name[0] == '\0';  // whose own name is as it was called
  std::error_code failed;
  const fs::path file = fs::canonical(in_program ? "/proc/self/exe" : map->l_name, failed);
  return failed ? fs::path() : file.parent_path();
}

}  // namespace

std::vector<fs::path> scene_folders() {
  std::vector<fs::path> candidates;
  std::string listed = environment("LIMBER_SCENES");
  while (!listed.empty()) {
    const auto colon = std::min(listed.find(':'), listed.size());
    if (colon > 0) candidates.emplace_back(listed.substr(0, colon));
    listed.erase(0, colon + 1);
  }
  // bin/limber, lib/x86_64-linux-gnu/liblimber.so
  for (fs::path above = folder_of_this_code(); above.has_relative_path(); above = above.parent_path())
    candidates.push_back(above / "share" / "limber" / "scenes");
  candidates.emplace_back(LIMBER_SCENES_SOURCE);
  std::vector<fs::path> folders;
  for (const fs::path& folder : candidates)
    if (is_folder(folder)) folders.push_back(folder.lexically_normal());
  return folders;
}

std::vector<KnownScene> known_scenes() {
  std::vector<KnownScene> known;
  for (const fs::path& folder : scene_folders()) {
    std::error_code failed;
    for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
      const std::string name = at->path().filename().string();
      const bool seen =
          std::any_of(known.begin(), known.end(), [&](const KnownScene& k) { return k.name == name; });
      if (!seen && is_file(at->path() / "scene.toml")) known.push_back({name, at->path() / "scene.toml"});
    }
  }
  std::sort(known.begin(), known.end(),
            [](const KnownScene& a, const KnownScene& b) { return a.name < b.name; });
  return known;
}

fs::path find_scene(const std::string& name_or_path) {
  if (is_file(name_or_path)) return name_or_path;
  if (is_folder(name_or_path) && is_file(fs::path(name_or_path) / "scene.toml"))
    return fs::path(name_or_path) / "scene.toml";
  std::vector<std::string> names;
  for (const KnownScene& scene : known_scenes()) {
    if (scene.name == name_or_path) return scene.file;
    names.push_back(scene.name);
  }
  const std::string meant = nearest(name_or_path, names);
  std::error_code unseen;  // what cannot be asked about is not there
  const std::string wrong =
      name_or_path.empty()      ? "no scene is named"
      : is_folder(name_or_path) ? name_or_path + ": a folder without a scene.toml; name the scene's file"
      : fs::exists(name_or_path, unseen) ? name_or_path + ": no regular file, as a scene is"
                                         : name_or_path + ": no such scene file, and no scene of that name";
  throw InputError(fmt::format("{}; {}known scenes: {}", wrong,
                               meant.empty() ? "" : fmt::format("did you mean \"{}\"? ", meant),
                               names.empty() ? "none (set LIMBER_SCENES to their folder)"
                                             : fmt::format("{}", fmt::join(names, ", "))));
}

fs::path model_cache() {
  if (const std::string own = environment("LIMBER_MODELS"); !own.empty()) return own;
  const std::string cache = environment("XDG_CACHE_HOME");
  return (cache.empty() ? fs::path(environment("HOME")) / ".cache" : fs::path(cache)) / "limber" / "models";
}

std::optional<fs::path> find_model(const std::string& file, const std::vector<fs::path>& folders) {
  if (fs::path(file).is_absolute()) return is_file(file) ? std::optional<fs::path>(file) : std::nullopt;
  for (const fs::path& folder : folders)
    if (is_file(folder / file)) return folder / file;
  if (is_file(model_cache() / file)) return model_cache() / file;
  return std::nullopt;
}

std::string how_to_get_model(const std::string& file, const std::vector<fs::path>& folders) {
  std::vector<std::string> searched;
  for (const fs::path& folder : folders)
    searched.push_back(folder.empty() ? "the folder of the scene" : folder.string());
  searched.push_back(model_cache().string());
  std::error_code unseen;
  for (const fs::path& folder : folders)
    if (const fs::path there = folder / file; fs::exists(there, unseen))
      return fmt::format("model {}: {} is {}; name a model's file", file, there.string(),
                         is_folder(there) ? "a folder" : "no regular file");
  std::string text = fmt::format("model {} was not found in {}", file, fmt::join(searched, ", "));
  for (const fs::path& folder : folders)
    if (is_file(folder / "setup"))
      return text + fmt::format("; run {} to fetch it", (folder / "setup").string());
  return text + "; put it into one of these folders";
}

}  // namespace limber::scenes
