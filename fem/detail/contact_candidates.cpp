// Contact between cages, first part: lists of what is near. A candidate is a contact point of one body, or
// a ridge (a surface edge that sticks out), together with a tet of the other body. A list holds the
// candidates of one pair of bodies in one lane that were within the reach r of one another when it was
// made. r is the skin, a fifth of the mean edge.
//
// What always holds: what is inside a tet now is in the list. With s the way that the fastest nodes of both
// bodies have gone together, no distance between the two falls by more than s grows. So
//
//     a list that was made at s₀ is used while     s − s₀ ≤ 0.9 r;
//     a candidate at distance d sleeps until       s = s₀ + 0.9 d − 0.02 r.
//
// The tenth that is kept back and the fiftieth of the reach are for rounding. Distances are lower bounds:
// never more than the true ones.
//
// Tried and not kept (docs/contact.md, "Traps" and "Figures"): without the fiftieth a candidate at distance
// nothing slept, and results depended on the age of the list. The displacement since the list was made, in
// place of the way, can fall again, and edges were missed. Skins of 0.3 and 0.4 of an edge cost 15 to 40 %
// more. Boxes of velocity in place of the fastest node gain nothing for whole bodies.
#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/contact.h"
#include "fem/detail/list_margins.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

// sides_ of a node: bits 0 to 2 say that it is beyond the lower sides of a box, bits 3 to 5 beyond the
// upper ones. This bit says that its place is not finite, in a rollout that diverges.
constexpr unsigned char lost = 64;

}  // namespace

// Makes the list of bodies a and b anew where the ways they have gone may have let something new come near.
// A body with itself has one direction. listed_ marks the nodes that are in list.nodes while it is being
// made.
template <class Real>
void Contacts<Real>::refresh(const LaneView<Real>& view, int a, int b, Real reach, Real travel, List& list) {
  if (list.built && travel - list.travel_at_build <= kept * reach) return;
  list.built = true;
  list.travel_at_build = travel;
  list.nodes.clear();
  build_direction(view, a, b, reach, list, 0);
  if (a != b) build_direction(view, b, a, reach, list, 1);
  for (int node : list.nodes) listed_[node] = 0;
}

// The candidates of one direction: points and ridges of `from`, tets of `into`. The steps, each of which
// throws out most of what is left:
//
// - points and ridges of `from` that are wholly beyond one side of the box of `into`, moved out by the
//   reach;
// - tets of `into` that are wholly beyond one side of the box of what is left, moved out likewise;
// - for each tet, what lies outside of its box or of one of its four planes (collect_near).
//
// This finds candidates tet by tet; list_found then sorts them by point. The distances of points come from
// the planes. Those of ridges are measured again, from edge to tet, which lets more of them sleep. Within
// one body, neighbours are put at twice the reach and so are not listed.
template <class Real>
void Contacts<Real>::build_direction(const LaneView<Real>& view, int from, int into, Real reach, List& list,
                                     int direction) {
  const Topology::Body& other = topology_.bodies[into];
  const BodyBox<Real> box(view, into);
  fetch_and_mark(view, from, box.lower, box.upper, reach);
  Slabs &points = slabs_[0], &edges = slabs_[1];
  const bool any_points = sort_near(from, false, reach, points),
             any_edges = sort_near(from, true, reach, edges);
  if (any_points || any_edges) {
    Real lower[3], upper[3];
    for (int c = 0; c < 3; ++c) {
      lower[c] = std::min(points.lower[c], edges.lower[c]);
      upper[c] = std::max(points.upper[c], edges.upper[c]);
    }
    fetch_and_mark(view, into, lower, upper, reach);
    near_tets_.clear();
    for (int t = other.first_tet; t < other.last_tet; ++t) {
      const int* n = topology_.tets[t].node;
      const int all = sides_[n[0]] & sides_[n[1]] & sides_[n[2]] & sides_[n[3]];
      if (all == 0) near_tets_.push_back({{n[0], n[1], n[2], n[3]}, -1, -1, t, -1});
    }
    planes_.resize((near_tets_.size() + block_size - 1) / block_size);
    kernels_.find_planes(near_tets_.data(), int(near_tets_.size()), packed_[0].at, reach, planes_.data());
    for (std::size_t k = 0; k < near_tets_.size(); ++k)
      collect_near(near_tets_[k], planes_[k / block_size], int(k % block_size), reach);
  }
  edges.distance.resize(edges.found.size());
  kernels_.edge_distances(edges.found.data(), nullptr, int(edges.found.size()), packed_[0].at,
                          edges.distance.data());
  for (Slabs& slabs : slabs_)
    if (from == into)
      for (std::size_t i = 0; i < slabs.found.size(); ++i)
        if (!may_touch(slabs.found[i], from)) slabs.distance[i] = 2 * reach;
  list_found(points, from, reach, list, list.points[direction]);
  list_found(edges, from, reach, list, list.edges[direction]);
}

