// What is in a file or folder.
#pragma once

#include <string>
#include <vector>

#include "core/json.h"

namespace limber::detail {

struct FileFacts {
  enum Kind { scene, body, label_map, other } kind = other;
  Json facts;  // of a plan its summary, of a body its report with a list of its shells
};
// Throws InputError where nothing is there, or nothing that limber reads.
FileFacts facts_of_file(const fs::path&);

// The scenes that come with limber.
struct KnownSceneFacts {
  std::string name;
  fs::path file;
  std::string description;
};
std::vector<KnownSceneFacts> facts_of_known_scenes();

}  // namespace limber::detail
