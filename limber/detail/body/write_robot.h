// A prepared body for simulators: shells as collision geometry with masses, the cage as soft tets.
#pragma once

#include <string>
#include <vector>

#include "core/mass_properties.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

// What a body weighs of density 1: its model where that is closed, else its cage. Each shell by itself:
// shells overlap.
struct BodyMass {
  MassProperties of;
  bool of_model = false;
  std::vector<MassProperties> hulls = {};
};
BodyMass mass_of(const PreparedBody&);
std::vector<MassProperties> mass_of_each(const std::vector<ConvexShell>&);

// hulls/hull_000.obj … and mass.json; their names.
std::vector<std::string> write_hulls(const PreparedBody&, const BodyMass&, const std::vector<ConvexShell>&,
                                     double density_kg_m3, const fs::path& folder);
// Rigid bodies of one link, for those hulls and surface.obj.
void write_urdf(const fs::path&, const PreparedBody&, const BodyMass&, double density_kg_m3);
void write_sdf(const fs::path&, const PreparedBody&, const BodyMass&, double density_kg_m3);
void write_mjcf(const fs::path&, const PreparedBody&, const BodyMass&, double density_kg_m3);
// The cage as a flex of MuJoCo's, to be included in a model.
void write_mjcf_flex(const fs::path&, const PreparedBody&, const BodyMass&, double density_kg_m3);

}  // namespace limber::detail
