// A body's folder: surface.ply, shells.obj, cage.msh, binding.npz, contact.npz, report.json; and, of a model
// with colors of its own, appearance.npz and images. See docs/files.md.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/appearance.h"
#include "core/contact_shape.h"
#include "core/file.h"
#include "core/mesh.h"
#include "ffd/binding.h"
#include "limber/detail/body/body_report.h"
#include "meshing/cage.h"
#include "meshing/certificate.h"
#include "meshing/contact_shape.h"
#include "meshing/decompose.h"
#include "meshing/import.h"
#include "scenes/scene.h"

namespace limber::detail {

// Where a body comes from. `identity` holds all that load() and made_cage() depend on: when it and the
// settings are those of the folder's report, the folder is up to date.
struct BodySource {
  std::string model;    // a file's name, or a word for a made model
  std::string warning;  // for whoever prepares it, not for whoever looks at it again; else empty
  Json identity;
  std::string content,
      ending = {};  // of a model's file: 32 digits (limber/detail/body/model_content.h); ".obj" in lower case
  std::function<meshing::ImportedModel()> load;
  std::function<std::optional<TetMesh>()> made_cage = [] {
    return std::nullopt;
  };  // a box in cells brings its own
};

// What a body's report says it was made from: when that is the same, so is the body.
Json input_of(const Json& identity, const PrepareSettings&);

// A model as its body has it: its long edges cut so that it bends as the cage does, but for a body in cells;
// images that cannot be shown left out, with a warning.
// Leaves out images that cannot be decoded, are too large together, or are no normals though they should be.
void look_into_images(Appearance&, std::vector<std::string>& warnings);

void make_model_of_body(meshing::ImportedModel&, const PrepareSettings&);

// A body's shells, cage and contact, made from its surface and those before; `made_cage` is that of a body in
// cells.
struct MadeBody {
  meshing::Decomposition decomposition;
  meshing::Cage cage;
  ContactShape contact;
  meshing::ContactShapeReport contact_report;
};
// The bound on their overshoot, share of the diagonal; 0: none.
double concavity_of(const SurfaceMesh&, const PrepareSettings&);
meshing::Decomposition make_shells(const SurfaceMesh&, const PrepareSettings&);
meshing::Cage make_cage(const SurfaceMesh&, const std::vector<ConvexShell>&, const PrepareSettings&,
                        std::optional<TetMesh> made_cage);
// What a report tells of their making: tables within "shells", "cage" and "contact".
Json facts_of_making(const MadeBody&, const PrepareSettings&);

// All that is made of a model, in memory.
struct WholeBody {
  meshing::ImportedModel model;  // its long edges cut
  MadeBody made;
  meshing::Certificate certificate;
  ffd::Binding binding;
};
// `end_stage` hears "import", "decompose", "cage", "certify", "bind", "contact" as each ends. Throws
// InputError where the model is none.
WholeBody make_body(const BodySource&, const PrepareSettings&,
                    const std::function<void(const char*)>& end_stage);
std::vector<std::string> warnings_of(const WholeBody&);
// What a report tells of it, but for costs and files.
Json report_of(const WholeBody&, const BodySource&, const PrepareSettings&);

// Its files, and last its report, which is returned: of no costs. Nobody else writes into the folder, which
// is there.
BodyReport write_body(const WholeBody&, const BodySource&, const PrepareSettings&, const fs::path& folder);

// The report of a folder that holds what `input` makes, whole; else nothing.
std::optional<BodyReport> up_to_date_report(const fs::path& folder, const Json& input);
// Removes all that limber writes of a body, first its report.
void clear_body(const fs::path& folder);

class BodyStore;
// Writes the files and returns the report; leaves a folder that is up to date as it is. What is in the store
// is taken from there, what is not is kept there; reports of such folders tell no costs, the one that is
// returned does. Costs are the process': where it is not alone with this body, none are told.
// What is whole and the same in the folder `like`, of another body, is copied.
struct PrepareAid {
  const BodyStore* store = nullptr;
  fs::path like = {};
  bool is_alone = true;
};
BodyReport prepare_body(const BodySource&, const PrepareSettings&, const fs::path& folder,
                        const PrepareAid& = {});

struct PreparedBody {
  SurfaceMesh surface;
  Appearance appearance;  // empty: the scene's color for all
  TetMesh cage;
  std::vector<int> shell_from_tet;  // (T)
  ffd::Binding binding;
  ContactShape contact;
  NodeGradients gradients;  // of the cage
  scenes::Deformation deformation = scenes::Deformation::linear;
  Points goal_shape_m;          // of a robot whose scene has a goal.shape.cage: that cage's nodes; else empty
  Vec3 place_m = Vec3::Zero();  // so far all this is moved from where the files have it
  Points own_cage_m;            // the cage's nodes as its file has them; empty: as `cage` does
  double filled = 0;            // filled_share() as the files have it; 0: not moved
  BodyReport report;
};
// Moves a body that is where its files have it.
void place(PreparedBody&, const Vec3& place_m);
// How much of its cage a body's model fills, at most 1; 1 where the model is not closed.
double filled_share(const PreparedBody&);
// Leaves out what is told of files that are not made.
void keep_made(Json& told, const PrepareSettings&);
// What a report tells of the files beside it, worked out from these alone: tables within "surface", "shells",
// "cage", "certificate", "binding" and "contact".
Json facts_of_body(const SurfaceMesh&, const std::vector<ConvexShell>&, const TetMesh& cage,
                   const ffd::Binding&, const ContactShape&, const meshing::Certificate&);
Json facts_of_appearance(const Appearance&);  // a table within "appearance"; null where that is empty
// The names of the body's files, report.json apart.
std::vector<std::string> files_of_body(const PrepareSettings&, const Appearance&);

// In the body's own frame. Throws InputError naming the file and the command that renews it when one is
// missing, damaged, or of another body.
PreparedBody read_body(const fs::path& folder);
// Also of a folder that was made with --only: what was not made is empty.
PreparedBody read_made(const fs::path& folder);

// Where the fine surface is (V × 3), overwritten, when the cage's nodes are there: the one answer of films,
// exports and reports.
void deform(const PreparedBody&, const Points& cage_positions, Points& surface_positions);
// The same of some vertices only, bound to the body's cage by `part`.
void deform(const PreparedBody&, const ffd::Binding& part, const Points& cage_positions,
            Points& surface_positions);

}  // namespace limber::detail
