#include "fem/detail/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

// The sides of a box that a node is beyond are bits; a place that is not finite, of a rollout that blows up:
constexpr unsigned char lost = 64;

// det(a−p, b−p, c−p), computed from the same numbers in the same order whichever tet asks.
template <class Real>
Real det_from(const Real* p, const Real* a, const Real* b, const Real* c) {
  const Real ax = a[0] - p[0], ay = a[1] - p[1], az = a[2] - p[2];
  const Real bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
  const Real cx = c[0] - p[0], cy = c[1] - p[1], cz = c[2] - p[2];
  return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
}

template <class Real>
void fetch(const LaneView<Real>& view, int node, Real out[3]) {
  for (int c = 0; c < 3; ++c) out[c] = view.x[view.state.at(node, c)];
}

// Inward normals of a tet's faces, each twice as long as the face is large: 6V of (face, p) gains normal·δ
// when p moves by δ.
template <class Real>
void face_normals(const Real* const place[4], Real normal[4][3]) {
  Real edge[3][3];
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) edge[i][c] = place[i + 1][c] - place[0][c];
  for (int i = 0; i < 3; ++i) {
    const Real *s = edge[(i + 1) % 3], *t = edge[(i + 2) % 3];
    cross(s, t, normal[i + 1]);
  }
  for (int c = 0; c < 3; ++c) normal[0][c] = -(normal[1][c] + normal[2][c] + normal[3][c]);
}

// The way from p to the nearest place of a triangle.
template <class Real>
void to_triangle(const Real p[3], const Real corner[3][3], const Real normal[3], Real way[3]) {
  Real best2 = std::numeric_limits<Real>::max();
  bool above = true;
  for (int i = 0; i < 3; ++i) {
    const Real *a = corner[i], *b = corner[(i + 1) % 3], *c = corner[(i + 2) % 3];
    Real edge[3], to_p[3], across[3], to_c[3];
    for (int k = 0; k < 3; ++k) edge[k] = b[k] - a[k], to_p[k] = p[k] - a[k], to_c[k] = c[k] - a[k];
    cross(normal, edge, across);
    above &= dot(across, to_p) * dot(across, to_c) >= 0;
    const Real length2 = dot(edge, edge);
    const Real share = length2 > 0 ? std::clamp(dot(edge, to_p) / length2, Real(0), Real(1)) : Real(0);
    Real here[3];
    for (int k = 0; k < 3; ++k) here[k] = share * edge[k] - to_p[k];
    if (const Real square = dot(here, here); square < best2) best2 = square, std::copy_n(here, 3, way);
  }
  const Real size2 = dot(normal, normal);
  if (!above || !(size2 > 0)) return;
  Real height = 0;
  for (int k = 0; k < 3; ++k) height += normal[k] * (corner[0][k] - p[k]);
  for (int k = 0; k < 3; ++k) way[k] = height / size2 * normal[k];
}

// Whether the box of p and q meets a box. What is not finite, of a rollout that blows up, meets none.
template <class Real>
bool meets(const Real* p, const Real* q, const Real lower[3], const Real upper[3]) {
  bool meet = true;
  for (int c = 0; c < 3; ++c)
    meet &=
        std::max(p[c], q[c]) >= lower[c] && std::min(p[c], q[c]) <= upper[c] && std::isfinite(p[c] + q[c]);
  return meet;
}

}  // namespace

// A tet where it is now.
template <class Real>
struct Contacts<Real>::Cell {
  Real place[4][3], normal[4][3];

  Cell(const LaneView<Real>& view, const Topology::Tet& tet) {
    for (int i = 0; i < 4; ++i) fetch(view, tet.node[i], place[i]);
    const Real* const places[4] = {place[0], place[1], place[2], place[3]};
    face_normals(places, normal);
  }
};

template <>
const Tables<float>& tables_of(const World& world) {
  return world.tables;
}
template <>
const Tables<double>& tables_of(const World& world) {
  return world.tables64;
}

