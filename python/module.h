// The parts of limber._limber, in the order in which they are added: later ones name classes of earlier ones.
#pragma once

#include <pybind11/pybind11.h>

namespace limber_python {

void add_meshes(pybind11::module_&);        // meshes.cpp: meshes, hulls, cages, bindings, bodies
void add_scenes(pybind11::module_&);        // scenes.cpp: scenes, worlds, plans
void add_work_folders(pybind11::module_&);  // work_folders.cpp: verify, render, export, report

}  // namespace limber_python
