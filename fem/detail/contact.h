// Contact of one lane: who is inside whom, how deep, which force. Method and figures: docs/contact.md.
#pragma once

#include <vector>

#include "core/types.h"
#include "fem/detail/effective_mass.h"
#include "fem/detail/friction.h"
#include "fem/detail/lane_view.h"
#include "fem/detail/near_pairs.h"
#include "fem/detail/penalty.h"
#include "fem/detail/tables.h"

namespace limber::fem {
struct World;
}

namespace limber::fem::detail {

// A contact point inside a tet of another body: a vertex; the middle of an edge that has an end inside; or,
// of an edge that passes through, the middle of the stretch inside. All follows from the present positions.
template <class Real>
struct Contact {
  int point, tet;     // of the world's points and tets
  Real share[2];      // of the point's two nodes
  Real weight[4];     // barycentric coordinates of the point in the tet
  Real depth;         // metres along `direction` to the surface; ≤ 0: no force
  Real direction[3];  // unit, out of the tet's body
  bool known;         // depth and direction are set
  bool passes;        // the point is of an edge with no end inside
};

// The box of a body.
template <class Real>
struct BodyBox {
  Real lower[3], upper[3];
  BodyBox(const LaneView<Real>& view, int body) {
    for (int c = 0; c < 3; ++c) {
      lower[c] = view.lower[(3 * body + c) * view.stride];
      upper[c] = view.upper[(3 * body + c) * view.stride];
    }
  }
};

template <class Real>
class Contacts {
 public:
  Contacts(const World&, const Kernels<Real>&, int lanes);
  void forget(int lane);  // the lane holds another state now
  // Adds to view.f the normal forces of all contacts and walls, and to `friction`, unless null, what they
  // are.
  void add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction = nullptr);
  // From now on add_forces also appends to this list, unless null.
  void record_to(std::vector<ContactRecord<Real>>* list) { records_ = list; }
  // The touches of bodies a and b, a ≤ b: of a in b vertices and edges with an end inside, then edges that
  // pass through, each ascending; then those of b in a; of a body with itself
  // vertices and edges with an end inside only. For tests and observables; valid until the next call.
  const std::vector<Contact<Real>>& find(int lane, const LaneView<Real>& view, int a, int b);
  // Those whose boxes may meet, and bodies that touch themselves.
  const std::vector<NearPair>& near_pairs(int lane, const LaneView<Real>& view) {
    return near_pairs_.find(lane, view);
  }

 private:
  // Points, or ridges (named by their middles' points), and the tets of the other body near them: ascending
  // by point, then by tet.
  struct Near {
    std::vector<TetAndEdge> candidates;
    // Travel of the two bodies before which nothing can be in the tet; filled up for the kernel.
    std::vector<Real> asleep_until;
  };
  // Candidates of one pair in one lane, [0] a in b, [1] b in a: derived data, a superset of what can touch.
  struct List {
    bool built = false;
    Real travel_at_build = 0;
    Near points[2], edges[2];
    std::vector<int> nodes;  // every node they name
  };
  struct Place {
    Real at[4];
  };
  // Points or ridges of a body near another, in slabs along their longest axis, each in rows along the
  // second.
  struct Slabs {
    static constexpr int most = 32, rows = 8;
    int axis, count;
    Real lower[3], upper[3], inverse_width;
    Real half;  // of the edges, the largest half length along the axis
    std::vector<int> begin, point;
    std::vector<Real> from[3], to[3];  // x, y, z of an edge's ends; filled up for the kernel
    std::vector<TetAndEdge> found;     // ascending by tet
    std::vector<Real> distance;        // of these, at least
    int of(Real x) const {             // never falls as x grows, so a box finds all that is in it
      const Real slab = (x - lower[axis]) * inverse_width;
      return slab > 0 ? (slab < Real(count) ? int(slab) : count - 1) : 0;
    }
  };
  // The part of an edge that is in a tet, as shares of the way from its first node to its second.
  struct Stretch {
    int tet, entry, exit;  // entry, exit: faces; −1: the edge's end is inside
    Real begin, end;
    Real at_begin[4], at_end[4];  // barycentric, times 6V, of the edge's ends
  };
  struct Cell;

  void place_of(int point, const Real share[2], Real out[3]) const;  // from packed_
  const std::vector<Contact<Real>>& find(const LaneView<Real>&, NearPair&);
  List& list_of(NearPair&);

