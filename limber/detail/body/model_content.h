// What a model file holds, and the files that it names: .bin of a .gltf, objects of a scene, materials of an
// OBJ and the images that these name. A body made of it depends on all.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"

namespace limber::detail {

// Files in the model's folder and below it whose names stand in its bytes, as they are, %-encoded, or with a
// path of another machine before them. Ordered, each once.
std::vector<fs::path> files_named_in(std::string_view bytes, const fs::path& model);

struct ModelContent {
  std::string file_hash;  // 16 digits; that of the file alone where it names none that is there
  std::string content;    // 32 digits, of all bytes that count
  std::string ending;     // ".obj", in lower case: files are read by it too
};
// Throws InputError when the model cannot be read.
ModelContent content_of_model(const fs::path&);

}  // namespace limber::detail
