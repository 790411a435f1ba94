// Contact on fine surfaces, second part: which samples are within the offset of a surface, and how deep.
//
// A sample p in a tet with barycentric weights λ is at rest at X = Σ λᵢ Xᵢ. There φ(X) is the distance to
// the surface, and through the deformation gradient F of the tet its gradient becomes g:
//
//     g = F⁻ᵀ ∇φ = Σᵢ (∇φ·(Xᵢ − X₀)) ∇λᵢ,   distance = φ|∇φ|/|g| along n = g/|g|,   depth = offset −
//     distance.
//
// g is exact within a tet, the distance to first order: the nearer the surface, the better. Depths are metres
// along the unit normal n, which points out of the body whose surface it is. φ/|g| would divide by |∇φ| what
// is a distance already: that is less exact (docs/contact-measured.md), in slits finer than the field's
// cells 3 mm for a tenth, and jumps where |∇φ| does, at borders of cells: a node that a sample hangs on got
// more speed there than it came with, and trembled for ever.
//
// Where Phong Deformation bends the surface, X is found by Newton's method and F is the mean F̄ = Σ λᵢ Fᵢ
// of the nodes', so g does not jump at borders of tets. What a bend moves farther than a body's `bulge` may
// be missed.
//
// Tried and not kept (docs/contact.md): two steps of Newton alone pressed through 6 % of air at strong
// bends. Without gain: a plane over the surface in each core; letting what is in a core sleep until the
// field there says that it may touch; one frame of gradients for each tet and step; a bound of bends by
// direction.
#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/detail/surface_contact.h"
#include "fem/detail/surface_places.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

}  // namespace

// The touches of samples of `from` in `into`. Candidates that are awake are measured against their cores
// and sleep anew. Several cores may hold a sample, since cores reach over their tets by twice the offset.
// The tet that has it is the one in which its least barycentric coordinate is largest: the one that holds
// it, or, just outside of the cage, the nearest. Each sample touches once.
template <class Real>
void SurfaceContacts<Real>::find_in(const LaneView<Real>& view, int from, int into, Real reach, Real travel,
                                    Near& near) {
  const std::size_t count = near.candidates.size();
  if (awake_.size() < count + block_size) awake_.resize(count + block_size), distance_.resize(awake_.size());
  const int awake = kernels_.find_at_most(near.asleep_until.data(), int(count), travel, awake_.data());
  for (int i = 0; i < awake; ++i) {
    find_core(view, near.candidates[awake_[i]].tet);
    sample_place(view, near.candidates[awake_[i]].point);
  }
  kernels_.middle_distances(near.candidates.data(), awake_.data(), awake, &places_[0].at[0],
                            distance_.data());
  for (int i = 0; i < awake;) {
    const int sample = near.candidates[awake_[i]].point;
    const Real* place = places_[row_of_sample(sample)].at;
    const Real own_bulge = sample_bulge(view, from, sample);
    int best = -1;
    Real best_weight[4], best_min = -std::numeric_limits<Real>::max();
    for (; i < awake && near.candidates[awake_[i]].point == sample; ++i) {
      const int tet = near.candidates[awake_[i]].tet;
      const Real bulge = own_bulge + bulge_of(view, into, tet);
      near.asleep_until[awake_[i]] = travel + kept * (distance_[i] - bulge) - rounding * reach;
      if (distance_[i] > bulge + certain * reach) continue;
      Real weight[4];
      if (!barycentric(view, tet, place, weight) || !near_core(view, tet, place, weight, bulge)) continue;
      const Real least = std::min(std::min(weight[0], weight[1]), std::min(weight[2], weight[3]));
      if (!(least > best_min)) continue;
      best = tet, best_min = least;
      std::copy_n(weight, 4, best_weight);
    }
    if (best >= 0) measure(view, from, into, sample, best, best_weight);
  }
}

// Whether a place is within `out`, metres, of the core of a tet. Its weights decide where `out` is 0. Else
// it may lie beyond no side of the core's box and no plane of the core by more than `out`: the plane i is
// where λᵢ = lᵢ, and 6V (lᵢ − λᵢ) / |nᵢ| is how far the place lies beyond it, with nᵢ = 6V ∇λᵢ.
template <class Real>
bool SurfaceContacts<Real>::near_core(const LaneView<Real>& view, int tet, const Real place[3],
                                      const Real weight[4], Real out) {
  const typename Tables::Core& core = surface_.cores[tet];
  bool inside = true;
  for (int i = 0; i < 4; ++i) inside &= weight[i] >= core.least[i];
  if (inside || out == 0) return inside;
  const Place* at = &places_[row_of_core(tet)];
  for (int c = 0; c < 3; ++c)
    if (place[c] < std::min(std::min(at[0].at[c], at[1].at[c]), std::min(at[2].at[c], at[3].at[c])) - out ||
        place[c] > std::max(std::max(at[0].at[c], at[1].at[c]), std::max(at[2].at[c], at[3].at[c])) + out)
      return false;
  const int* node = topology_.tets[tet].node;
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[4][3];
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) edge[i][c] = corner[i + 1][c] - corner[0][c];
  for (int i = 0; i < 3; ++i) cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal[i + 1]);
  for (int c = 0; c < 3; ++c) normal[0][c] = normal[1][c] + normal[2][c] + normal[3][c];
  const Real volume6 = dot(normal[1], edge[0]);
  for (int i = 0; i < 4; ++i)
    if ((core.least[i] - weight[i]) * volume6 > out * std::sqrt(dot(normal[i], normal[i]))) return false;
  return true;
}

