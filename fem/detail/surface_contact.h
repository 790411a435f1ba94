// Contact of one lane between fine surfaces, which are moved by their cages: samples of one body read the
// distance to the other's surface, at rest, through its deformed cage. Method and figures: docs/contact.md.
#pragma once

#include <algorithm>
#include <vector>

#include "fem/detail/contact.h"
#include "fem/detail/effective_mass.h"
#include "fem/detail/friction.h"
#include "fem/detail/lane_view.h"
#include "fem/detail/near_pairs.h"
#include "fem/detail/penalty.h"
#include "fem/detail/surface_tables.h"
#include "fem/detail/tables.h"

namespace limber::fem::detail {

// A sample of one body within the offset of another's surface, or beyond a wall. All follows from the present
// positions.
template <class Real>
struct SurfaceContact {
  int body, against;                // whose sample, in whose cage; against −1: a wall
  int sample, tet;                  // of the world's; tet −1: a wall
  int first_against, last_against;  // shares of the place it is at, with minus signs: shares_of
  Real place[3], depth, normal[3];  // depth > 0, along the unit normal, out of `against`
};

template <class Real>
class SurfaceContacts {
 public:
  SurfaceContacts(const World&, const Kernels<Real>&, int lanes);
  void forget(int lane);  // the lane holds another state now
  // Adds to view.f the normal forces of all contacts and walls, and to `friction`, unless null, what they
  // are.
  void add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction = nullptr);
  // From now on add_forces also appends to this list, unless null.
  void record_to(std::vector<ContactRecord<Real>>* list) { records_ = list; }
  // How near two bodies' boxes must be for contact.
  Real offset(int a, int b) const {
    return std::max(surface_.offset[a * bodies_ + b], Real(0)) + surface_.bodies[a].bulge +
           surface_.bodies[b].bulge;
  }
  // Of all bodies, as add_forces finds them; valid until the next call.
  const std::vector<SurfaceContact<Real>>& find(int lane, const LaneView<Real>& view);
  // How deep the samples of bodies are below the surfaces of others at most, beyond what they are where
  // bodies start; 0 where none is.
  Real deepest_overlap(int lane, const LaneView<Real>& view);
  // Those whose boxes may be so near, and bodies that touch themselves.
  const std::vector<NearPair>& near_pairs(int lane, const LaneView<Real>& view) {
    return near_pairs_.find(lane, view);
  }
  using Share = typename SurfaceTables<Real>::Share;
  // Of the nodes that move the sample, and minus those of the nodes that move the place it is at, if any do.
  Shares<Real> shares_of(const SurfaceContact<Real>& contact) const {
    return surface_.shares_of(contact.sample);
  }
  Shares<Real> shares_against(const SurfaceContact<Real>& contact) const {
    return {shares_.data() + contact.first_against, shares_.data() + contact.last_against};
  }

 private:
  using Tables = SurfaceTables<Real>;
  // Samples of one body and the cores of another near them, ascending by sample, then by tet: derived data, a
  // superset of what can touch.
  struct Near {
    std::vector<TetAndEdge> candidates;  // corners and ends are rows of places_
    std::vector<Real> asleep_until;      // travel before which they cannot touch; filled up for the kernel
  };
  struct List {
    bool built = false;
    Real travel_at_build = 0, reach = 0;
    Near near[2];  // samples of a in b, of b in a
    // What find_pair found last where neither body has moved since the call before; indices of shares count
    // from the first of these.
    bool kept = false;
    std::uint32_t changes[2] = {0, 0};  // of a and b in the last call
    std::vector<SurfaceContact<Real>> contacts;
    std::vector<Share> shares;
  };
  // x y z and nothing: added and scaled at once.
  typedef Real Row __attribute__((vector_size(4 * sizeof(Real)), may_alias));
  struct Place {
    union {
      Row row;
      Real at[4];
    };
  };
  // The samples of one tet, in columns that begin with a block of their own.
  struct Group {
    int tet, begin, first_sample, count;
    Real lower[3], upper[3];
  };

  struct Slopes {
    Place column[3];  // of a node's deformation gradient
  };

  // How Phong Deformation moves the places of a tet: by wᵢ wⱼ times this of each edge.
  struct Bends {
    Place of_edge[6];  // 01 02 03 12 13 23
  };
  // And how far the middle of the edge that bends most.
  struct Bulge {
    unsigned stamp = 0;
    Real most = 0;
  };
  // surface_places.h
  const Place& node_place(const LaneView<Real>&, int node);
  const Place& sample_place(const LaneView<Real>&, int sample);
  const Slopes& slopes_at(const LaneView<Real>& view, int node) {
    if (stamps_[first_slopes_stamp_ + node] != stamp_) find_slopes(view, node);
    return slopes_[node];
  }
  void find_slopes(const LaneView<Real>&, int node);
  const Bends& bends_of(const LaneView<Real>& view, int tet) {
    if (bulges_[tet].stamp != stamp_) find_bends(view, tet);
    return bends_[tet];
  }
  void find_bends(const LaneView<Real>&, int tet);
  Real bulge_of(const LaneView<Real>&, int body, int tet);
  Real sample_bulge(const LaneView<Real>&, int body, int sample);
  static Place bend(const Bends&, const Real weight[4]);
  void need_core(const LaneView<Real>& view, int tet) {
    if (stamps_[world_nodes_ + tet] != stamp_) find_core(view, tet);
  }
  void find_core(const LaneView<Real>&, int tet);
  int row_of_core(int tet) const { return world_nodes_ + 4 * tet; }
  int row_of_sample(int sample) const { return first_sample_row_ + sample; }