template <class Real>
Contacts<Real>::Contacts(const World& world, const Kernels<Real>& kernels, int lanes)
    : world_(world),
      topology_(world.topology),
      tables_(tables_of<Real>(world)),
      kernels_(kernels),
      bodies_(int(world.bodies.size())),
      step_(Real(world.contact_dt_s)) {
  for (int a = 0; a < bodies_; ++a) {
    if (world.bodies[a].moving && world.bodies[a].self_contact) pairs_.emplace_back(a, a);
    for (int b = a + 1; b < bodies_; ++b)
      if (world.bodies[a].pushed() || world.bodies[b].pushed()) pairs_.emplace_back(a, b);
  }
  for (const Body& body : world.bodies)
    if (body.kind == BodyKind::rigid) effective_masses_.resize(world.bodies.size());
  lists_.resize(std::size_t(lanes) * pairs_.size());
  packed_.resize(std::size_t(world.nodes));
  sides_.resize(std::size_t(world.nodes));
  listed_.assign(std::size_t(world.nodes), 0);
  contact_of_node_.assign(std::size_t(world.nodes), -1);
}

template <class Real>
void Contacts<Real>::place_of(int point, const Real share[2], Real out[3]) const {
  const int* node = topology_.points[point].node;
  for (int c = 0; c < 3; ++c) out[c] = share[0] * packed_[node[0]].at[c] + share[1] * packed_[node[1]].at[c];
}

template <class Real>
void Contacts<Real>::forget(int lane) {
  for (std::size_t p = 0; p < pairs_.size(); ++p) lists_[lane * pairs_.size() + p].built = false;
}

template <class Real>
void Contacts<Real>::add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  if (!effective_masses_.empty()) return add_forces_with_rigid(lane, view, friction);
  for (const auto& [a, b] : pairs_) {
    if (view.sleeps(a) && view.sleeps(b)) continue;
    for (const Contact<Real>& contact : find(lane, view, a, b)) respond(view, a, b, contact, friction);
  }
  add_wall_forces(view, friction);
}

// The mass that a rigid body sets against a contact depends on all it has, so these are found first.
template <class Real>
void Contacts<Real>::add_forces_with_rigid(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  held_.clear();
  for (EffectiveMass& effective_mass : effective_masses_) effective_mass.depths = 0;
  for (const auto& [a, b] : pairs_) {
    if (view.sleeps(a) && view.sleeps(b)) continue;
    for (const Contact<Real>& contact : find(lane, view, a, b)) {
      if (!(contact.depth > 0)) continue;
      held_.push_back({a, b, contact});
      effective_masses_[a].depths += double(contact.depth),
          effective_masses_[b].depths += double(contact.depth);
    }
  }
  for (int body = 0; body < bodies_; ++body) {
    EffectiveMass& effective_mass = effective_masses_[body];
    if (world_.bodies[body].kind != BodyKind::rigid) continue;
    for_each_beyond_wall(view, body,
                         [&](int, int, Real, Real depth) { effective_mass.depths += double(depth); });
    if (effective_mass.depths > 0) effective_mass.measure(view, topology_.bodies[body], tables_.node_mass);
  }
  for (const Held& held : held_) respond(view, held.a, held.b, held.contact, friction);
  add_wall_forces(view, friction);
}

