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
// These formulas are in kernels_surface.inc, for many samples side by side; here is who is asked, and what
// follows. Where Phong Deformation bends the surface, X is found by Newton's method and F is the mean F̄ = Σ
// λᵢ Fᵢ of the nodes', so g does not jump at borders of tets. What a bend moves farther than a body's `bulge`
// may be missed.
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
// and sleep anew; those that may be near are asked for in asked_, in the order of samples.
template <class Real>
void SurfaceContacts<Real>::find_in(const LaneView<Real>& view, int from, int into, Real reach, Real travel,
                                    Near& near) {
  const TetAndEdge* const all = near.candidates.data();
  const std::size_t count = near.candidates.size();
  if (awake_.size() < count + block_size) awake_.resize(count + block_size), distance_.resize(awake_.size());
  const int* const index = awake_.data();
  const int awake = kernels_.find_at_most(near.asleep_until.data(), int(count), travel, awake_.data());
  for (int i = 0; i < awake; ++i) need_core(view, all[index[i]].tet), sample_place(view, all[index[i]].point);
  kernels_.middle_distances(all, index, awake, &places_[0].at[0], distance_.data());
  asked_.resize(std::size_t(awake));
  std::size_t asked = 0;
  for (int i = 0; i < awake;) {
    const int sample = all[index[i]].point;
    const Real own_bulge = sample_bulge(view, from, sample);
    for (; i < awake && all[index[i]].point == sample; ++i) {
      const int tet = all[index[i]].tet;
      const Real bulge = own_bulge + bulge_of(view, into, tet), distance = distance_[i];
      near.asleep_until[index[i]] = travel + kept * (distance - bulge) - rounding * reach;
      PlaceInTet<Real>& one = asked_[asked];
      one.out = bulge, one.tet = tet, one.sample = sample;
      asked += distance > bulge + certain * reach ? 0 : 1;  // half of them, and no way to guess which
    }
  }
  asked_.resize(asked);
  for (PlaceInTet<Real>& one : asked_) {
    std::copy_n(places_[row_of_sample(one.sample)].at, 3, one.place);
    std::copy_n(topology_.tets[one.tet].node, 4, one.node);
  }
  if (asked_.empty()) return;
  choose_tets(view, from, into);
  measure(view, from, into);
}

// Of several cores that hold a sample, since cores reach over their tets by twice the offset, asked_ keeps
// one: the tet in which the sample's least barycentric coordinate is largest, which is the one that holds
// it, or, just outside of the cage, the nearest. Each sample touches once. What is beyond the offset of the
// body's box is not in every list, and never touches.
template <class Real>
void SurfaceContacts<Real>::choose_tets(const LaneView<Real>& view, int from, int into) {
  for (int i = 0; i < 8; ++i) {
    answers_[i].resize(std::max(answers_[i].size(), asked_.size() + block_size));
    columns_of_answers_[i] = answers_[i].data();
  }
  kernels_.weigh_in_cores(asked_.data(), int(asked_.size()), rows(), columns_of_answers_);
  Real lower[3], upper[3];
  for (int c = 0; c < 3; ++c) {
    const int k = (3 * into + c) * view.stride;
    lower[c] = view.lower[k] - offset(from, into), upper[c] = view.upper[k] + offset(from, into);
  }
  std::size_t chosen = 0;
  for (std::size_t k = 0; k < asked_.size();) {
    const int sample = asked_[k].sample;
    std::size_t best = asked_.size();
    Real best_least = std::numeric_limits<Real>::lowest();
    for (; k < asked_.size() && asked_[k].sample == sample; ++k)
      if (answers_[4][k] > best_least) best = k, best_least = answers_[4][k];
    if (best == asked_.size()) continue;
    const PlaceInTet<Real>& one = asked_[best];
    bool far = false;
    for (int c = 0; c < 3; ++c) far |= one.place[c] < lower[c] || one.place[c] > upper[c];
    if (!far) asked_[chosen++] = PlaceInTet<Real>(one);
  }
  asked_.resize(chosen);
}

