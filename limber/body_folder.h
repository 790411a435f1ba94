// A model prepared in a folder of its own, as `limber prepare` does, and what is made of that folder.
// docs/files.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "limber/mesh.h"

namespace limber {

// What ends in -interior is of the cage without tets that have all four nodes on the boundary.
inline const std::vector<std::string> export_formats{
    "vtu",          "node",         "interp",        "vtk",           "inp",
    "msh",          "urdf",         "sdf",           "mjcf",          "usd",
    "usd-omni",     "sofa",         "vtu-interior",  "node-interior", "vtk-interior",
    "inp-interior", "msh-interior", "mjcf-interior", "usd-interior",  "usd-omni-interior",
    "sofa-interior"};

// Which model, how it is read, what is made of it, and where.
struct ModelOptions : PrepareOptions, ImportOptions {
  std::filesystem::path model, out;
  std::filesystem::path bytes;       // the file that is read where that is not `model`, by which it is named
  bool preview = false;              // pictures beside the files
  bool picture = false;              // a small one
  std::vector<std::string> exports;  // of export_formats
  double density_kg_m3 = 1000;       // of their masses
  // "shells": no cage, binding and contact; "cage": no shells (but in mode paper, which makes it of them),
  // binding and contact. Such a folder is no body to plan with.
  std::string only;
  std::filesystem::path store;  // of bodies; empty: none, or, of many models, store in `out`
  std::string label;            // of a label map (NIfTI, NRRD): a number or a name
  double label_gap = 0.2;       // between surfaces of labels, share of the shortest voxel edge, 0 … 0.6
  int label_rounds = 10;        // in which a surface is smoothed
  double min_island = 8;        // voxels; smaller pieces are left out

  // Tells what shapes a body and what is written beside it, by the names of the command's options, to whoever
  // asks: f("tets", tets).
  template <class Fields>
  void fields(Fields& f) {
    f("shells", shells), f("concavity", concavity), f("inflate", inflate), f("threshold", threshold);
    f("exact", exact), f("shell_corners", max_hull_vertices), f("tets", tets), f("mode", mode);
    f("scale", scale), f("y_up", y_up), f("preview", preview), f("export", exports);
    f("density", density_kg_m3), f("only", only), f("label", label), f("label_gap", label_gap);
    f("label_smoothing", label_rounds), f("least_island", min_island);
  }
};
// Throws InputError where two of them exclude each other.
LIMBER_API void require_agreeing(const ModelOptions&);

struct PreparedFolder {
  std::string report_json;                // report.json with what this call cost
  std::vector<std::string> also_written;  // names of pictures and exports
};
// A folder that is up to date is left as it is. Throws InputError where the model cannot be read or is none,
// DiskError.
LIMBER_API PreparedFolder prepare_folder(const ModelOptions&, const Context& = {});

struct BodyExportOptions {
  std::filesystem::path folder = {};              // of a whole body
  std::vector<std::string> formats = {};          // of export_formats
  std::optional<std::filesystem::path> out = {};  // nothing: the folder itself
  double density_kg_m3 = 1000;
};
struct ExportedBody {
  std::filesystem::path folder;
  std::vector<std::string> files;  // in it
};
// Throws InputError where the folder holds no whole body, DiskError.
LIMBER_API ExportedBody export_body(const BodyExportOptions&, const Context& = {});

}  // namespace limber
