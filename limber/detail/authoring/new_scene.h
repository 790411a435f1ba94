// A scene to begin with, from models in one frame, a scan or an atlas. docs/imaging.md.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/file.h"

namespace limber::detail {

// What a new scene tells of the model that it is about: it goes away, past all that lies in its way; an
// instrument comes to it; it is moved aside; or nothing moves but the cameras.
enum class Story { away, instrument, aside, tour };

struct NewSceneOptions {
  fs::path from, out;  // models in one frame: a folder, a label map, an atlas; the scene file to write
  fs::path labels;     // names of a label map's labels; empty: as it has them
  std::string robot;   // the model that it is about
  Story story = Story::away;
  std::vector<std::string> only;  // names without ending, labels, an atlas' names or ids; empty: all
  std::vector<std::string> see_through, rigid;  // besides those whose names say so
  double scale = 0.001;                         // metres a file unit
  double shrink = 1;                            // at most so much of every organ's true size
  int tets = 160;                               // of a soft cage
  double fascia_hz =
      0;  // of soft organs but the robot: hung in their places, under gravity; 0: held at their backs
  std::string up = "+z", front = "-y";
  // front, back, left, right, up, down; empty: front, or aside to where least is in the way.
  std::string goal;
  // Of a label map: as imaging::SurfaceNetOptions.
  double label_gap = 0.2;
  int label_rounds = 10;
  double min_island = 8;
};

struct NewScene {
  fs::path file;
  std::size_t bodies = 0, scenery = 0;
  double scale = 1;  // of their true size
  std::vector<std::pair<std::string, double>>
      moved_m;  // bodies that are not at their true place, and how far
  std::vector<std::string> notes;
  fs::path data;          // the folder that planning it must be told, or empty
  bool plannable = true;  // else it is simulated
};
// Writes the scene, and the models of a scan or an atlas beside it. Throws InputError, DiskError.
NewScene new_scene(const NewSceneOptions&);

}  // namespace limber::detail
