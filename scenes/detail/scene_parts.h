// The parts of a scene, each read from its table, with the checks that look at more than one key; what one
// key may be is in the table of keys (scenes/detail/schema.h). Private to the reader, which calls them in
// this order (scenes/read_scene.cpp). All throw InputError with place and advice; those that are given
// Complaints go on with the next table after one.
#pragma once

#include <string>
#include <vector>

#include "scenes/detail/complaints.h"
#include "scenes/detail/document.h"
#include "scenes/scene.h"

namespace limber::scenes {

// `body` names it in complaints. scenes/detail/read_model.cpp
Model read_model(const Node& table, const std::string& body);
std::vector<Box> read_boxes(const Node& table, std::string_view key);  // there, too

// Bodies, scenery, and which of them is the robot. scenes/detail/read_bodies.cpp
void read_bodies(const Node& root, Scene&, const Complaints&);
bool is_rigid_obstacle(const BodySpec&);
// The body of that name; `key` names the key in the complaint where there is none.
int body_called(const Node&, const Scene&, const std::string& key);
int other_body(const Node&, const Scene&, const std::string& key);  // other than the robot

// What happens by itself: one of [[forces]], [[pressures]], [[motions]], [[ligaments]].
// scenes/detail/read_script.cpp
void read_force(const Node& table, Scene&);
void read_pressure(const Node& table, Scene&);
void read_motion(const Node& table, Scene&);
void read_ligament(const Node& table, Scene&);

// goal and [[via]], or what the scene lacks to be planned. scenes/detail/read_goals.cpp
void read_goals(const Node& root, Scene&, const Complaints&);
PlannerSpec read_planner(const Node& table);

// camera, [[cameras]] and film. scenes/detail/read_film.cpp
std::vector<CameraSpec> read_cameras(const Node& root, const Scene&);
FilmSpec read_film(const Node& table);
// Labels and cuts, which name bodies and scenery.
void read_labels(const Node& film, Scene&);
void read_cuts(const Node& film, Scene&);
// That the inset's camera is one of the scene's.
void check_inset(const Node& film, const Scene&);

}  // namespace limber::scenes
