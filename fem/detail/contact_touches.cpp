// Contact between cages, second part: which candidates touch now. A vertex touches where it is inside a
// tet. A surface edge touches in its middle where one of its ends is inside; a ridge with no end inside is
// cut by the planes of the tets near it, and touches in the middle of the stretch that is inside.
//
// What always holds: a face of a mesh is one plane, whichever of its two tets asks. Its three nodes are
// taken in ascending order, so both tets compute the same determinant from the same numbers in the same
// order and differ in its sign alone. So nothing falls between two tets, and what is on their shared face
// is in both: the first tet, ascending, has it. The exact tests see only what a lower bound of the distance
// leaves, which throws out nearly all candidates, sixteen at a time.
//
// Why edges, and not vertices alone (docs/contact.md, "Traps"): with vertices alone a coarse cube sank 13
// to 17 % of its size into the rim of a plate, with middles of edges 3 to 6 %, with edges that pass through
// 1.7 %. With the passing edges of only one of the two bodies it was 7 % again. Ridges are edges whose
// faces turn outwards by 3° or more: a ball thrown at 12 m/s goes 4 mm into the edge of a slit with those,
// 3 mm with all edges, and 11 mm with ridges from 15° on.
#include <algorithm>
#include <cmath>

#include "fem/detail/contact.h"
#include "fem/detail/list_margins.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

// det(a − p, b − p, c − p), in m³: six times the volume of the tet p a b c, positive on one side of the
// face and negative on the other. It is computed from the same numbers in the same order whichever tet
// asks.
template <class Real>
Real det_from(const Real* p, const Real* a, const Real* b, const Real* c) {
  const Real ax = a[0] - p[0], ay = a[1] - p[1], az = a[2] - p[2];
  const Real bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
  const Real cx = c[0] - p[0], cy = c[1] - p[1], cz = c[2] - p[2];
  return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
}

// Whether the box of p and q meets a box. What is not finite, in a rollout that diverges, meets none.
template <class Real>
bool meets(const Real* p, const Real* q, const Real lower[3], const Real upper[3]) {
  bool meet = true;
  for (int c = 0; c < 3; ++c)
    meet &=
        std::max(p[c], q[c]) >= lower[c] && std::min(p[c], q[c]) <= upper[c] && std::isfinite(p[c] + q[c]);
  return meet;
}

}  // namespace

// Fills awake_ with the candidates whose time has come, ascending, and returns how many they are. The
// arrays are longer than they need be because kernels write multiples of block_size.
template <class Real>
int Contacts<Real>::wake(const Near& near, Real travel) {
  const std::size_t count = near.candidates.size();
  if (awake_.size() < count + block_size) {
    awake_.resize(count + block_size);
    with_end_inside_.resize(awake_.size()), distance_.resize(awake_.size());
  }
  return kernels_.find_at_most(near.asleep_until.data(), int(count), travel, awake_.data());
}

// Vertices, and middles of flat edges, that are inside a tet. Each candidate that is awake is measured and
// sent to sleep for as long as its distance allows; what is nearer than `certain` times the reach is tested
// exactly. Candidates are sorted by point, so once a point is found the rest of its tets is passed over.
// Vertices come first: contact_of_node_ then tells which of them are inside, and an edge counts only where
// one of its ends is.
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

// Ridges. One with an end inside counts where its middle is in a tet. One with no end inside may pass
// through: it is cut by the planes of each tet near it, and what is left of it is inside. `itself`: a body
// with itself, where passing edges are not looked for. The candidates of an edge follow one another, so its
// stretches are complete when the next candidate is of another edge.
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

// Whether the vertex, or the middle of the edge, is inside the tet; if so, appends the touch. The
// barycentric weight of node i is the part of the tet's volume that the face opposite to i makes with p:
//
//     λᵢ = sᵢ det(fᵢ₀ − p, fᵢ₁ − p, fᵢ₂ − p) / Σⱼ sⱼ det(…),   sᵢ = ±1 as the face is oriented.
//
// p is inside where no weight is negative. The zero counts as inside, in both tets of a shared face.
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

// Appends the part of the edge from p to q that is inside the tet to stretches_. Along the edge each face's
// determinant is linear, from at_p to at_q, so it vanishes at the share at_p/(at_p − at_q) of the way. The
// stretch begins at the last face that lets the edge in and ends at the first that lets it out. Flat and
// inverted tets (sum ≤ 0) hold nothing.
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

// Makes one touch of the stretches of an edge. The longest stretch and those that join it on both sides are
// one way through the body; two tets cut the edge at the same number, so ends are compared for equality.
// The touch is in the middle of the way through, with the weights of the tet that holds the middle. Weights
// are linear along the edge. The depth of an edge that passes over a ridge is known at once
// (leave_over_ridge).
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

// What other files call.
template void Contacts<float>::find_points(const BodyBox<float>&, float, float, Near&);
template void Contacts<float>::find_edges(const BodyBox<float>&, float, float, bool, Near&);
template void Contacts<double>::find_points(const BodyBox<double>&, double, double, Near&);
template void Contacts<double>::find_edges(const BodyBox<double>&, double, double, bool, Near&);

}  // namespace limber::fem::detail
