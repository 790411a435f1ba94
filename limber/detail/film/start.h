// The start of a scene, before there is a plan: what a check looks at and a still shows.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "limber/detail/world/scene_world.h"
#include "limber/film.h"

namespace limber::detail {

struct Start {
  scenes::Scene scene;  // as it is painted: of one moment, so without paths, trees and forces
  std::vector<PreparedBody> bodies;
  std::vector<SurfaceMesh> scenery;
  fem::World world;
  // Where false, bodies are not prepared: each fine surface hangs on its own cage of cells or on a box round
  // it, nothing touches, and the walls are away.
  bool prepared;
  // The time step of `world` is the one that the scene is planned with.
  bool step_known;
};

// From the bodies that are in the work folder. Throws as read_bodies and build_world.
Start prepared_start(const scenes::Scene&, const fs::path& work_folder);
// From the models as they are loaded, one for each body of the scene.
Start loaded_start(const scenes::Scene&, const std::vector<LoadedModel>&, const std::vector<fs::path>& data);

// Throws InputError, before any work, where `what` ("a still") cannot be written there: it does not end in
// .png, its folder is not there, or it is one itself.
void require_picture_possible(const fs::path& file, const char* what);

// The start as the film would show it, without what bodies hide of one another's sky where they are not
// prepared; returns the seconds that painting took, once all was loaded for it. Throws InputError as Shot
// does.
double write_still(const Start&, const std::string& camera, std::pair<int, int> size_px,
                   const fs::path& file);

WrittenStill render_still(const StillOptions&);

}  // namespace limber::detail
