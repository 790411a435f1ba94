#include "limber/info.h"

#include "limber/detail/inspect/file_facts.h"
#include "limber/detail/interface/working_for.h"
#include "scenes/library.h"
#include "scenes/scene.h"

namespace limber {

FileFacts facts_of_file(const std::filesystem::path& path, const Context& context) {
  return detail::working_for(context, [&] { return detail::facts_of_file(path); });
}

std::vector<KnownScene> known_scenes() {
  std::vector<KnownScene> all;
  for (const scenes::KnownScene& known : scenes::known_scenes())
    all.push_back({known.name, known.file, scenes::read_scene_file(known.file).description});
  return all;
}

}  // namespace limber
