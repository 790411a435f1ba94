// From a scene to prepared bodies, and from those to the world that is stepped.
#pragma once

#include <vector>

#include "fem/world.h"
#include "limber/detail/body/body.h"
#include "limber/detail/world/fem_system.h"
#include "limber/scene.h"
#include "scenes/scene.h"

namespace limber::detail {

fs::path body_folder(const fs::path& work_folder, const scenes::BodySpec&);

// Prepares what is not up to date; meshes are in world coordinates, where the scene puts them. Bodies that
// are the same but for their place are made once. `data` are folders in which model files are looked for
// first; bodies are shared with those of `store`, where one is named. What is the same in the work folder
// `like`, where one is named, is copied from there.
std::vector<PreparedBody> prepare_bodies(const scenes::Scene&, const std::vector<fs::path>& data,
                                         const fs::path& work_folder, const fs::path& store = {},
                                         const fs::path& like = {});

// The same of some bodies, 0 ≤ body < bodies, or of what the scene has beside its bodies: the goal's shape
// and scenery.
std::vector<BodyReport> prepare_bodies_of(const scenes::Scene&, const std::vector<std::size_t>& bodies,
                                          const std::vector<fs::path>& data, const fs::path& work_folder,
                                          const fs::path& store = {}, const fs::path& like = {});
void prepare_beside(const scenes::Scene&, const std::vector<fs::path>& data, const fs::path& work_folder,
                    const fs::path& like = {});

// What prepare begins with. Throw InputError when the model is not found, or is none; scenery that is not
// found is empty, with a warning.
struct LoadedModel {
  std::string from;                  // a file's name, or words for a made model
  meshing::ImportedModel model;      // in world coordinates, where the scene puts it
  std::optional<TetMesh> made_cage;  // that of a body in cells
  Json input;                        // identity_of() the body
};
LoadedModel load_model(const scenes::Scene&, const scenes::BodySpec&, const std::vector<fs::path>& data);
SurfaceMesh load_scenery(const scenes::Scene&, const scenes::BodySpec&, const std::vector<fs::path>& data);

// Where goal.shape.cage is, which the scene has; nothing where it is not found.
std::optional<fs::path> find_goal_cage(const scenes::Scene&, std::vector<fs::path> data);

// As build_world takes it where contact goes by surfaces: that far they push each other.
double contact_offset_m(const scenes::Scene&, const Box& robot);
bool all_touched_at_cages(const scenes::Scene&);

// All that a body's files depend on, as its report has it under "input". Throws InputError when its model is
// not found.
Json identity_of(const scenes::Scene&, const scenes::BodySpec&, const std::vector<fs::path>& data);

// What a body's appearance is to its model's; plain where neither has one.
enum class Appearing { plain, not_here, same, another };

// What a scene says of a body that was prepared before.
struct Origin {
  bool placed_so = false;            // its report tells of the scene's pose, cage and settings
  std::optional<bool> same_surface;  // read and turned again; nothing where the model file is not here
  std::optional<TetMesh> made_cage;  // of a body in cells, in its own frame
  Appearing appearance = Appearing::plain;
};
Origin origin_of(const scenes::Scene&, const scenes::BodySpec&, const std::vector<fs::path>& data,
                 const PreparedBody& in_its_own_frame);
// The same of a body that limber prepare made by itself, of the model in `file`, read by the words that its
// report tells (scale, axes, label); placed_so: the file holds what it was made from. Throws InputError when
// the file cannot be read, or the body was made for a scene.
Origin origin_of_model(const PreparedBody&, const fs::path& file);
// The same of scenery. Throws InputError when its files are missing or damaged.
Origin origin_of_scenery(const scenes::Scene&, const scenes::BodySpec&, const std::vector<fs::path>& data,
                         const fs::path& work_folder);
// What the shape that the robot is to take is, to the scene's goal.shape.cage.
enum class GoalCage { none_asked, not_here, same, another };
GoalCage goal_cage_of(const scenes::Scene&, const std::vector<fs::path>& data,
                      const std::vector<PreparedBody>&);

// The scene's scenery, in world coordinates, from `scenery/` of the work folder, where prepare_bodies puts
// it. Throws InputError when a mesh is missing or damaged.
std::vector<SurfaceMesh> read_scenery(const scenes::Scene&, const fs::path& work_folder);

// Where the scene puts them. Throws InputError when a body is missing or damaged.
std::vector<PreparedBody> read_bodies(const scenes::Scene&, const fs::path& work_folder);

GoalRules goal_rules_of(const scenes::Scene&);

// By body name, of soft bodies that move.
std::map<std::string, double> stiffness_shares_of(const fem::World&);

// start_positions as fem::WorldSpec has them; stiffness_shares by body name, of bodies of which they are
// known.
fem::World build_world(const scenes::Scene&, const std::vector<PreparedBody>&,
                       const std::vector<float>& start_positions = {},
                       const std::map<std::string, double>& stiffness_shares = {});

// The same, with shares that take seconds to find kept in the folders of the bodies, and taken from there
// when all that they depend on is the same, or from a store of bodies, "" for none. Who judges a plan finds
// them himself.
fem::World build_world_in(const fs::path& work_folder, const fs::path& store, const scenes::Scene&,
                          const std::vector<PreparedBody>&, const std::vector<float>& start_positions = {});
// Of some bodies, 0 ≤ body < bodies, that are prepared there.
void keep_stiffness_shares(const scenes::Scene&, const std::vector<std::size_t>& bodies,
                           const fs::path& work_folder);

}  // namespace limber::detail
