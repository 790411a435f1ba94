#include "limber/detail/plan/manifest.h"

#include <unistd.h>

#include "core/error.h"
#include "core/json_shape.h"
#include "core/log.h"
#include "core/version.h"

namespace limber::detail {

Json read_manifest(const fs::path& folder) {
  const fs::path file = folder / "manifest.json";
  Json manifest = Json::object();
  if (!fs::exists(file)) return manifest;
  try {
    manifest = read_json(file);
  } catch (const InputError& error) {
    log::warn("{}; nothing is taken from it", error.what());
    return Json::object();
  }
  const char* const remedy = "remove the file, which limber makes anew";
  require_like(manifest, Json::object(), Keys::all, file.string(), remedy);
  const Json hashes{{"trajectory_hash", ""}, {"tree_hash", ""}, {"cpu_s", 0.5}};
  for (const auto& [stage, entry] : manifest.items())
    if (stage != "version")
      require_like(entry, hashes, Keys::those_there, fmt::format("{}: {}", file.string(), stage), remedy);
  return manifest;
}

bool can_update_manifest(const fs::path& folder) { return ::access(folder.c_str(), W_OK) == 0; }

void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry) {
  Json manifest = read_manifest(folder);
  manifest["version"] = version;
  manifest[stage] = entry;
  write_json(folder / "manifest.json", manifest);
}

}  // namespace limber::detail