// Barycentric weights of a place in a tet where it is now: λᵢ = nᵢ·(p − x₀)/6V for i = 1, 2, 3, and λ₀ what
// is left to 1. False in a tet that is flat or inverted.
template <class Real>
bool SurfaceContacts<Real>::barycentric(const LaneView<Real>& view, int tet, const Real place[3],
                                        Real weight[4]) {
  const int* node = topology_.tets[tet].node;
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[3], p[3];
  for (int c = 0; c < 3; ++c) {
    p[c] = place[c] - corner[0][c];
    for (int i = 0; i < 3; ++i) edge[i][c] = corner[i + 1][c] - corner[0][c];
  }
  Real volume6 = 0;
  weight[0] = 1;
  for (int i = 0; i < 3; ++i) {
    cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal);
    if (i == 0) volume6 = dot(normal, edge[0]);
    if (!(volume6 > 0)) return false;
    weight[i + 1] = dot(normal, p) / volume6;
    weight[0] -= weight[i + 1];
  }
  return true;
}

// How far the surface of a body is from the place of these weights, and along which normal, in a tet that
// deforms linearly: the formulas at the top of this file. False where the field has no slope to speak of.
template <class Real>
bool SurfaceContacts<Real>::find_surface(const LaneView<Real>& view, int body, int tet, const Real weight[4],
                                         Surface& found) {
  const int* node = topology_.tets[tet].node;
  const Real* rest = tables_.rest_positions.data();
  Real at_rest[3] = {0, 0, 0}, gradient[3];
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const Real distance = surface_.bodies[body].field.at(at_rest, gradient);
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[3], now[3] = {0, 0, 0}, volume6 = 0;
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) edge[i][c] = corner[i + 1][c] - corner[0][c];
  for (int i = 0; i < 3; ++i) {
    cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal);
    if (i == 0) volume6 = dot(normal, edge[0]);
    Real rise = 0;
    for (int c = 0; c < 3; ++c) rise += gradient[c] * (rest[3 * node[i + 1] + c] - rest[3 * node[0] + c]);
    for (int c = 0; c < 3; ++c) now[c] += rise / volume6 * normal[c];
  }
  return found.set(distance, gradient, now);
}

// The same of a surface that Phong Deformation bends. Looks for the weights λ at which x(λ) = Σ λᵢ xᵢ +
// bend(λ) is the place p, from those of linear deformation on:
//
//     off = p − x(λ),    ΔX = F̄⁻¹ off,    λᵢ += ∇λᵢ·ΔX  (∇λᵢ at rest),
//
// two times at least and six at most, until |off| is no more than a twentieth of the offset plus a
// thousandth of the skin. F̄ stands for the derivative of x(X). False where F̄ is nearly flat or inverted
// (det F̄ ≤ 0.01), and where six steps do not do. `weight` becomes that of the place found. The rows of
// F̄⁻¹ also give g = F̄⁻ᵀ ∇φ.
template <class Real>
bool SurfaceContacts<Real>::find_bent_surface(const LaneView<Real>& view, int body, int tet,
                                              const Place& place, Real weight[4], Surface& found) {
  constexpr int usual_steps = 2, max_steps = 6;
  constexpr Real thin = Real(1e-2);
  const int* node = topology_.tets[tet].node;
  const Real* weight_gradient = &surface_.weight_gradients[9 * std::size_t(tet)];
  const Bends& bends = bends_of(view, tet);
  const Real exact = surface_.wall_slack + Real(1e-3) * tables_.skin[body];
  Place row[3];  // of the inverse of the deformation gradient
  for (int step = 0;; ++step) {
    Place column[3], off;
    for (Place& c : column) c.row = Row{};
    off.row = place.row - bend(bends, weight).row;
    for (int i = 0; i < 4; ++i) {
      const Slopes& slopes = slopes_at(view, node[i]);
      for (int c = 0; c < 3; ++c) column[c].row += weight[i] * slopes.column[c].row;
      off.row -= weight[i] * node_place(view, node[i]).row;
    }
    for (int c = 0; c < 3; ++c)
      cross(column[(c + 1) % 3].at, column[(c + 2) % 3].at, row[c].at), row[c].at[3] = 0;
    const Real volume = dot(row[0].at, column[0].at);
    if (!(volume > thin)) return false;
    for (int c = 0; c < 3; ++c) row[c].row *= 1 / volume;
    if (step >= usual_steps && dot(off.at, off.at) <= exact * exact) break;
    if (step == max_steps) return false;
    Real way[3];
    for (int c = 0; c < 3; ++c) way[c] = dot(row[c].at, off.at);
    for (int i = 0; i < 3; ++i) {
      const Real more = dot(weight_gradient + 3 * i, way);
      weight[i + 1] += more, weight[0] -= more;
    }
  }
  const Real* rest = tables_.rest_positions.data();
  Real at_rest[3] = {0, 0, 0}, gradient[3], now[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const Real distance = surface_.bodies[body].field.at(at_rest, gradient);
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) now[c] += gradient[i] * row[i].at[c];
  return found.set(distance, gradient, now);
}

