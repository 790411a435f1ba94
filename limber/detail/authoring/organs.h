// The models of a folder as a scene's bodies: read, caged, moved apart.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/contact_shape.h"
#include "core/mesh.h"
#include "limber/detail/authoring/new_scene.h"

namespace limber::detail {

inline constexpr int bone_tets = 500;  // of a bone's cage
// What is thinner, of its diagonal, is a sheet, as a diaphragm: no coarse cage is near it, so it is only
// seen.
inline constexpr double min_thickness = 0.02;

struct Organ {
  std::string name, file;
  SurfaceMesh surface;  // as in the file
  Box box;              // metres, in our axes, of its true size
  double volume_m3 = 0, thickness_m = 0;
  bool see_through = false, bone = false;
  int pieces = 1;
  // Of its true size and at its true place; none when seen through.
  TetMesh cage;
  std::shared_ptr<const ContactShape> shape;
  Vec3 way_m = Vec3::Zero();  // from there
};

// All of options.from, but those that options.only leaves out. Throws InputError where there is none, or a
// name in the options is none of them.
std::vector<Organ> read_organs(const NewSceneOptions&);
// Of two bones, or two things seen through, that fill the same place one is enough: the one of fewer pieces,
// then of fewer triangles. `notes` gets a sentence.
void leave_out_doubles(std::vector<Organ>&, std::vector<std::string>& notes);
void make_cage(const NewSceneOptions&, Organ&);
// The largest scale at which all come apart; they are moved by then. Throws InputError where none does.
double come_apart(const NewSceneOptions&, std::vector<Organ>&);

// About its own middle, and moved by its way.
TetMesh placed(const Organ&, double scale);
SurfaceMesh placed_surface(const NewSceneOptions&, const Organ&, double scale);
std::vector<std::size_t> simulated(const std::vector<Organ>&);       // those that are not only seen
double longest(const std::vector<Organ>&, const std::string& name);  // its box's longest side

}  // namespace limber::detail
