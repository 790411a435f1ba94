// What a scene's bodies and scenery are made from: the model, how the scene turns it, and all that a change
// of which makes the meshes anew. Bodies are made in their own frame, with the anchor at 0, so that those
// which are the same but for position_m are made once. Private to what prepares bodies (scene_world.cpp) and
// what compares them with their scene (origin.cpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "limber/detail/body/body_store.h"
#include "scenes/scene.h"

namespace limber::detail {

// The lines of the scene that shape a body's meshes, as the user's text has them once more: a change of any
// makes them anew.
Json identity_of(const scenes::BodySpec&, const std::string& model_hash);
// The same of scenery, whose mesh is in world coordinates.
Json identity_of_scenery(const scenes::BodySpec&, Json identity);
// The hash in such an identity; nothing where it is none.
std::optional<std::string> model_hash_in(const Json& identity);
// In place of a file's hash, of a model that limber makes.
std::string hash_of_made(const SurfaceMesh& made, const Appearance&);

// In the body's own frame. `body` must outlive what is returned. Throws InputError when its file is not found
// and no made model may take its place.
BodySource source_of(const scenes::Scene&, const scenes::BodySpec& body, std::vector<fs::path> folders);
PrepareSettings settings_of(const scenes::BodySpec&);

// scenery/NAME.ply or .json.
fs::path scenery_file(const fs::path& work_folder, const scenes::BodySpec&, const char* extension);
// A model that is not found loads an empty mesh: without scenery a scene is still what it is.
BodySource source_of_scenery(const scenes::Scene&, const scenes::BodySpec&,
                             const std::vector<fs::path>& data);
SurfaceMesh make_scenery(const scenes::BodySpec&, const BodySource&);
// NAME.json of scenery: where its mesh comes from.
struct SceneryOrigin {
  std::string version;              // of the limber that wrote it
  Json input;                       // the identity of its source
  std::optional<std::string> hash;  // of its mesh's file; null where no model was found
  template <class Fields>
  void fields(Fields& f) {
    f("version", version), f("input", input), f("hash", hash);
  }
};
bool was_found(const Json& identity);  // the model of scenery
std::optional<std::string> hash_of_scenery(const fs::path& mesh, const Json& identity);

// A copy of goal.shape.cage lies in the robot's folder: a scene that is read from a plan knows no folder.
fs::path goal_cage_file(const scenes::Scene&, const fs::path& work_folder);
bool has_goal_cage(const scenes::Scene&);

}  // namespace limber::detail
