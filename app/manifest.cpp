#include "app/manifest.h"

#include "core/error.h"
#include "core/version.h"

namespace limber::app {

void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry) {
  const fs::path file = folder / "manifest.json";
  Json manifest;
  try {
    if (fs::exists(file)) manifest = read_json(file);
  } catch (const InputError&) {
    // A damaged manifest holds nothing that the other files do not.
  }
  if (!manifest.is_object()) manifest = Json::object();
  manifest["version"] = version;
  manifest[stage] = entry;
  write_json(file, manifest);
}

}  // namespace limber::app
