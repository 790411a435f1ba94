// Where things are in one call of contact on fine surfaces: nodes, samples, cores of tets, and how Phong
// Deformation bends each tet. Included by the files that define SurfaceContacts.
//
// Each is computed when it is first asked for in a call and kept for the rest of it. A stamp beside it says
// in which call that was: find() counts calls, and no stamp of an earlier call equals the count. Bodies
// hold thousands of samples and a call asks for a few, so this saves nearly all of the work.
//
// Places are rows x y z 0, so that one vector operation adds or scales a place. Metres throughout. Linear
// deformation has a sample at Σ wᵢ xᵢ over the four nodes of its tet; that is what candidates and cores go
// by. Phong Deformation moves it away from there by its bend (docs/contact.md, "On the fine surface", 8).
#pragma once

#include <algorithm>
#include <cmath>

#include "fem/detail/surface_contact.h"

namespace limber::fem::detail {

template <class Real>
auto SurfaceContacts<Real>::node_place(const LaneView<Real>& view, int node) -> const Place& {
  Place& place = places_[node];
  if (stamps_[node] == stamp_) return place;
  stamps_[node] = stamp_;
  const Real* x = view.x + view.state.at(node, 0);
  place.row = Row{x[0], x[view.state.component], x[2 * view.state.component], 0};
  return place;
}

// Where linear deformation has the sample.
template <class Real>
auto SurfaceContacts<Real>::sample_place(const LaneView<Real>& view, int index) -> const Place& {
  Place& place = places_[row_of_sample(index)];
  unsigned& stamp = stamps_[first_sample_stamp_ + index];
  if (stamp == stamp_) return place;
  stamp = stamp_;
  const typename Tables::Sample& sample = surface_.samples[index];
  Row sum = sample.weight[0] * node_place(view, sample.node[0]).row;
  for (int i = 1; i < 4; ++i) sum += sample.weight[i] * node_place(view, sample.node[i]).row;
  place.row = sum;
  return place;
}

// The deformation gradient of a node, F = Σⱼ xⱼ gⱼᵀ over the node and those round it: the mean of its
// tets', by rest volume. Without a unit.
template <class Real>
void SurfaceContacts<Real>::find_slopes(const LaneView<Real>& view, int node) {
  stamps_[first_slopes_stamp_ + node] = stamp_;
  Row sum[3] = {{}, {}, {}};
  for (int k = surface_.first_slope[node]; k < surface_.first_slope[node + 1]; ++k) {
    const typename Tables::Slope& slope = surface_.slopes[k];
    const Row place = node_place(view, slope.node).row;
    for (int c = 0; c < 3; ++c) sum[c] += slope.gradient[c] * place;
  }
  for (int c = 0; c < 3; ++c) slopes_[node].column[c].row = sum[c];
}

// The bend of a tet. A place of weights w, at rest X = Σ wᵢ Xᵢ, is moved away from Σ wᵢ xᵢ by
//
//     ½ Σᵢ wᵢ Fᵢ (X − Xᵢ) = Σ over edges ij of wᵢ wⱼ bᵢⱼ,    bᵢⱼ = ½ (Fᵢ − Fⱼ)(Xⱼ − Xᵢ),
//
// since X − Xᵢ = Σⱼ wⱼ (Xⱼ − Xᵢ). `most` is how far the middle of the edge that bends most is moved: there
// wᵢ wⱼ = ¼ and all other products are 0.
template <class Real>
void SurfaceContacts<Real>::find_bends(const LaneView<Real>& view, int tet) {
  Bends& bends = bends_[tet];
  bulges_[tet].stamp = stamp_;
  const int* node = topology_.tets[tet].node;
  const Slopes* slopes[4];
  for (int i = 0; i < 4; ++i) slopes[i] = &slopes_at(view, node[i]);
  const Real* half = &surface_.half_edges[24 * std::size_t(tet)];
  Real most2 = 0;
  for (int i = 0, e = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j, ++e, half += 4) {
      Row sum = {};
      for (int c = 0; c < 3; ++c) sum += half[c] * (slopes[i]->column[c].row - slopes[j]->column[c].row);
      bends.of_edge[e].row = sum;
      most2 = std::max(most2, dot(bends.of_edge[e].at, bends.of_edge[e].at));
    }
  bulges_[tet].most = Real(0.25) * std::sqrt(most2);
}

// By how much bending may move what lies in a tet, as far as contact heeds it: no more than the body's
// `bulge`. Zero for bodies that deform linearly.
template <class Real>
Real SurfaceContacts<Real>::bulge_of(const LaneView<Real>& view, int body, int tet) {
  const typename Tables::Body& table = surface_.bodies[body];
  if (!table.phong) return 0;
  if (bulges_[tet].stamp != stamp_) find_bends(view, tet);
  return std::min(bulges_[tet].most, table.bulge);
}

// The same of one sample, whose weights are known.
template <class Real>
Real SurfaceContacts<Real>::sample_bulge(const LaneView<Real>& view, int body, int index) {
  const typename Tables::Body& table = surface_.bodies[body];
  if (!table.phong) return 0;
  const typename Tables::Sample& sample = surface_.samples[index];
  const Place way = bend(bends_of(view, sample.tet), sample.weight);
  return std::min(std::sqrt(dot(way.at, way.at)), table.bulge);
}

// By how much Phong Deformation moves the place of these weights away from where linear deformation has it.
template <class Real>
auto SurfaceContacts<Real>::bend(const Bends& bends, const Real w[4]) -> Place {
  Place way;
  way.row = (w[0] * w[1]) * bends.of_edge[0].row + (w[0] * w[2]) * bends.of_edge[1].row +
            (w[0] * w[3]) * bends.of_edge[2].row + (w[1] * w[2]) * bends.of_edge[3].row +
            (w[1] * w[3]) * bends.of_edge[4].row + (w[2] * w[3]) * bends.of_edge[5].row;
  return way;
}

// The corners of the part of a tet that can be inside the surface: where each barycentric coordinate λᵢ is
// at least lᵢ. With s = 1 − Σ lᵢ the corners are Σⱼ lⱼ xⱼ + s xᵢ.
template <class Real>
void SurfaceContacts<Real>::find_core(const LaneView<Real>& view, int tet) {
  stamps_[world_nodes_ + tet] = stamp_;
  const typename Tables::Core& core = surface_.cores[tet];
  const int* node = topology_.tets[tet].node;
  Row corner[4], base = core.least[0] * (corner[0] = node_place(view, node[0]).row);
  for (int i = 1; i < 4; ++i) base += core.least[i] * (corner[i] = node_place(view, node[i]).row);
  for (int i = 0; i < 4; ++i) places_[row_of_core(tet) + i].row = base + core.scale * corner[i];
}

}  // namespace limber::fem::detail
