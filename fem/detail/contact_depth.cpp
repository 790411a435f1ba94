// Contact between cages, third part: how deep a point is inside the other body, and which way leads out.
//
// Depths are those of consistent penetration depth estimation (Heidelberger, Teschner, Keiser, Müller and
// Gross 2004). A point p inside that is next to the outside looks along each of its mesh edges for the
// place e where the edge leaves the other body, and for the outward normal n of the surface there. Its
// depth d and direction r are the means
//
//     d = Σ w (e − p)·n / Σ w,              r = Σ w n / |Σ w n|,        w = 1/|e − p|².
//
// A point without such an edge takes both from its neighbours q that have them, layer by layer:
//
//     d = Σ w ((q − p)·r_q + d_q) / Σ w,    r = Σ w r_q / |Σ w r_q|,    w = 1/|q − p|².
//
// Depths are metres along r. An edge that passes over a ridge, a body that is inside entirely, and a body
// that touches itself go other ways.
//
// Tried and not kept (docs/contact.md, "Traps"): with only the edges of the surface for the walk, face on
// face leaves sideways, so edges to inner nodes count too. The rule for ridges, applied to faces that are
// not neighbours, inverted tets and lost a rollout. What falls short: depth and direction jump where
// another face becomes the nearest, so a soft slab on a static slope creeps by up to 12 mm a second.
#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/contact.h"

namespace limber::fem::detail {
namespace {

// Inward normals of a tet's faces, each twice as long as the area of its face. The volume 6V that a face
// makes with a point p grows by normal·δ when p moves by δ, so the same vectors serve as gradients. They
// sum to zero.
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

// The way from p to the nearest place of a triangle, whose normal is given. Where p is above the inside of
// the triangle the way is along the normal; else it leads to the nearest of the three edges.
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

}  // namespace

// The corners of a tet where they are now, and its inward face normals (face i is opposite to node i).
template <class Real>
struct Contacts<Real>::Cell {
  Real place[4][3], normal[4][3];

  Cell(const LaneView<Real>& view, const Topology::Tet& tet) {
    for (int i = 0; i < 4; ++i) fetch(view, tet.node[i], place[i]);
    const Real* const places[4] = {place[0], place[1], place[2], place[3]};
    face_normals(places, normal);
  }
};

// For a body that touches itself: the way out of the tet leads to the nearest of the surface faces next to
// it that look towards the faces round the point. Two parts of a body that meet do so face to face. The
// mesh edges of the point are no guide: in a fold they lead round it and out of the point's own skin.
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

// For an edge e that comes in through a surface face of normal n₁ and leaves through the neighbouring face
// of normal n₂, and so cuts off a piece of the ridge between them. The shortest way that takes the edge out
// is square to both lines. With aᵢ = |e·nᵢ| it is
//
//     direction a₂n₁ + a₁n₂ (made unit),    depth = (end − begin) a₁a₂ / |a₂n₁ + a₁n₂|,
//
// the distance of the two lines; begin and end are shares of the edge. (Both normals are square to the
// ridge, and e·n₁ < 0 < e·n₂ makes the sum square to e.) False where the two faces are not neighbours on
// the surface, and where they look away from one another, which makes the sum of normals nearly vanish.
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

// Depth and direction of the touches [first, last) of points of `from` in `into`. First the ways along mesh
// edges for all of them, then layer by layer what takes its depth from neighbours. A layer is known only
// when it is complete, so the order of points within it does not matter. What no layer reaches leaves along
// the line of centres.
template <class Real>
void Contacts<Real>::measure_depths(const LaneView<Real>& view, int from, int into, std::size_t first,
                                    std::size_t last) {
  if (first == last) return;
  constexpr Real tiny = Real(1e-12);  // m², keeps 1/distance² finite
  std::size_t unknown = 0;
  for (std::size_t i = first; i < last; ++i) {
    Contact<Real>& contact = contacts_[i];
    const Contact<Real> along_edges = leave_along_edges(view, contact);
    // An edge that lies under a flat face can come in and leave over the ridge of two faces beside it. That
    // ridge is not the way out, and the depth along mesh edges is then much smaller. (Over the ridge of a
    // wedge of 60° it is half as large, so 0.4 tells the two apart.)
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

// The touch with the mean depth and direction of all ways out along the point's mesh edges (see above). A
// kernel finds for sixteen edges at a time through which face they leave the point's own tet; where that
// face is on the surface the way ends there, else it goes on from tet to tet (walk_out). Edges whose other
// end is inside too find no way and do not count.
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

// Turns weighted sums into means, and the direction into a unit vector. False when there was nothing to
// sum, or when the directions cancelled to less than a thousandth: then depth and direction are zero, no
// force.
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

// For touches none of which is next to the outside, because their body is inside entirely. They leave along
// the line from the middle of the outer body's box to that of the inner one; straight up where the two
// coincide. The way is twice the diagonal of the outer box long, which is out in any case.
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

// Walks from p towards q through face neighbours. It begins in `tet`, come from its neighbour `before`; −1
// means that p is in `tet`. In each tet the way leaves through the face whose plane it crosses first: at
// the share nᵢ·(p − fᵢ) / −nᵢ·(q − p) of the way. True when the body's surface is met before q: `way` is
// the part of q − p up to there, `normal` the outward unit normal there.
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

// What other files call.
template void Contacts<float>::leave_nearest_face(const LaneView<float>&, int, Contact<float>&) const;
template bool Contacts<float>::leave_over_ridge(const Stretch&, const Stretch&, const float[3],
                                                Contact<float>&) const;
template void Contacts<float>::measure_depths(const LaneView<float>&, int, int, std::size_t, std::size_t);
template void Contacts<double>::leave_nearest_face(const LaneView<double>&, int, Contact<double>&) const;
template bool Contacts<double>::leave_over_ridge(const Stretch&, const Stretch&, const double[3],
                                                 Contact<double>&) const;
template void Contacts<double>::measure_depths(const LaneView<double>&, int, int, std::size_t, std::size_t);

}  // namespace limber::fem::detail
