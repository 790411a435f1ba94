// A body's folder: surface.ply, shells.obj, cage.msh, binding.npz, contact.npz, report.json; and, of a model
// with colors of its own, appearance.npz and images. See docs/files.md.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/appearance.h"
#include "core/contact_shape.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mesh.h"
#include "ffd/binding.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/contact_shape.h"
#include "meshing/decompose.h"
#include "meshing/import.h"
#include "scenes/scene.h"

namespace limber::app {

struct PrepareSettings {
  int shells = 32;
  double concavity = 0;
  double inflate = 0;
  bool exact = false;
  int tets = 1000;
  std::string mode = "lattice";  // "lattice", "fast", "paper", "conform"
};

// Where a body comes from. `identity` holds all that load() and made_cage() depend on: when it and the
// settings are those of the folder's report, the folder is up to date.
struct BodySource {
  std::string model;    // a file's name, or a word for a made model
  fs::path file = {};   // empty of a made model
  std::string warning;  // for whoever prepares it, not for whoever looks at it again; else empty
  Json identity;
  std::function<meshing::ImportedModel()> load;
  std::function<std::optional<TetMesh>()> made_cage = [] {
    return std::nullopt;
  };  // a box in cells brings its own
};

// What a body's report says it was made from: when that is the same, so is the body.
Json input_of(const Json& identity, const PrepareSettings&);

// The settings of such an input. Throws Json::exception where it is none.
PrepareSettings settings_of_input(const Json& input);

// A model as its body has it: its long edges cut so that it bends as the cage does, but for a body in cells;
// images that cannot be shown left out, with a warning.
void make_model_of_body(meshing::ImportedModel&, const PrepareSettings&);

// Whether the other files that the model of a report named are what they were, or are missing as they were.
bool has_its_companions(const fs::path& model_file, const Json& report);

// A body's shells, cage and contact, made from its surface and those before; `made_cage` is that of a body in
// cells.
struct MadeBody {
  meshing::Decomposition decomposition;
  meshing::Cage cage;
  ContactShape contact;
  meshing::ContactShapeReport contact_report;
};
meshing::Decomposition make_shells(const SurfaceMesh&, const PrepareSettings&);
meshing::Cage make_cage(const SurfaceMesh&, const std::vector<ConvexShell>&, const PrepareSettings&,
                        std::optional<TetMesh> made_cage);
// What a report tells of their making: tables within "shells", "cage" and "contact".
Json facts_of_making(const MadeBody&, const PrepareSettings&);

// Writes the files and returns the report; leaves a folder that is up to date as it is.
Json prepare_body(const BodySource&, const PrepareSettings&, const fs::path& folder);

struct PreparedBody {
  SurfaceMesh surface;
  Appearance appearance;  // empty: the scene's color for all
  TetMesh cage;
  std::vector<int> shell_from_tet;  // (T)
  ffd::Binding binding;
  ContactShape contact;
  NodeGradients gradients;  // of the cage
  scenes::Deformation deformation = scenes::Deformation::linear;
  Points goal_shape_m;  // of a robot whose scene has a goal.shape.cage: that cage's nodes; else empty
  Json report;
};
// What a report tells of the files beside it, worked out from these alone: tables within "surface", "shells",
// "cage", "certificate", "binding" and "contact".
Json facts_of_body(const SurfaceMesh&, const std::vector<ConvexShell>&, const TetMesh& cage,
                   const ffd::Binding&, const ContactShape&, const meshing::Certificate&);
Json facts_of_appearance(const Appearance&);  // a table within "appearance"; null where that is empty
// The names of the body's files, report.json apart.
std::vector<std::string> files_of_body(const Appearance&);

// Throws InputError naming the file and the command that renews it when one is missing, damaged, or of
// another body.
PreparedBody read_body(const fs::path& folder);

// Where the fine surface is (V × 3), overwritten, when the cage's nodes are there: the one answer of films,
// exports and reports.
void deform(const PreparedBody&, const Points& cage_positions, Points& surface_positions);
// The same of some vertices only, bound to the body's cage by `part`.
void deform(const PreparedBody&, const ffd::Binding& part, const Points& cage_positions,
            Points& surface_positions);

// The figures of a report as a few lines.
std::string summary_of_report(const Json& report);

}  // namespace limber::app
