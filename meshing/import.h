// Brings in a user's model: any format, mended as far as that needs no guess, with an account of what was
// found and done. The surface stays the user's own: no vertex is moved, no hole filled, nothing remeshed.
// docs/import.md
#pragma once

#include "core/appearance.h"
#include "meshing/defects.h"

namespace limber::meshing {

struct ImportOptions {
  double scale = 1;                      // file units → metres, > 0
  bool y_up = false;                     // turn +Y up into +Z up: (x y z) → (x −z y)
  double weld_tolerance = 1e-8;          // of the bounding box's diagonal; 0: only equal coordinates
  bool count_self_intersections = true;  // most of the time of an import
};

struct ImportedModel {
  SurfaceMesh surface;                // validate() holds; welded, oriented, no duplicate or degenerate face
  Appearance appearance;              // of `surface`, as the file has it; its images are not looked into here
  Defects found;                      // in the file, before mending; vertex numbers are the file's, from 0
  Defects left;                       // in `surface`
  std::vector<std::string> mended;    // what was done, as sentences
  std::vector<std::string> warnings;  // what the user should know: left out, left as it is, looks wrong
};

// OBJ, OFF, PLY and STL by our own readers, in double precision; all else by assimp. What a file is, its
// content says. Throws InputError when there is no such file, it cannot be read, is cut short, names vertices
// that are not there, holds no triangle with an area, or when more than half of its faces have infinite
// corners.
ImportedModel import_model(const fs::path&, const ImportOptions& = {});

// Endings, lower case with their dot and ordered, of the files that may be models: ".3ds", …, ".obj", ….
const std::vector<std::string>& model_endings();

// The same for a mesh made in memory; `what` is its name in messages.
ImportedModel clean(const SurfaceMesh& raw, const ImportOptions& = {}, const std::string& what = "mesh");

// {"found": …, "left": …, "mended": […], "warnings": […]}
Json to_json(const ImportedModel&);

}  // namespace limber::meshing