  // contact_candidates.cpp
  void refresh(const LaneView<Real>&, int a, int b, Real reach, Real travel, List&);
  bool may_touch(const TetAndEdge&, int body) const;
  void build_direction(const LaneView<Real>&, int from, int into, Real reach, List&, int direction);
  void fetch_and_mark(const LaneView<Real>&, int body, const Real lower[3], const Real upper[3], Real reach);
  bool apart(int node, int other) const;
  bool sort_near(int from, bool edges, Real reach, Slabs&);
  void collect_near(const TetAndEdge& tet, const TetPlanes<Real>&, int column, Real reach);
  void list_found(const Slabs&, int from, Real reach, List&, Near&);

  // contact_touches.cpp
  int wake(const Near&, Real travel);
  void find_points(const BodyBox<Real>& box, Real reach, Real travel, Near&);
  void find_edges(const BodyBox<Real>& box, Real reach, Real travel, bool itself, Near&);
  bool find_inside(const BodyBox<Real>& box, const TetAndEdge&);
  void cut_edge(const Real* p, const Real* q, int tet);
  void touch_of_stretches(int point);

  // contact_depth.cpp
  void leave_nearest_face(const LaneView<Real>&, int body, Contact<Real>&) const;
  bool leave_over_ridge(const Stretch& first, const Stretch& last, const Real way[3], Contact<Real>&) const;
  void measure_depths(const LaneView<Real>&, int from, int into, std::size_t first, std::size_t last);
  void leave_along_centers(const LaneView<Real>&, int from, int into, std::size_t first, std::size_t last);
  static bool finish(Contact<Real>&, Real sum);
  Contact<Real> leave_along_edges(const LaneView<Real>&, Contact<Real>);
  bool walk_out(const LaneView<Real>&, int tet, int before, const Real p[3], const Real q[3], Real way[3],
                Real normal[3]) const;

  // contact_response.cpp
  void add_forces_with_rigid(int lane, const LaneView<Real>&, Friction<Real>*);
  void respond(const LaneView<Real>&, int a, int b, const Contact<Real>&, Friction<Real>*) const;
  template <class Each>
  void for_each_beyond_wall(const LaneView<Real>&, int body, const Each&) const;
  void add_wall_forces(const LaneView<Real>&, Friction<Real>*) const;

  const World& world_;
  const Topology& topology_;
  const Tables<Real>& tables_;
  const Kernels<Real>& kernels_;
  int bodies_;
  std::vector<ContactRecord<Real>>* records_ = nullptr;
  Real step_;  // the step from which stiffness follows
  NearPairs<Real> near_pairs_;
  // Where there are rigid bodies that move: a body, in the lane at hand; and all touches of that, with their
  // bodies.
  std::vector<EffectiveMass> effective_masses_;
  struct Held {
    int a, b;
    Contact<Real> contact;
  };
  std::vector<Held> held_;
  std::vector<List> lists_;  // [NearPair::list] of pairs whose boxes have met, in all lanes
  std::vector<Contact<Real>> contacts_;
  std::vector<Place> packed_;         // by world node; valid for the nodes of the list at hand
  std::vector<int> contact_of_node_;  // index into contacts_ of a vertex, until depths are measured, else −1
  std::vector<Stretch> stretches_;    // of the edge at hand
  // Of the candidates at hand: those awake, of these those with an end inside, and how far they are apart.
  std::vector<int> awake_, with_end_inside_;
  std::vector<Real> distance_;
  // Scratch of a touch: the mesh edges' other ends, and where ways to them leave the tet.
  std::vector<Real> ends_[3], share_;
  std::vector<int> exit_;
  // Scratch of a list's building.
  std::vector<int> near_, order_, counts_;
  std::vector<Real> unsorted_;
  Slabs slabs_[2];                     // vertices, edges
  std::vector<TetAndEdge> near_tets_;  // their edges are not told
  std::vector<TetPlanes<Real>> planes_;
  std::vector<NearTet<Real>> near_tet_;
  std::vector<unsigned char> sides_;   // by world node: of the faces of a box, those it is beyond
  std::vector<unsigned char> listed_;  // by world node
};

template <class Real>
const Tables<Real>& tables_of(const World&);

// The place of a contact point, where the nodes of the list at hand are now.
template <class Real>
void Contacts<Real>::place_of(int point, const Real share[2], Real out[3]) const {
  const int* node = topology_.points[point].node;
  for (int c = 0; c < 3; ++c) out[c] = share[0] * packed_[node[0]].at[c] + share[1] * packed_[node[1]].at[c];
}

}  // namespace limber::fem::detail