template <class Real>
const std::vector<Contact<Real>>& Contacts<Real>::find(int lane, const LaneView<Real>& view, int a, int b) {
  contacts_.clear();
  for (int c = 0; c < 3; ++c) {
    const int ka = (3 * a + c) * view.stride, kb = (3 * b + c) * view.stride;
    if (view.lower[ka] > view.upper[kb] || view.lower[kb] > view.upper[ka]) return contacts_;
  }
  const auto pair = std::find(pairs_.begin(), pairs_.end(), std::pair(a, b));
  List& list = lists_[lane * pairs_.size() + std::size_t(pair - pairs_.begin())];
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

// A list holds while the two bodies' nodes together have moved less than the reach it was built with; the
// tenth kept back is for rounding.
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

// Tet by tet, the points and ridges that slabs find in its box; then by point, which keeps the tets of each
// ascending.
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

// Copies the body's nodes to packed_, and finds the sides of a box, moved out by `reach`, that they are
// beyond.
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

// Whether the box of two nodes is apart from the box they were marked by, or lost.
template <class Real>
bool Contacts<Real>::apart(int node, int other) const {
  return ((sides_[node] & sides_[other]) | ((sides_[node] | sides_[other]) & lost)) != 0;
}

// Whether a tet and an edge, or vertex, of one body are no neighbours: no node of one shares a tet with a
// node of the other.
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

// Out through the nearest of the surface faces next to the tet that look towards the point's own: two parts
// of a body that meet do so face to face. (The point's mesh edges are no guide: in a fold they lead round it
// and out of the point's own skin.)
template <class Real>
void Contacts<Real>::leave_nearest_face(const LaneView<Real>& view, int index, Contact<Real>& contact) const {
  const Topology::Body& body = topology_.bodies[index];
  Real p[3], outward[3] = {0, 0, 0}, nearest2 = std::numeric_limits<Real>::max();
  place_of(contact.point, contact.share, p);
  struct Face {
    Real corner[3][3], normal[3];
  };
  const auto face_of = [&](int number) {
    Face face;
    const Topology::Tet& tet = topology_.tets[number / 4];
    for (int i = 0; i < 3; ++i) fetch(view, tet.face[number % 4][i], face.corner[i]);
    Real s[3], t[3];
    for (int c = 0; c < 3; ++c) {
      s[c] = Real(tet.sign[number % 4]) * (face.corner[1][c] - face.corner[0][c]);
      t[c] = face.corner[2][c] - face.corner[0][c];
    }
    cross(s, t, face.normal);
    return face;
  };
  for (const int node : topology_.points[contact.point].node) {
    const Lists& faces = body.self.node_faces;
    for (int k = faces.begin[node - body.first_node]; k < faces.begin[node - body.first_node + 1]; ++k) {
      const Face face = face_of(faces.items[k]);
      for (int c = 0; c < 3; ++c) outward[c] += face.normal[c];
    }
  }
  const Lists& faces = body.self.near_faces;
  const int tet = contact.tet - body.first_tet;
  for (int k = faces.begin[tet]; k < faces.begin[tet + 1]; ++k) {
    const Face face = face_of(faces.items[k]);
    if (!(dot(face.normal, outward) < 0)) continue;
    Real way[3];
    to_triangle(p, face.corner, face.normal, way);
    const Real distance2 = dot(way, way), length = std::sqrt(dot(face.normal, face.normal));
    if (!(distance2 < nearest2) || !(length > 0)) continue;
    nearest2 = distance2;
    contact.known = true;
    contact.depth = std::sqrt(distance2);
    // On the surface the way has no direction; the face has.
    const bool on_it = !(contact.depth > Real(1e-6) * std::sqrt(length));
    for (int c = 0; c < 3; ++c)
      contact.direction[c] = on_it ? face.normal[c] / length : way[c] / contact.depth;
  }
}

// Counting sort by point.
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

// Puts the points, or ridges, of a body that are near the box its nodes were marked by into slabs; false
// when there are none.
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

// What is in the tet now was within `reach` of it at build, so it was in its box and not wholly on the outer
// side of one of its planes, all moved out by `reach`.
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

// Fills awake_, ascending; the kernels write multiples of block_size.
template <class Real>
int Contacts<Real>::wake(const Near& near, Real travel) {
  const std::size_t count = near.candidates.size();
  if (awake_.size() < count + block_size) {
    awake_.resize(count + block_size);
    with_end_inside_.resize(awake_.size()), distance_.resize(awake_.size());
  }
  return kernels_.find_at_most(near.asleep_until.data(), int(count), travel, awake_.data());
}

// The first tet that contains a point, in ascending order, has it: what is on a shared face has one owner.
// Middles count where an end is inside.
template <class Real>
void Contacts<Real>::find_points(const BodyBox<Real>& box, Real reach, Real travel, Near& near) {
  const int awake = wake(near, travel);
  kernels_.middle_distances(near.candidates.data(), awake_.data(), awake, packed_[0].at, distance_.data());
  int found = -1;
  for (int i = 0; i < awake; ++i) {
    const TetAndEdge& one = near.candidates[awake_[i]];
    near.asleep_until[awake_[i]] = travel + kept * distance_[i] - rounding * reach;
    if (distance_[i] > certain * reach || one.point == found) continue;
    const bool vertex = one.from == one.to;
    if (!vertex && contact_of_node_[one.from] < 0 && contact_of_node_[one.to] < 0) continue;
    if (!find_inside(box, one)) continue;
    found = one.point;
    if (vertex) contact_of_node_[one.from] = int(contacts_.size()) - 1;
  }
}

// A ridge with an end inside counts where its middle is in a tet; one with neither is cut by the planes of
// each tet, and what is left of it is inside.
template <class Real>
void Contacts<Real>::find_edges(const BodyBox<Real>& box, Real reach, Real travel, bool itself, Near& near) {
  int awake = 0, with_end_inside = 0;
  for (int i = 0, count = wake(near, travel); i < count; ++i) {
    const int k = awake_[i];
    const bool inside =
        contact_of_node_[near.candidates[k].from] >= 0 || contact_of_node_[near.candidates[k].to] >= 0;
    with_end_inside_[with_end_inside] = awake_[awake] = k;
    with_end_inside += inside, awake += !inside;
  }
  kernels_.middle_distances(near.candidates.data(), with_end_inside_.data(), with_end_inside, packed_[0].at,
                            distance_.data());
  int found = -1;
  for (int i = 0; i < with_end_inside; ++i) {
    const TetAndEdge& one = near.candidates[with_end_inside_[i]];
    if (distance_[i] > certain * reach || one.point == found || !find_inside(box, one)) continue;
    found = one.point;
  }
  if (itself) return;
  kernels_.edge_distances(near.candidates.data(), awake_.data(), awake, packed_[0].at, distance_.data());
  int cut = 0;
  for (int i = 0; i < awake; ++i) {
    const int k = awake_[i];
    near.asleep_until[k] = travel + kept * distance_[i] - rounding * reach;
    awake_[cut] = k;
    cut += !(distance_[i] > certain * reach);
  }
  stretches_.clear();
  for (int i = 0; i < cut; ++i) {
    const TetAndEdge& one = near.candidates[awake_[i]];
    const Real *p = packed_[one.from].at, *q = packed_[one.to].at;
    cut_edge(p, q, one.tet);
    if (i + 1 < cut && near.candidates[awake_[i + 1]].point == one.point) continue;
    if (!stretches_.empty() && meets(p, q, box.lower, box.upper)) touch_of_stretches(one.point);
    stretches_.clear();
  }
}

// Whether the vertex, or the middle of the edge, is in the tet: then appends the touch.
template <class Real>
bool Contacts<Real>::find_inside(const BodyBox<Real>& box, const TetAndEdge& one) {
  const Topology::Point& point = topology_.points[one.point];
  Contact<Real> contact{one.point, one.tet, {Real(point.share[0]), Real(point.share[1])}, {}, 0, {0, 0, 0},
                        false,     false};
  Real p[3], sum = 0;
  place_of(one.point, contact.share, p);
  if (!meets(p, p, box.lower, box.upper)) return false;
  const Topology::Tet& tet = topology_.tets[one.tet];
  for (int i = 0; i < 4; ++i) {
    const int* face = tet.face[i];
    contact.weight[i] =
        Real(tet.sign[i]) * det_from(p, packed_[face[0]].at, packed_[face[1]].at, packed_[face[2]].at);
    if (!(contact.weight[i] >= 0)) return false;
    sum += contact.weight[i];
  }
  if (!(sum > 0)) return false;
  for (Real& w : contact.weight) w /= sum;
  contacts_.push_back(contact);
  return true;
}

// Appends the part of the edge that is in the tet to stretches_.
template <class Real>
void Contacts<Real>::cut_edge(const Real* p, const Real* q, int index) {
  const Topology::Tet& tet = topology_.tets[index];
  Stretch s{index, -1, -1, 0, 1, {}, {}};
  Real sum = 0;
  for (int i = 0; i < 4 && s.begin < s.end; ++i) {
    const int* face = tet.face[i];
    const auto side = [&](const Real* at) {
      return Real(tet.sign[i]) * det_from(at, packed_[face[0]].at, packed_[face[1]].at, packed_[face[2]].at);
    };
    const Real at_p = side(p), at_q = side(q);
    s.at_begin[i] = at_p, s.at_end[i] = at_q;
    sum += at_p;
    if ((at_p < 0) == (at_q < 0)) {
      if (at_p < 0) s.end = 0;
      continue;
    }
    const Real cut = at_p / (at_p - at_q);
    if (at_p < 0 && cut > s.begin) s.begin = cut, s.entry = i;
    if (at_q < 0 && cut < s.end) s.end = cut, s.exit = i;
  }
  if (s.begin < s.end && sum > 0) stretches_.push_back(s);
}

// The longest stretch, and what joins it on both sides (a face cuts the edge at the same number whichever tet
// asks), is one way through; the touch is in its middle.
template <class Real>
void Contacts<Real>::touch_of_stretches(int point) {
  const Stretch* first = &stretches_[0];
  for (const Stretch& s : stretches_)
    if (s.end - s.begin > first->end - first->begin) first = &s;
  const Stretch *last = first, *longest = first;
  for (std::size_t i = 0; i < stretches_.size(); ++i)
    for (const Stretch& s : stretches_) {
      if (s.end == first->begin) first = &s;
      if (s.begin == last->end) last = &s;
    }
  const Real middle = (first->begin + last->end) / 2;
  const Stretch* owner = longest;
  for (const Stretch& s : stretches_)
    if (s.begin <= middle && middle <= s.end) owner = &s;
  Contact<Real> contact{point, owner->tet, {1 - middle, middle}, {}, 0, {0, 0, 0}, false, true};
  Real sum = 0;
  for (int i = 0; i < 4; ++i) {
    contact.weight[i] = contact.share[0] * owner->at_begin[i] + contact.share[1] * owner->at_end[i];
    sum += contact.weight[i];
  }
  for (Real& w : contact.weight) w /= sum;
  const int* node = topology_.points[point].node;
  Real way[3];
  for (int c = 0; c < 3; ++c) way[c] = packed_[node[1]].at[c] - packed_[node[0]].at[c];
  contact.known = leave_over_ridge(*first, *last, way, contact);
  contacts_.push_back(contact);
}

// An edge e that comes in through a face of normal n₁ and leaves through the next, of n₂, cuts off a piece of
// the edge between them: the shortest way out is square to both, along a₂n₁ + a₁n₂ with aᵢ = |e·nᵢ|, and as
// long as the lines' distance, (end − begin) a₁a₂/|a₂n₁ + a₁n₂|. False for other faces, and for two that look
// away from one another.
template <class Real>
bool Contacts<Real>::leave_over_ridge(const Stretch& first, const Stretch& last, const Real way[3],
                                      Contact<Real>& contact) const {
  constexpr Real least = Real(0.2);
  if (first.entry < 0 || last.exit < 0) return false;
  const Topology::Tet &in = topology_.tets[first.tet], &out = topology_.tets[last.tet];
  if (in.across[first.entry] >= 0 || out.across[last.exit] >= 0) return false;
  int shared = 0;
  for (int i : in.face[first.entry])
    for (int j : out.face[last.exit]) shared += i == j;
  if (shared != 2) return false;
  Real normal[2][3], across[2];
  for (int k = 0; k < 2; ++k) {
    const int* face = k == 0 ? in.face[first.entry] : out.face[last.exit];
    const Real sign = Real(k == 0 ? in.sign[first.entry] : out.sign[last.exit]);
    const Real *a = packed_[face[0]].at, *b = packed_[face[1]].at, *c = packed_[face[2]].at;
    const Real s[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, t[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    cross(s, t, normal[k]);
    const Real length = std::sqrt(dot(normal[k], normal[k]));
    if (!(length > 0)) return false;
    for (Real& n : normal[k]) n *= sign / length;
    across[k] = std::abs(dot(way, normal[k]));
  }
  Real ridge[3];
  for (int c = 0; c < 3; ++c) ridge[c] = across[1] * normal[0][c] + across[0] * normal[1][c];
  const Real length = std::sqrt(dot(ridge, ridge));
  if (!(length > least * (across[0] + across[1]))) return false;
  contact.depth = (last.end - first.begin) * across[0] * across[1] / length;
  for (int c = 0; c < 3; ++c) contact.direction[c] = ridge[c] / length;
  return true;
}

// Consistent penetration depth (Heidelberger, Teschner, Keiser, Müller, Gross 2004): vertices next to the
// outside measure depth and direction where their edges leave the other body; the others take them from those
// neighbours, layer by layer.
template <class Real>
void Contacts<Real>::measure_depths(const LaneView<Real>& view, int from, int into, std::size_t first,
                                    std::size_t last) {
  if (first == last) return;
  constexpr Real tiny = Real(1e-12);  // m², keeps 1/distance² finite
  std::size_t unknown = 0;
  for (std::size_t i = first; i < last; ++i) {
    Contact<Real>& contact = contacts_[i];
    const Contact<Real> along_edges = leave_along_edges(view, contact);
    // An edge that lies under a flat face can come in and leave over the ridge of two faces beside it: then
    // that ridge is not the way out. (Over the ridge of a wedge of 60° the other depth is half as large.)
    const bool elsewhere = along_edges.known && along_edges.depth < Real(0.4) * contact.depth;
    if (!contact.known || elsewhere) contact = along_edges;
    unknown += !contact.known;
  }
  std::vector<std::size_t> layer;
  while (unknown > 0) {
    layer.clear();
    for (std::size_t i = first; i < last; ++i) {
      Contact<Real>& contact = contacts_[i];
      if (contact.known) continue;
      const Topology::Point& point = topology_.points[contact.point];
      Real p[3], sum = 0;
      place_of(contact.point, contact.share, p);
      for (int k = point.neighbor_begin; k < point.neighbor_end; ++k) {
        const int other = contact_of_node_[topology_.neighbors[k]];
        if (other < 0 || !contacts_[other].known) continue;
        Real way[3];
        fetch(view, topology_.neighbors[k], way);
        for (int c = 0; c < 3; ++c) way[c] -= p[c];
        const Real weight = 1 / (dot(way, way) + tiny);
        sum += weight;
        contact.depth += weight * (dot(way, contacts_[other].direction) + contacts_[other].depth);
        for (int c = 0; c < 3; ++c) contact.direction[c] += weight * contacts_[other].direction[c];
      }
      if (finish(contact, sum)) layer.push_back(i);
    }
    for (std::size_t i : layer) contacts_[i].known = true;
    unknown -= layer.size();
    if (layer.empty()) break;
  }
  if (unknown > 0) leave_along_centers(view, from, into, first, last);
  for (std::size_t i = first; i < last; ++i)
    contact_of_node_[topology_.points[contacts_[i].point].node[0]] = -1;
}

// The touch with the mean depth and direction of all ways out along mesh edges, weighted by 1/distance².
template <class Real>
Contact<Real> Contacts<Real>::leave_along_edges(const LaneView<Real>& view, Contact<Real> contact) {
  constexpr Real tiny = Real(1e-12);  // m², keeps 1/distance² finite
  contact.depth = 0;
  for (Real& d : contact.direction) d = 0;
  const Topology::Point& point = topology_.points[contact.point];
  const Topology::Tet& tet = topology_.tets[contact.tet];
  const Cell cell(view, tet);
  WayOut<Real> from;
  place_of(contact.point, contact.share, from.place);
  Real outward[4][3];
  for (int i = 0; i < 4; ++i) {
    const Real* on_face = cell.place[(i + 1) % 4];
    const Real from_face[3] = {from.place[0] - on_face[0], from.place[1] - on_face[1],
                               from.place[2] - on_face[2]};
    from.height[i] = dot(cell.normal[i], from_face);
    const Real length = std::sqrt(dot(cell.normal[i], cell.normal[i]));
    for (int c = 0; c < 3; ++c) {
      from.normal[i][c] = cell.normal[i][c];
      outward[i][c] = -cell.normal[i][c] / length;
    }
  }
  const int count = point.neighbor_end - point.neighbor_begin;
  for (auto& at : ends_)
    if (int(at.size()) < count + block_size) at.resize(std::size_t(count + block_size));
  if (int(share_.size()) < count + block_size)
    share_.resize(std::size_t(count + block_size)), exit_.resize(share_.size());
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c)
      ends_[c][k] = view.x[view.state.at(topology_.neighbors[point.neighbor_begin + k], c)];
  kernels_.exits(from, ends_[0].data(), ends_[1].data(), ends_[2].data(), count, share_.data(), exit_.data());
  Real sum = 0;
  for (int k = 0; k < count; ++k) {
    const int exit = exit_[k];
    if (exit < 0) continue;
    const Real end[3] = {ends_[0][k], ends_[1][k], ends_[2][k]};
    Real way[3], normal[3];
    if (const int next = tet.across[exit]; next < 0) {
      const Real share = std::max(share_[k], Real(0));
      for (int c = 0; c < 3; ++c) way[c] = share * (end[c] - from.place[c]), normal[c] = outward[exit][c];
    } else if (!walk_out(view, next, contact.tet, from.place, end, way, normal)) {
      continue;
    }
    const Real weight = 1 / (dot(way, way) + tiny);
    sum += weight;
    contact.depth += weight * dot(way, normal);
    for (int c = 0; c < 3; ++c) contact.direction[c] += weight * normal[c];
  }
  contact.known = finish(contact, sum);
  return contact;
}

// Divides the weighted sums; false when there was nothing to sum, or the directions cancelled.
template <class Real>
bool Contacts<Real>::finish(Contact<Real>& contact, Real sum) {
  const Real length = std::sqrt(dot(contact.direction, contact.direction));
  if (sum > 0 && length > Real(1e-3) * sum) {
    contact.depth /= sum;
    for (Real& d : contact.direction) d /= length;
    return true;
  }
  contact.depth = 0;
  for (Real& d : contact.direction) d = 0;
  return false;
}

// A patch of points none of which is next to the outside: the whole body is inside. It leaves along the
// line of the two boxes' centres.
template <class Real>
void Contacts<Real>::leave_along_centers(const LaneView<Real>& view, int from, int into, std::size_t first,
                                         std::size_t last) {
  Real line[3], size2 = 0;
  for (int c = 0; c < 3; ++c) {
    const int kf = (3 * from + c) * view.stride, ki = (3 * into + c) * view.stride;
    line[c] = (view.lower[kf] + view.upper[kf]) - (view.lower[ki] + view.upper[ki]);
    size2 += (view.upper[ki] - view.lower[ki]) * (view.upper[ki] - view.lower[ki]);
  }
  if (!(dot(line, line) > Real(1e-8) * size2)) line[0] = 0, line[1] = 0, line[2] = 1;
  const Real scale = 2 * std::sqrt(size2 / dot(line, line));
  for (std::size_t i = first; i < last; ++i) {
    Contact<Real>& contact = contacts_[i];
    if (contact.known) continue;
    Real p[3], far[3], way[3], normal[3];
    place_of(contact.point, contact.share, p);
    for (int c = 0; c < 3; ++c) far[c] = p[c] + scale * line[c];
    contact.known = walk_out(view, contact.tet, -1, p, far, way, normal);
    if (!contact.known) continue;
    contact.depth = dot(way, normal);
    std::copy_n(normal, 3, contact.direction);
  }
}

// From p towards q through face neighbours, beginning in `tet`, come from its neighbour `before` (−1: p is in
// it). True when the body's surface is met first: `way` is the part of q − p up to there, `normal` the
// outward unit normal.
template <class Real>
bool Contacts<Real>::walk_out(const LaneView<Real>& view, int tet, int before, const Real p[3],
                              const Real q[3], Real way[3], Real normal[3]) const {
  constexpr int max_tets = 256;  // inverted tets can lead in circles
  const Real move[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
  for (int walked = 0; walked < max_tets; ++walked) {
    const Cell cell(view, topology_.tets[tet]);
    Real soonest = 1;
    int exit = -1;
    for (int i = 0; i < 4; ++i) {
      const Real change = dot(cell.normal[i], move);
      if ((before >= 0 && topology_.tets[tet].across[i] == before) || !(change < 0)) continue;
      const Real* on_face = cell.place[(i + 1) % 4];
      const Real from_face[3] = {p[0] - on_face[0], p[1] - on_face[1], p[2] - on_face[2]};
      const Real when = dot(cell.normal[i], from_face) / -change;
      if (when < soonest) soonest = when, exit = i;
    }
    if (exit < 0) return false;
    const int next = topology_.tets[tet].across[exit];
    if (next < 0) {
      const Real length = std::sqrt(dot(cell.normal[exit], cell.normal[exit]));
      const Real share = std::max(soonest, Real(0));
      for (int c = 0; c < 3; ++c) way[c] = share * move[c], normal[c] = -cell.normal[exit][c] / length;
      return true;
    }
    before = tet;
    tet = next;
  }
  return false;
}

template <class Real>
void Contacts<Real>::respond(const LaneView<Real>& view, int a, int b, const Contact<Real>& contact,
                             Friction<Real>* friction) const {
  if (!(contact.depth > 0)) return;
  const Topology::Point& point = topology_.points[contact.point];
  const int* corner = topology_.tets[contact.tet].node;
  const int node[6] = {point.node[0], point.node[1], corner[0], corner[1], corner[2], corner[3]};
  const Real share[6] = {contact.share[0],   contact.share[1],   -contact.weight[0],
                         -contact.weight[1], -contact.weight[2], -contact.weight[3]};
  Real relative[3] = {0, 0, 0}, place[3] = {0, 0, 0};
  for (int i = 0; i < 6; ++i)
    for (int c = 0; c < 3; ++c) {
      relative[c] += share[i] * view.v[view.state.at(node[i], c)];
      if (i < 2) place[c] += share[i] * view.x[view.state.at(node[i], c)];
    }
  const bool of_a = node[0] >= topology_.bodies[a].first_node && node[0] < topology_.bodies[a].last_node;
  const int side[2] = {of_a ? a : b, of_a ? b : a};  // whose point, whose tet
  Real inverse_mass = 0;                             // of what is not rigid
  for (int i = 0; i < 6; ++i)
    if (world_.bodies[side[i >= 2]].kind != BodyKind::rigid)
      inverse_mass += share[i] * share[i] * tables_.inverse_mass[node[i]];
  const bool any_rigid = world_.bodies[a].kind == BodyKind::rigid || world_.bodies[b].kind == BodyKind::rigid;
  if (!any_rigid && !(inverse_mass > 0)) return;
  for (const int body : side)
    if (world_.bodies[body].kind == BodyKind::rigid)
      inverse_mass += Real(effective_masses_[body].inverse_mass(place, contact.direction, contact.depth));
  const Real beta = Real(point.share[1] > 0 ? contact_edge_beta : contact_beta);
  const Real push =
      penalty_push(beta, contact.depth, dot(relative, contact.direction), 1 / inverse_mass, step_);
  if (!(push > 0)) return;
  Real force[3];
  for (int c = 0; c < 3; ++c) force[c] = push * contact.direction[c];
  for (int i = 0; i < 6; ++i)
    if (tables_.inverse_mass[node[i]] > 0)
      for (int c = 0; c < 3; ++c) view.f[view.force.at(node[i], c)] += share[i] * force[c];
  if (records_)
    records_->push_back(
        {side[0], side[1], {place[0], place[1], place[2]}, contact.depth, {force[0], force[1], force[2]}});
  if (!friction) return;
  Share<Real> shares[6];
  for (int i = 0; i < 6; ++i) shares[i] = {node[i], share[i]};
  friction->add(side[0], side[1], place, contact.direction, tables_.pair_friction[a * bodies_ + b] * push,
                shares, shares + 2, shares + 6, records_ ? int(records_->size()) - 1 : -1);
}

// Calls each(node, axis, the wall's normal along it, depth).
template <class Real>
template <class Each>
void Contacts<Real>::for_each_beyond_wall(const LaneView<Real>& view, int body, const Each& each) const {
  if (!world_.walls || !topology_.bodies[body].pushed) return;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const Real out = side == 0 ? Real(1) : Real(-1);
      const Real wall = Real(side == 0 ? world_.bounds_m.lower[axis] : world_.bounds_m.upper[axis]);
      const Real* reach = side == 0 ? view.lower : view.upper;
      if (!(out * (wall - reach[(3 * body + axis) * view.stride]) > 0)) continue;
      for (int n : topology_.bodies[body].surface_nodes) {
        const Real depth = out * (wall - view.x[view.state.at(n, axis)]);
        if (depth > 0 && tables_.inverse_mass[n] > 0) each(n, axis, out, depth);
      }
    }
}

template <class Real>
void Contacts<Real>::add_wall_forces(const LaneView<Real>& view, Friction<Real>* friction) const {
  for (int body = 0; body < bodies_; ++body) {
    if (view.sleeps(body)) continue;
    const bool rigid = world_.bodies[body].kind == BodyKind::rigid;
    for_each_beyond_wall(view, body, [&](int n, int axis, Real out, Real depth) {
      Real normal[3] = {0, 0, 0}, place[3];
      normal[axis] = out;
      fetch(view, n, place);
      const Real mass =
          rigid ? Real(1 / effective_masses_[body].inverse_mass(place, normal, depth)) : tables_.node_mass[n];
      const Real push =
          penalty_push(Real(contact_beta), depth, out * view.v[view.state.at(n, axis)], mass, step_);
      if (!(push > 0)) return;
      view.f[view.force.at(n, axis)] += out * push;
      if (records_)
        records_->push_back({body,
                             -1,
                             {place[0], place[1], place[2]},
                             depth,
                             {push * normal[0], push * normal[1], push * normal[2]}});
      if (!friction) return;
      const Share<Real> share{n, 1};
      friction->add(body, -1, place, normal, tables_.pair_friction[body * bodies_ + body] * push, &share,
                    &share + 1, &share + 1, records_ ? int(records_->size()) - 1 : -1);
    });
  }
}

template class Contacts<float>;
template class Contacts<double>;

}  // namespace limber::fem::detail
