// What contact on the fine surfaces reads of a World. Method: docs/contact.md, "On the fine surface".
#pragma once

#include <cstdint>
#include <vector>

#include "fem/detail/kernels.h"
#include "fem/detail/penalty.h"

#include "core/contact_shape.h"

namespace limber::fem::detail {

struct Topology;

template <class Real>
struct SurfaceTables {
  // A point of a surface, by the nodes of the world's tet that it lies in at rest.
  struct Sample {
    int node[4], tet;
    Real weight[4], area;
  };
  // The part of a tet that can be inside the surface, or within twice the offset of it: where each
  // barycentric coordinate is at least `least`. It is a tet too, of corners scale × node + Σ least × nodes.
  struct Core {
    Real least[4], scale;  // scale ≤ 0: there is none
  };
  struct Body {
    FieldGrid<Real> field;
    bool phong;
    // Phong Deformation moves surfaces away from where linear deformation has them, in each tet by a bend.
    // What it moves farther than `bulge`, metres, may be missed; no tet's bend grows by more than
    // `bend_factor` times what nodes move against their mean. Both 0 without it.
    Real bulge, bend_factor;
    Real reach_factor;  // no corner of a core moves farther than this times the body's fastest node
    std::vector<int> sampled_tets, cored_tets;  // world tets, ascending
    // Nodes of the tets with a sample that walls can push, ascending, and of each those tets.
    std::vector<int> wall_nodes, first_tet_of_wall_node, tets_of_wall_nodes;
  };
  struct Slope {  // a share of a node's deformation gradient: place × gradient, 1/m
    int node;
    Real gradient[3];
  };
  std::vector<Slope> slopes;
  std::vector<int> first_slope;  // (nodes + 1); of nodes of phong bodies
  using Share = detail::Share<Real>;
  // Appends the shares of which the place at rest Σ weight × rest place is where Phong Deformation moves it,
  // times `sign`: wᵢ, and of all nodes round i ½ wᵢ (X − Xᵢ)·g. `scratch` (nodes) holds zeros, before and
  // after.
  void spread(const Real* rest, const int node[4], const Real weight[4], Real sign,
              std::vector<Real>& scratch, std::vector<Share>& out) const;
  std::vector<Share> shares;     // of samples: where they are, by all nodes that move them
  std::vector<int> first_share;  // (samples + 1)
  Shares<Real> shares_of(int sample) const {
    return {shares.data() + first_share[sample], shares.data() + first_share[sample + 1]};
  }
  // (samples) What its weights sum to without signs, and the part of it that is on nodes that move.
  struct Sizes {
    Real all, borne;
  };
  std::vector<Sizes> sizes;
  std::vector<Real> rest_places;  // (4 a node) x y z 0
  // (24 a tet) Half the way along its edges at rest, 01 02 03 12 13 23, each x y z 0; empty without phong
  // bodies.
  std::vector<Real> half_edges;
  // (9 a tet, and one more) of the weights of nodes 1 … 3; empty without phong bodies
  std::vector<Real> weight_gradients;
  std::vector<Sample> samples;   // ascending by tet
  std::vector<Real> weights[4];  // of the samples, in columns; a block more, for kernels
  // (tets) Of the samples of a tet, those from here on hang on nodes that never move alone: no wall pushes
  // them.
  std::vector<int> first_held_sample;
  std::vector<int> first_sample;  // (tets + 1) of the world's tets
  std::vector<Core> cores;        // (tets)
  std::vector<Body> bodies;
  Real core_reach;  // metres: so far do cores reach over what can be inside
  Real wall_slack;  // metres: what is less far beyond a wall is where rounding put it
  // [body a × bodies + body b] metres: surfaces that near are in contact. On the diagonal: a body with
  // itself.
  std::vector<Real> offset;
  // Samples that begin nearer to the other's surface than that, or in it, are in contact when they are nearer
  // than they began. [body × bodies + against] −1, or where own_offset has those of the body's samples,
  // metres, counted from its first.
  std::vector<int> first_own_offset;
  std::vector<Real> own_offset;
  Real largest_offset() const { return core_reach / 2; }
  int first_sample_of(int body) const {
    const std::vector<int>& tets = bodies[std::size_t(body)].sampled_tets;
    return tets.empty() ? 0 : first_sample[std::size_t(tets.front())];
  }
  Real offset_of(int body, int against, int sample) const {
    const std::size_t pair = std::size_t(body) * bodies.size() + std::size_t(against);
    const int first = first_own_offset.empty() ? -1 : first_own_offset[pair];
    return first < 0 ? offset[pair] : own_offset[std::size_t(first + sample - first_sample_of(body))];
  }
  std::vector<std::vector<int>> tets_round_node;  // of bodies that touch themselves, else empty; ascending
};

}  // namespace limber::fem::detail
