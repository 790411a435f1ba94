#include "app/manifest.h"

#include "core/error.h"
#include "core/version.h"

namespace limber::app {

Json read_manifest(const fs::path& folder) {
  const fs::path file = folder / "manifest.json";
  try {
    const Json manifest = fs::exists(file) ? read_json(file) : Json();
    if (manifest.is_object()) return manifest;
  } catch (const InputError&) {
  }
  return Json::object();
}

void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry) {
  Json manifest = read_manifest(folder);
  manifest["version"] = version;
  manifest[stage] = entry;
  write_json(folder / "manifest.json", manifest);
}

}  // namespace limber::app
