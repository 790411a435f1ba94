// A prepared body as a soft one for simulators: the cage as tets, the surface that goes with it.
#pragma once

#include "limber/detail/body/write_robot.h"

namespace limber::detail {

// No material is known here; the files begin with these.
constexpr double soft_youngs_modulus_pa = 5e4, soft_poissons_ratio = 0.3;

// Names of the deformable bodies of USD: those that OpenUSD proposes (proposal 111), and those under which
// Omni Physics has them until they are USD's.
enum class UsdNames { physics, omniphysics };

// USDA: a TetMesh and the surface, each with its bind pose, and a material.
void write_usd_body(const fs::path&, const PreparedBody&, const BodyMass&, double density_kg_m3, UsdNames);

// A scene of SOFA's for a legacy .vtk of the cage and surface.obj beside it, which falls by its weight.
void write_sofa_scene(const fs::path&, const std::string& cage_file, const BodyMass&, double density_kg_m3);

}  // namespace limber::detail