// Copies the places of a body's nodes to packed_ and marks in sides_ which sides of a box, moved out by
// `reach`, each node is beyond.
template <class Real>
void Contacts<Real>::fetch_and_mark(const LaneView<Real>& view, int index, const Real lower[3],
                                    const Real upper[3], Real reach) {
  const Topology::Body& body = topology_.bodies[index];
  for (int n = body.first_node; n < body.last_node; ++n) {
    Real* at = packed_[n].at;
    fetch(view, n, at);
    int sides = std::isfinite(at[0] + at[1] + at[2]) ? 0 : lost;
    for (int c = 0; c < 3; ++c)
      sides |= int(at[c] < lower[c] - reach) << c | int(at[c] > upper[c] + reach) << (3 + c);
    sides_[n] = (unsigned char)sides;
  }
}

// Whether the box of two nodes is certainly apart from the box that they were marked by: both are beyond
// the same side of it, or one of them is lost.
template <class Real>
bool Contacts<Real>::apart(int node, int other) const {
  return ((sides_[node] & sides_[other]) | ((sides_[node] | sides_[other]) & lost)) != 0;
}

// Whether a tet and a vertex or edge of the same body may count as touching: they may not where some node
// of the one shares a tet with some node of the other. Such neighbours are near in every state.
template <class Real>
bool Contacts<Real>::may_touch(const TetAndEdge& one, int index) const {
  const Topology::Body& body = topology_.bodies[index];
  const Lists& near = body.self.near_tets;
  for (const int node : {one.from, one.to}) {
    const int k = node - body.first_node;
    if (std::binary_search(near.items.begin() + near.begin[k], near.items.begin() + near.begin[k + 1],
                           one.tet))
      return false;
  }
  return true;
}

// Lists what was found within the reach, by a counting sort by point: first counts, then the sums of counts
// as places, then one pass that puts each candidate in its place. The sort keeps the order of tets of each
// point, which is ascending. Notes when each candidate wakes, and all nodes that the list names.
template <class Real>
void Contacts<Real>::list_found(const Slabs& slabs, int from, Real reach, List& list, Near& near) {
  const Topology::Body& body = topology_.bodies[from];
  counts_.assign(std::size_t(body.last_point - body.first_point + 1), 0);
  for (std::size_t i = 0; i < slabs.found.size(); ++i)
    counts_[slabs.found[i].point - body.first_point + 1] += slabs.distance[i] <= reach;
  for (std::size_t k = 1; k < counts_.size(); ++k) counts_[k] += counts_[k - 1];
  near.candidates.resize(std::size_t(counts_.back()));
  near.asleep_until.resize(near.candidates.size() + block_size);
  for (std::size_t i = 0; i < slabs.found.size(); ++i) {
    const TetAndEdge& found = slabs.found[i];
    if (!(slabs.distance[i] <= reach)) continue;
    const int k = counts_[found.point - body.first_point]++;
    near.candidates[k] = found;
    near.asleep_until[k] = list.travel_at_build + kept * slabs.distance[i] - rounding * reach;
    for (const int n :
         {found.from, found.to, found.corner[0], found.corner[1], found.corner[2], found.corner[3]})
      if (listed_[n] == 0) listed_[n] = 1, list.nodes.push_back(n);
  }
}

