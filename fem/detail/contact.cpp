// Contact between cages: which pairs of bodies are looked at (near_pairs.cpp finds those that may meet), and
// in which order the touches of one pair are found. A touch is a contact point of one body, a surface vertex
// or a place of a surface edge, that is inside a tet of another body. The work is done in four files:
//
// - contact_candidates.cpp: which points and tets are near enough to be asked at all. It keeps lists that
//   last for many steps.
// - contact_touches.cpp: which of these points are inside which of these tets now.
// - contact_depth.cpp: how deep each one is, and which way leads out.
// - contact_response.cpp: the forces that follow, and those of the walls.
//
// What always holds: touches follow from the present positions alone. A list holds at least all that can
// touch and decides nothing, so its age changes no bit of a result (test
// Contact.TheAgeOfListsChangesNothing). The touches of a pair have one order, which is that in which forces
// are summed: a state gives the same bits in every lane, whatever its neighbours.
//
// Method, sources and figures: docs/contact.md, "Method, between cages". The paper's own detection, a
// spatial hash (Teschner, Heidelberger, Müller, Pomeranets and Gross 2003), is not used; a test compares
// with it.
#include "fem/detail/contact.h"

#include <algorithm>

#include "fem/world.h"

namespace limber::fem::detail {

// What a stepper of that precision reads of a world.
template <>
const Tables<float>& tables_of(const World& world) {
  return world.tables;
}
template <>
const Tables<double>& tables_of(const World& world) {
  return world.tables64;
}

// Effective masses are kept only where rigid bodies are.
template <class Real>
Contacts<Real>::Contacts(const World& world, const Kernels<Real>& kernels, int lanes)
    : world_(world),
      topology_(world.topology),
      tables_(tables_of<Real>(world)),
      kernels_(kernels),
      bodies_(int(world.bodies.size())),
      step_(Real(world.contact_dt_s)),
      near_pairs_(world, tables_.skin, std::vector<Real>(world.bodies.size(), 0), lanes) {
  for (const Body& body : world.bodies)
    if (body.kind == BodyKind::rigid) effective_masses_.resize(world.bodies.size());
  packed_.resize(std::size_t(world.nodes));
  sides_.resize(std::size_t(world.nodes));
  listed_.assign(std::size_t(world.nodes), 0);
  contact_of_node_.assign(std::size_t(world.nodes), -1);
}

// The lane holds another state from now on. Its lists were made for the old one and are made anew when they
// are next asked for. Nothing else outlives a step.
template <class Real>
void Contacts<Real>::forget(int lane) {
  for (const NearPair& pair : near_pairs_.found_before(lane))
    if (pair.list >= 0) lists_[pair.list].built = false;
  near_pairs_.forget(lane);
}

template <class Real>
auto Contacts<Real>::list_of(NearPair& pair) -> List& {
  if (pair.list < 0) {
    pair.list = near_pairs_.free_list();
    if (pair.list == int(lists_.size())) lists_.emplace_back();
    lists_[pair.list].built = false;
  }
  return lists_[pair.list];
}

template <class Real>
const std::vector<Contact<Real>>& Contacts<Real>::find(int lane, const LaneView<Real>& view, int a, int b) {
  std::vector<NearPair>& pairs = near_pairs_.find(lane, view);
  const auto pair = std::lower_bound(pairs.begin(), pairs.end(), NearPair{a, b});
  if (pair != pairs.end() && pair->a == a && pair->b == b) return find(view, *pair);
  contacts_.clear();
  return contacts_;
}

// The touches of bodies a and b, in the order that contact.h states. Pairs whose boxes do not meet cost six
// comparisons. `reach` is the mean skin of the two bodies, in metres: so far do lists reach. `travel` is
// how far their fastest nodes have gone together since the lane was loaded.
//
// First come the points of a in tets of b, then the edges of a: whether an edge has an end inside is known
// from the points. Depth is measured for each direction apart, because a point takes its depth from
// neighbours of its own body. A body with itself has one direction only, and no edges that pass through.
template <class Real>
const std::vector<Contact<Real>>& Contacts<Real>::find(const LaneView<Real>& view, NearPair& pair) {
  const auto [a, b, number] = pair;
  contacts_.clear();
  for (int c = 0; c < 3; ++c) {
    const int ka = (3 * a + c) * view.stride, kb = (3 * b + c) * view.stride;
    if (view.lower[ka] > view.upper[kb] || view.lower[kb] > view.upper[ka]) return contacts_;
  }
  List& list = list_of(pair);
  const Real reach = (tables_.skin[a] + tables_.skin[b]) / 2;
  const Real travel = view.travel[a * view.stride] + view.travel[b * view.stride];
  refresh(view, a, b, reach, travel, list);
  for (int node : list.nodes) fetch(view, node, packed_[node].at);
  const BodyBox<Real> box_a(view, a), box_b(view, b);
  find_points(box_b, reach, travel, list.points[0]);
  find_edges(box_b, reach, travel, a == b, list.edges[0]);
  if (a == b) {
    for (Contact<Real>& contact : contacts_) {
      contact_of_node_[topology_.points[contact.point].node[0]] = -1;
      leave_nearest_face(view, a, contact);
    }
    return contacts_;
  }
  const std::size_t second = contacts_.size();
  find_points(box_a, reach, travel, list.points[1]);
  find_edges(box_a, reach, travel, false, list.edges[1]);
  measure_depths(view, a, b, 0, second);
  measure_depths(view, b, a, second, contacts_.size());
  return contacts_;
}

// What other files call.
template Contacts<float>::Contacts(const World&, const Kernels<float>&, int);
template void Contacts<float>::forget(int);
template const std::vector<Contact<float>>& Contacts<float>::find(int, const LaneView<float>&, int, int);
template const std::vector<Contact<float>>& Contacts<float>::find(const LaneView<float>&, NearPair&);
template Contacts<double>::Contacts(const World&, const Kernels<double>&, int);
template void Contacts<double>::forget(int);
template const std::vector<Contact<double>>& Contacts<double>::find(int, const LaneView<double>&, int, int);
template const std::vector<Contact<double>>& Contacts<double>::find(const LaneView<double>&, NearPair&);

}  // namespace limber::fem::detail
