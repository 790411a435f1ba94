// What is in a file or folder, and which scenes come with limber.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "limber/error.h"
#include "limber/export.h"
#include "limber/watcher.h"

namespace limber {

struct FileFacts {
  enum Kind { scene, body, label_map, other } kind = other;
  // The text of a JSON document; of a plan its summary, of a body its report with a list of its shells.
  std::string json;
};
// Throws InputError where nothing is there, or nothing that limber reads.
LIMBER_API FileFacts facts_of_file(const std::filesystem::path&, const Context& = {});

struct KnownScene {
  std::string name;
  std::filesystem::path file;
  std::string description;
};
LIMBER_API std::vector<KnownScene> known_scenes();

}  // namespace limber