// Sorts the points of a body, or its ridges, that are near the box its nodes were marked by: into at most
// 32 slabs along the longest axis of the box round them, and within a slab into 8 rows along the second
// longest. Slabs are no thinner than the reach. Only slabs are looked up; rows put what is close together
// side by side, so that the kernel can pass over sixteen at a time. False when nothing is near.
//
// A ridge lies in the slab of its middle. `half` is the largest half length of a ridge along the axis:
// whoever looks for ridges in an interval looks so much farther on both sides.
template <class Real>
bool Contacts<Real>::sort_near(int from, bool edges, Real reach, Slabs& slabs) {
  const Topology::Body& body = topology_.bodies[from];
  for (int c = 0; c < 3; ++c)
    slabs.lower[c] = std::numeric_limits<Real>::max(), slabs.upper[c] = -slabs.lower[c];
  slabs.found.clear(), slabs.distance.clear();
  near_.clear(), slabs.point.clear();
  for (auto* at : {slabs.from, slabs.to})
    for (int c = 0; c < 3; ++c) at[c].clear();
  for (int k = edges ? body.first_ridge : body.first_point; k < (edges ? body.last_point : body.first_ridge);
       ++k) {
    const Topology::Point& point = topology_.points[k];
    if (apart(point.node[0], point.node[1])) continue;
    near_.push_back(k);
    const Real share[2] = {Real(point.share[0]), Real(point.share[1])};
    Real middle[3];
    place_of(k, share, middle);
    const Real *p = edges ? packed_[point.node[0]].at : middle,
               *q = edges ? packed_[point.node[1]].at : middle;
    for (int c = 0; c < 3; ++c) {
      slabs.from[c].push_back(p[c]), slabs.to[c].push_back(q[c]);
      slabs.lower[c] = std::min(slabs.lower[c], std::min(p[c], q[c]));
      slabs.upper[c] = std::max(slabs.upper[c], std::max(p[c], q[c]));
    }
  }
  if (near_.empty()) return false;
  slabs.axis = 0;
  const auto size = [&](int c) { return slabs.upper[c] - slabs.lower[c]; };
  for (int c = 1; c < 3; ++c)
    if (size(c) > size(slabs.axis)) slabs.axis = c;
  const int next = (slabs.axis + 1) % 3, other = (slabs.axis + 2) % 3,
            second = size(next) > size(other) ? next : other;
  slabs.count = 1 + int(std::min(size(slabs.axis) / reach, Real(Slabs::most - 1)));
  slabs.inverse_width = Real(slabs.count) / (size(slabs.axis) + reach);
  const Real inverse_row = Real(Slabs::rows) / (size(second) + reach);
  const std::size_t count = near_.size();
  order_.resize(count);
  counts_.assign(std::size_t(slabs.count * Slabs::rows + 1), 0);
  slabs.half = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Real p = slabs.from[slabs.axis][i], q = slabs.to[slabs.axis][i];
    slabs.half = std::max(slabs.half, std::abs(q - p) / 2);
    const int row =
        int(((slabs.from[second][i] + slabs.to[second][i]) / 2 - slabs.lower[second]) * inverse_row);
    order_[i] = slabs.of((p + q) / 2) * Slabs::rows + std::clamp(row, 0, Slabs::rows - 1);
    ++counts_[order_[i] + 1];
  }
  for (std::size_t k = 1; k < counts_.size(); ++k) counts_[k] += counts_[k - 1];
  slabs.begin.clear();
  for (int s = 0; s <= slabs.count; ++s) slabs.begin.push_back(counts_[s * Slabs::rows]);
  slabs.point.resize(count);
  for (std::size_t i = 0; i < count; ++i) slabs.point[order_[i] = counts_[order_[i]]++] = near_[i];
  for (auto* at : {slabs.from, slabs.to})
    for (int c = 0; c < 3; ++c) {
      unsorted_.swap(at[c]);
      at[c].resize(count + block_size);
      for (std::size_t i = 0; i < count; ++i) at[c][order_[i]] = unsorted_[i];
    }
  return true;
}

// Finds the points and ridges near one tet, given the planes of its faces and its box, both moved out by
// the reach. What is in the tet at some later moment was within `reach` of it at build, so it was in that
// box and not wholly on the outer side of any one of these planes.
template <class Real>
void Contacts<Real>::collect_near(const TetAndEdge& tet, const TetPlanes<Real>& planes, int column,
                                  Real reach) {
  for (int s = 0; s < 2; ++s) {
    Slabs& slabs = slabs_[s];
    bool meet = !slabs.point.empty();
    for (int c = 0; c < 3; ++c)
      meet &= planes.lower[c][column] <= slabs.upper[c] && planes.upper[c][column] >= slabs.lower[c];
    if (!meet) continue;
    const int begin = slabs.begin[slabs.of(planes.lower[slabs.axis][column] - slabs.half)];
    const int count = slabs.begin[slabs.of(planes.upper[slabs.axis][column] + slabs.half) + 1] - begin;
    const Real* const from[3] = {&slabs.from[0][begin], &slabs.from[1][begin], &slabs.from[2][begin]};
    const Real* const to[3] = {&slabs.to[0][begin], &slabs.to[1][begin], &slabs.to[2][begin]};
    near_tet_.resize(std::size_t(count));
    const int near = (s == 1 ? kernels_.near_segments : kernels_.near_points)(planes, column, from, to, count,
                                                                              reach, near_tet_.data());
    for (int i = 0; i < near; ++i) {
      TetAndEdge& found = slabs.found.emplace_back(tet);
      found.point = slabs.point[begin + near_tet_[i].item];
      const int* ends = topology_.points[found.point].node;
      found.from = ends[0], found.to = ends[1];
      if (s == 0) slabs.distance.push_back(near_tet_[i].distance);  // of edges it is measured better
    }
  }
}

// What other files call.
template void Contacts<float>::refresh(const LaneView<float>&, int, int, float, float, List&);
template void Contacts<double>::refresh(const LaneView<double>&, int, int, double, double, List&);

}  // namespace limber::fem::detail
