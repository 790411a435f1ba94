// Contact on fine surfaces: samples that are beyond a wall of the bounds. Walls are planes along the axes,
// sides 0 to 2 the lower ones and 3 to 5 the upper ones, and have no offset. A sample of weights w is
// within the wall by
//
//     Σ wᵢ hᵢ + Σ over edges of wᵢ wⱼ h'ᵢⱼ,
//
// with hᵢ how far node i of its tet is within, in metres, and h'ᵢⱼ the part of the edge's bend along the
// axis. It touches where that is negative, and its depth is minus that.
//
// What always holds: a touch depends on positions alone; sleep only leaves out nodes that cannot have come
// to a wall. Touches are in the order of tets, sides and samples. A body that lies flush at a wall is left
// alone up to the slack, a twentieth of the offset: rounding would press on it for ever. Samples that hang
// on held nodes alone are left out; no wall could push them.
#include <algorithm>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/detail/surface_contact.h"
#include "fem/detail/surface_places.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

}  // namespace

// Appends the touches of a body with walls. First its box decides, then its nodes: one that is within all
// walls sleeps until it can have come to the nearest. `least` and `most` are the walls, moved inwards by
// how far the surface may bulge over the cage's nodes, and outwards by the slack. sides_ gathers for each
// tet the walls that some node of it is beyond; only its samples, and only these walls, are then looked at,
// in loops that the compiler makes vectors of.
template <class Real>
void SurfaceContacts<Real>::find_walls(int lane, const LaneView<Real>& view, int body) {
  const typename Tables::Body& table = surface_.bodies[body];
  const Real slack = surface_.wall_slack, bulge = table.bulge;
  Real least[3], most[3];  // where no surface is beyond a wall
  bool any = false;
  for (int c = 0; c < 3; ++c) {
    least[c] = Real(world_.bounds_m.lower[c]) - slack + bulge;
    most[c] = Real(world_.bounds_m.upper[c]) + slack - bulge;
    const int k = (3 * body + c) * view.stride;
    any |= view.lower[k] < least[c] || view.upper[k] > most[c];
  }
  if (!any) return;
  std::vector<Real>& asleep_until = walls_asleep_until_[lane * bodies_ + body];
  const Real travel = view.travel[body * view.stride], rounding_m = Real(1e-3) * slack;
  if (awake_.size() < asleep_until.size())
    awake_.resize(asleep_until.size()), distance_.resize(awake_.size());
  const int awake =
      kernels_.find_at_most(asleep_until.data(), int(table.wall_nodes.size()), travel, awake_.data());
  beyond_tets_.clear();
  for (int i = 0; i < awake; ++i) {
    const int k = awake_[i];
    const Real* at = node_place(view, table.wall_nodes[k]).at;
    unsigned sides = 0;
    Real nearest = std::numeric_limits<Real>::max();
    for (int c = 0; c < 3; ++c) {
      nearest = std::min(nearest, std::min(at[c] - least[c], most[c] - at[c]));
      sides |= unsigned(at[c] < least[c]) << c | unsigned(at[c] > most[c]) << (3 + c);
    }
    if (sides == 0) {
      asleep_until[k] = travel + kept * nearest - rounding_m;
      continue;
    }
    for (int t = table.first_tet_of_wall_node[k]; t < table.first_tet_of_wall_node[k + 1]; ++t) {
      const int tet = table.tets_of_wall_nodes[t];
      if (sides_[tet] == 0) beyond_tets_.push_back(tet);
      sides_[tet] |= static_cast<unsigned char>(sides);
    }
  }
  std::sort(beyond_tets_.begin(), beyond_tets_.end());
  for (const int tet : beyond_tets_) {
    const Real* corner[4];
    for (int i = 0; i < 4; ++i) corner[i] = node_place(view, topology_.tets[tet].node[i]).at;
    const int first = surface_.first_sample[tet], count = surface_.first_held_sample[tet] - first;
    const Bends* bends = table.phong ? &bends_of(view, tet) : nullptr;
    const std::size_t max_found = std::size_t(count + block_size);
    if (within_.size() < max_found) within_.resize(max_found);
    if (awake_.size() < max_found) awake_.resize(max_found), distance_.resize(max_found);
    for (int side = 0; side < 6; ++side) {
      if ((sides_[tet] >> side & 1) == 0) continue;
      const int axis = side % 3;
      const Real inward = side < 3 ? Real(1) : Real(-1),
                 wall = side < 3 ? least[axis] - bulge : most[axis] + bulge;
      Real in[4];
      for (int i = 0; i < 4; ++i) in[i] = inward * (corner[i][axis] - wall);
      Real bends_in[6] = {};
      for (int e = 0; e < 6 && bends; ++e) bends_in[e] = inward * bends->of_edge[e].at[axis];
      const Real* const weights[4] = {&surface_.weights[0][first], &surface_.weights[1][first],
                                      &surface_.weights[2][first], &surface_.weights[3][first]};
      Real* const within = within_.data();
      const int found = kernels_.find_beyond_wall(weights, count, in, bends_in, within, awake_.data());
      for (int i = 0; i < found; ++i) {
        const int k = awake_[i];
        if (!(within[k] < 0)) continue;
        SurfaceContact<Real>& contact = contacts_.emplace_back();
        contact.body = body, contact.against = -1, contact.sample = first + k, contact.tet = -1;
        contact.depth = -within[k];
        contact.first_against = contact.last_against = 0;
        Place place = sample_place(view, first + k);
        if (bends) place.row += bend(*bends, surface_.samples[first + k].weight).row;
        std::copy_n(place.at, 3, contact.place);
        for (Real& c : contact.normal) c = 0;
        contact.normal[axis] = inward;
      }
    }
    sides_[tet] = 0;
  }
}

// What other files call.
template void SurfaceContacts<float>::find_walls(int, const LaneView<float>&, int);
template void SurfaceContacts<double>::find_walls(int, const LaneView<double>&, int);

}  // namespace limber::fem::detail