  // surface_candidates.cpp
  Real travel_of(const LaneView<Real>&, int a, int b);
  List& list_of(NearPair&);
  void find_pair(const LaneView<Real>&, NearPair&);
  void find_moved_pair(const LaneView<Real>&, int a, int b, List&);
  void build(const LaneView<Real>&, int from, int into, Real reach, Near&);
  void collect_groups(const LaneView<Real>&, int from, const Real lower[3], const Real upper[3], Real reach);
  void sort_groups(const Real lower[3], const Real upper[3]);
  int slab_of(Real x) const {  // never falls as x grows
    const Real slab = (x - slab_lower_) * slabs_a_metre_;
    return slab > 0 ? (slab < Real(slabs) ? int(slab) : slabs - 1) : 0;
  }

  // surface_depth.cpp
  void find_in(const LaneView<Real>&, int from, int into, Real reach, Real travel, Near&);
  void choose_tets(const LaneView<Real>&, int from, int into);
  void measure(const LaneView<Real>&, int from, int into);
  void touch(const LaneView<Real>&, int from, int into, int k);
  bool is_beside(int tet, const Real weight[4], Real slack) const;
  SurfaceRows<Real> rows() const;

  // surface_walls.cpp
  void find_walls(int lane, const LaneView<Real>&, int body);

  // surface_response.cpp
  void share_loads(const LaneView<Real>&);
  void respond(const SurfaceContact<Real>&, Friction<Real>*);
  Real load_of(const SurfaceContact<Real>&) const;
  bool is_rigid(int body) const;

  const World& world_;
  const Topology& topology_;
  const detail::Tables<Real>& tables_;
  const Tables& surface_;
  const Kernels<Real>& kernels_;
  int bodies_, world_nodes_, first_sample_row_, first_sample_stamp_, first_slopes_stamp_;
  std::vector<ContactRecord<Real>>* records_ = nullptr;
  Real step_;
  NearPairs<Real> near_pairs_;
  std::vector<List> lists_;  // [NearPair::list] of pairs that have been near, in all lanes
  // [lane × bodies + body], of its wall_nodes: travel before which they cannot be beyond a wall.
  std::vector<std::vector<Real>> walls_asleep_until_;
  std::vector<SurfaceContact<Real>> contacts_;
  std::vector<Share> shares_;  // of places that samples are at
  std::vector<Real> spread_;   // a node: 0
  // Rows: the world's nodes, four corners of each core, the samples; those are of this call whose stamp is.
  std::vector<Place> places_;
  std::vector<Slopes> slopes_;  // a node; empty without phong bodies
  std::vector<Bends> bends_;    // a tet; empty without phong bodies
  std::vector<Bulge> bulges_;
  std::vector<unsigned> stamps_;  // a node, a tet's core, a sample, a node's slopes
  unsigned stamp_ = 0;
  std::vector<int> awake_;
  std::vector<Real> distance_;
  std::vector<PlaceInTet<Real>> asked_;  // and what kernels answer, in columns
  std::vector<Real> answers_[8];
  Real* columns_of_answers_[8];
  std::vector<Real> reciprocal_mass_;  // a node, held ones too
  // A node's velocity, and behind it its load, Σ area × depth × weight of its touches, over its mass; 0 of
  // those that no touch has a share of, as their forces are.
  std::vector<Place> motions_, forces_;
  std::vector<int> loaded_;                      // nodes that have a load
  std::vector<EffectiveMass> effective_masses_;  // a body; empty without rigid ones
  // Scratch of a list's building.
  static constexpr int slabs = 32;
  std::vector<Group> groups_, unsorted_groups_;
  std::vector<Real> group_boxes_[6];  // lower x y z, upper x y z; filled up for the kernel
  std::vector<int> meeting_;
  int slab_axis_ = 0, slab_begin_[slabs + 1];
  Real slab_lower_ = 0, slabs_a_metre_ = 0, slab_half_ = 0;
  std::vector<int> counts_;
  std::vector<Real> columns_[3];
  std::vector<TetAndEdge> near_tets_, found_;
  std::vector<Real> found_distance_;
  std::vector<TetPlanes<Real>> planes_;
  std::vector<NearTet<Real>> near_tet_;
  std::vector<int> beside_;   // a tet
  std::vector<Real> within_;  // how far the samples of a tet are within a wall; filled up for the kernel
  std::vector<int> beyond_tets_;
  std::vector<unsigned char> sides_;  // a tet: of walls that some node of it is beyond, bits; else 0
};

}  // namespace limber::fem::detail