// Whether a place at rest lies in the box of a tet, or no farther out than `slack`, metres. Cores have long
// corners, and where tets fold away from one another these reach through air: up to 35 mm off a plate of
// barriers1 without this.
template <class Real>
bool SurfaceContacts<Real>::is_beside(int tet, const Real weight[4], Real slack) const {
  const int* node = topology_.tets[tet].node;
  const Real* rest = tables_.rest_positions.data();
  for (int c = 0; c < 3; ++c) {
    Real at = 0, lower = rest[3 * node[0] + c], upper = lower;
    for (int i = 0; i < 4; ++i) {
      const Real x = rest[3 * node[i] + c];
      at += weight[i] * x, lower = std::min(lower, x), upper = std::max(upper, x);
    }
    if (!(at >= lower - slack && at <= upper + slack)) return false;
  }
  return true;
}

// Measures a sample of `from` in a tet of `into`, and appends a touch where it is nearer to the surface
// than the offset, or below it. Where something bends, the sample is first measured as if nothing did: most
// candidates are too far off then, whichever way the bends go, and end there. Only then come the exact place
// and Newton's method.
template <class Real>
bool SurfaceContacts<Real>::measure(const LaneView<Real>& view, int from, int into, int sample, int tet,
                                    const Real weight[4]) {
  const Real near = offset(from, into), apart = surface_.offset_of(from, into, sample);
  for (int c = 0; c < 3; ++c) {  // what is farther off is not in every list
    const int k = (3 * into + c) * view.stride;
    const Real at = places_[row_of_sample(sample)].at[c];
    if (at < view.lower[k] - near || at > view.upper[k] + near) return false;
  }
  const bool from_bends = surface_.bodies[from].phong, into_bends = surface_.bodies[into].phong;
  const typename Tables::Sample& own = surface_.samples[sample];
  const int* node = topology_.tets[tet].node;
  Surface surface;
  if (!find_surface(view, into, tet, weight, surface)) return false;
  Place place = places_[row_of_sample(sample)];
  Real against[4];
  std::copy_n(weight, 4, against);
  if (from_bends || into_bends) {
    // No bend can bring it nearer than by its own length: a field's slope is 1, or little more.
    Place bent, against_bent;
    bent.row = against_bent.row = Row{};
    if (from_bends) bent = bend(bends_of(view, own.tet), own.weight);
    if (into_bends) against_bent = bend(bends_of(view, tet), weight);
    constexpr Real steepest = Real(1.2);
    const Real nearer = std::sqrt(dot(bent.at, bent.at)) + std::sqrt(dot(against_bent.at, against_bent.at));
    if (surface.distance > apart + steepest * nearer) return false;
    if (from_bends) {
      place.row += bent.row;
      if (!barycentric(view, tet, place.at, against)) return false;
    }
    if (!(into_bends ? find_bent_surface(view, into, tet, place, against, surface)
                     : find_surface(view, into, tet, against, surface)))
      return false;
  }
  SurfaceContact<Real> contact;
  contact.depth = apart - surface.distance;
  if (!(contact.depth > 0)) return false;
  Real slack = surface_.core_reach;
  if (into_bends) {
    const Place way = bend(bends_of(view, tet), against);
    slack += std::sqrt(dot(way.at, way.at));
  }
  if (!is_beside(tet, against, slack)) return false;
  contact.body = from, contact.against = into, contact.sample = sample, contact.tet = tet;
  share_sample(from, sample, contact);
  if (into_bends)
    surface_.spread(tables_.rest_positions.data(), node, against, -1, spread_, shares_);
  else
    for (int i = 0; i < 4; ++i) shares_.push_back({node[i], -against[i]});
  contact.last_share = int(shares_.size());
  std::copy_n(place.at, 3, contact.place);
  std::copy_n(surface.normal, 3, contact.normal);
  contacts_.push_back(contact);
  return true;
}

// What other files call.
template void SurfaceContacts<float>::find_in(const LaneView<float>&, int, int, float, float, Near&);
template void SurfaceContacts<double>::find_in(const LaneView<double>&, int, int, double, double, Near&);

}  // namespace limber::fem::detail
