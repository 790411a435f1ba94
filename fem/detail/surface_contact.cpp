// Contact on the fine surfaces of bodies, which their cages move. The signed distance to a body's surface
// is known at rest; samples of another body's surface read it through the deformed cage (deformed distance
// fields: Hirota and others 2001, Fisher and Lin 2001, McAdams and others 2011). The work is done in six
// files, this one the set-up and the order:
//
// - surface_tables.cpp: what is read at rest. surface_places.h: where things are now.
// - surface_candidates.cpp: which samples and tets are near enough to be asked. It keeps lists.
// - surface_depth.cpp: which samples are within the offset of a surface, and how deep.
// - surface_walls.cpp: samples beyond a wall. surface_response.cpp: the forces that follow.
//
// What always holds: touches follow from the present positions alone, pair by pair in one order, then
// walls. A list holds at least all that can touch and decides nothing (test
// SurfaceContact.TheAgeOfListsChangesNothing).
//
// Method, figures, cost, and what was tried without gain: docs/contact.md, "On the fine surface".
#include "fem/detail/surface_contact.h"

#include <algorithm>
#include <limits>

#include "fem/world.h"

namespace limber::fem::detail {
namespace {

template <class Real>
const SurfaceTables<Real>& surface_tables_of(const World&);
template <>
const SurfaceTables<float>& surface_tables_of(const World& world) {
  return world.surfaces;
}
template <>
const SurfaceTables<double>& surface_tables_of(const World& world) {
  return world.surfaces64;
}

// With that on both sides two bodies are as near as their offset, which is none's above the largest, lets
// them push.
template <class Real>
std::vector<Real> reaches_of(const SurfaceTables<Real>& tables) {
  std::vector<Real> reach;
  for (const auto& body : tables.bodies) reach.push_back(tables.largest_offset() / 2 + body.bulge);
  return reach;
}

}  // namespace

// All arrays get their full length here: of nodes, of cores (four rows
// a tet) and of samples, one behind the other in places_, and likewise of their stamps. What Phong
// Deformation needs is there only where a body asks for it.
template <class Real>
SurfaceContacts<Real>::SurfaceContacts(const World& world, const Kernels<Real>& kernels, int lanes)
    : world_(world),
      topology_(world.topology),
      tables_(tables_of<Real>(world)),
      surface_(surface_tables_of<Real>(world)),
      kernels_(kernels),
      bodies_(int(world.bodies.size())),
      world_nodes_(world.nodes),
      first_sample_row_(world.nodes + 4 * int(world.topology.tets.size())),
      first_sample_stamp_(world.nodes + int(world.topology.tets.size())),
      first_slopes_stamp_(first_sample_stamp_ + int(surface_.samples.size())),
      step_(Real(world.contact_dt_s)),
      near_pairs_(world, tables_.skin, reaches_of(surface_), lanes) {
  for (const auto& body : world.bodies)
    if (body.kind == BodyKind::rigid) effective_masses_.resize(world.bodies.size());
  const std::size_t tets = topology_.tets.size(), samples = surface_.samples.size();
  places_.resize(std::size_t(first_sample_row_) + samples);
  if (!surface_.slopes.empty())
    slopes_.resize(std::size_t(world_nodes_)), spread_.resize(slopes_.size(), 0), bends_.resize(tets),
        bulges_.resize(tets);
  stamps_.assign(std::size_t(first_slopes_stamp_) + slopes_.size(), 0);
  for (const Real mass : tables_.node_mass) reciprocal_mass_.push_back(1 / mass);
  motions_.assign(std::size_t(world_nodes_), Place{}), forces_ = motions_;
  beside_.assign(tets, -1), sides_.assign(tets, 0);
  walls_asleep_until_.resize(std::size_t(lanes * bodies_));
  for (int k = 0; k < lanes * bodies_; ++k)
    walls_asleep_until_[k].assign(surface_.bodies[k % bodies_].wall_nodes.size() + block_size,
                                  std::numeric_limits<Real>::lowest());
}

// The lane holds another state from now on: its lists are made anew when they are next asked for, and every
// node that walls can meet is awake.
template <class Real>
void SurfaceContacts<Real>::forget(int lane) {
  for (const NearPair& pair : near_pairs_.found_before(lane))
    if (pair.list >= 0) lists_[pair.list].built = lists_[pair.list].kept = false;
  near_pairs_.forget(lane);
  for (int body = 0; body < bodies_; ++body) {
    auto& walls = walls_asleep_until_[lane * bodies_ + body];
    std::fill(walls.begin(), walls.end(), std::numeric_limits<Real>::lowest());
  }
}

// How deep a sample is below the surface of another body at most, in metres: depth counts from the offset,
// which is taken off. Of what begins below it the offset is negative, and only what is deeper counts.
template <class Real>
Real SurfaceContacts<Real>::deepest_overlap(int lane, const LaneView<Real>& view) {
  Real deepest = 0;
  for (const SurfaceContact<Real>& contact : find(lane, view))
    if (contact.against >= 0 && contact.against != contact.body)
      deepest = std::max(
          deepest, contact.depth -
                       std::max(surface_.offset_of(contact.body, contact.against, contact.sample), Real(0)));
  return deepest;
}

// All touches of the lane. When the count of calls wraps round to 0, which is no stamp, all stamps are reset.
template <class Real>
const std::vector<SurfaceContact<Real>>& SurfaceContacts<Real>::find(int lane, const LaneView<Real>& view) {
  if (++stamp_ == 0) {
    std::fill(stamps_.begin(), stamps_.end(), 0u), stamp_ = 1;
    for (Bulge& bulge : bulges_) bulge.stamp = 0;
  }
  contacts_.clear(), shares_.clear();
  for (NearPair& pair : near_pairs_.find(lane, view)) find_pair(view, pair);
  for (int body = 0; body < bodies_ && world_.walls; ++body)
    if (topology_.bodies[body].pushed && !view.sleeps(body)) find_walls(lane, view, body);
  return contacts_;
}

// What other files call.
template SurfaceContacts<float>::SurfaceContacts(const World&, const Kernels<float>&, int);
template void SurfaceContacts<float>::forget(int);
template float SurfaceContacts<float>::deepest_overlap(int, const LaneView<float>&);
template const std::vector<SurfaceContact<float>>& SurfaceContacts<float>::find(int, const LaneView<float>&);
template SurfaceContacts<double>::SurfaceContacts(const World&, const Kernels<double>&, int);
template void SurfaceContacts<double>::forget(int);
template double SurfaceContacts<double>::deepest_overlap(int, const LaneView<double>&);
template const std::vector<SurfaceContact<double>>& SurfaceContacts<double>::find(int,
                                                                                  const LaneView<double>&);

}  // namespace limber::fem::detail