// Measures samples of `from`, each in its tet of `into`, and appends touches of those that are nearer to the
// surface than the offset, or below it. Where something bends, samples are first measured as if nothing
// did: most are too far off then, whichever way the bends go, and end there. Only then come the exact place
// and Newton's method.
template <class Real>
void SurfaceContacts<Real>::measure(const LaneView<Real>& view, int from, int into) {
  const bool from_bends = surface_.bodies[from].phong, into_bends = surface_.bodies[into].phong;
  const FieldGrid<Real>& field = surface_.bodies[into].field;
  kernels_.find_surfaces(asked_.data(), int(asked_.size()), rows(), field, columns_of_answers_);
  if (from_bends || into_bends) {
    std::size_t bent = 0;
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const PlaceInTet<Real>& one = asked_[k];
      const Real weight[4] = {answers_[0][k], answers_[1][k], answers_[2][k], answers_[3][k]};
      // No bend can bring it nearer than by its own length: a field's slope is 1, or little more.
      Place own, against;
      own.row = against.row = Row{};
      const typename Tables::Sample& sample = surface_.samples[one.sample];
      if (from_bends) own = bend(bends_of(view, sample.tet), sample.weight);
      if (into_bends) against = bend(bends_of(view, one.tet), weight);
      constexpr Real steepest = Real(1.2);
      const Real nearer = std::sqrt(dot(own.at, own.at)) + std::sqrt(dot(against.at, against.at));
      if (answers_[4][k] > surface_.offset_of(from, into, one.sample) + steepest * nearer) continue;
      PlaceInTet<Real>& next = asked_[bent++] = PlaceInTet<Real>(one);
      for (int c = 0; c < 3; ++c) next.place[c] += own.at[c];
    }
    asked_.resize(bent);
    if (into_bends)
      kernels_.find_bent_surfaces(asked_.data(), int(bent), rows(), field,
                                  surface_.wall_slack + Real(1e-3) * tables_.skin[into], columns_of_answers_);
    else
      kernels_.find_surfaces(asked_.data(), int(bent), rows(), field, columns_of_answers_);
  }
  for (int k = 0; k < int(asked_.size()); ++k) touch(view, from, into, k);
}

// Where kernels find things of tets and nodes.
template <class Real>
SurfaceRows<Real> SurfaceContacts<Real>::rows() const {
  static_assert(sizeof(typename Tables::Core) == core_numbers * sizeof(Real));
  static_assert(sizeof(Slopes) == 12 * sizeof(Real) && sizeof(Bends) == 24 * sizeof(Real));
  return {&places_[0].at[0],
          row_of_core(0),
          surface_.cores[0].least,
          surface_.rest_places.data(),
          slopes_.empty() ? nullptr : &slopes_[0].column[0].at[0],
          bends_.empty() ? nullptr : &bends_[0].of_edge[0].at[0],
          surface_.weight_gradients.data()};
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

// Appends the touch of the k-th that was asked for, if it is one.
template <class Real>
void SurfaceContacts<Real>::touch(const LaneView<Real>& view, int from, int into, int k) {
  const PlaceInTet<Real>& one = asked_[k];
  SurfaceContact<Real> contact;
  contact.depth = surface_.offset_of(from, into, one.sample) - answers_[4][k];
  if (!(contact.depth > 0)) return;
  const Real against[4] = {answers_[0][k], answers_[1][k], answers_[2][k], answers_[3][k]};
  const bool bends = surface_.bodies[into].phong;
  Real slack = surface_.core_reach;
  if (bends) {
    const Place way = bend(bends_of(view, one.tet), against);
    slack += std::sqrt(dot(way.at, way.at));
  }
  if (!is_beside(one.tet, against, slack)) return;
  contact.body = from, contact.against = into, contact.sample = one.sample, contact.tet = one.tet;
  contact.first_against = int(shares_.size());
  if (bends)
    surface_.spread(tables_.rest_positions.data(), one.node, against, -1, spread_, shares_);
  else
    for (int i = 0; i < 4; ++i) shares_.push_back({one.node[i], -against[i]});
  contact.last_against = int(shares_.size());
  std::copy_n(one.place, 3, contact.place);
  for (int c = 0; c < 3; ++c) contact.normal[c] = answers_[5 + c][k];
  contacts_.push_back(contact);
}

// What other files call.
template void SurfaceContacts<float>::find_in(const LaneView<float>&, int, int, float, float, Near&);
template void SurfaceContacts<double>::find_in(const LaneView<double>&, int, int, double, double, Near&);

}  // namespace limber::fem::detail
