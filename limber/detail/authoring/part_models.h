// Models of a body's parts, one a file, made of a segmented scan or of an atlas as it is shipped.
// docs/imaging.md
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "imaging/surface_nets.h"

namespace limber::detail {

struct PartSource {
  fs::path from;   // a label map; or a folder with an atlas' tables and element files
  fs::path names;  // of labels, a JSON file; empty: those that the label map has
  std::vector<std::string>
      only;  // these parts alone: names, label numbers, the atlas' ids; empty: all labels
  imaging::SurfaceNetOptions surfaces = {};  // of labels
};

struct PartModels {
  std::vector<std::string> names;  // NAME.ply each; millimetres, x to the left, y to the back, z up
  std::vector<std::string> notes;  // what was joined, united or not, left out, renamed
};

// A folder with BodyParts3D's tables of elements (isa_element_parts.txt, partof_element_parts.txt).
bool is_atlas(const fs::path&);

// Writes a model for each part into the folder, which must not be there; nothing stays of it where that
// fails. Several bones of a scan are one body, `skeleton`, but for those of the cage of the ribs, which are
// `ribcage`, unless `only` names them.
// Throws InputError: a part that is not there, a name twice, tables and files that do not fit.
PartModels make_part_models(const PartSource&, const fs::path& folder);

}  // namespace limber::detail
