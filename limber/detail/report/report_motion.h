// A motion packed for the page of `limber report`: small, and fast to unpack in a browser.
#pragma once

#include <string>

#include "core/json.h"
#include "fem/world.h"
#include "limber/detail/body/body.h"

namespace limber::detail {

struct PackedMotion {
  // meta["bodies"][b]: name, color (linear), and where in `bytes` its arrays are, as [first byte, elements]:
  //   positions          uint16 (3V)  at rest; × step + low is metres
  //   triangles          uint16 (3F), or uint32 where `wide`
  // and of a body that moves:
  //   cage               float32 (3N) at rest, metres
  //   tets, edges        uint32 (4T), (2E) of its boundary
  //   tet_from_vertex    uint32 (V)
  //   phong              whether the surface follows by Phong Deformation, or linearly
  //   frames             uint16 (frames × 3N); × frames_step + frames_low is metres
  // 16 bits are a 65,535th of the box of all that the array holds.
  Json bodies = Json::array();
  std::string bytes;
};
PackedMotion pack_motion(const fem::World&, const std::vector<PreparedBody>&,
                         const std::vector<Vec3>& colors_srgb, const std::vector<State>& frames);

}  // namespace limber::detail
