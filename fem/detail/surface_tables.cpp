// By which nodes Phong Deformation moves a place of a body.
//
// Phong Deformation (James 2020; docs/binding.md) is linear in the positions of all nodes round a tet, so a
// place of the surface has fixed shares of nodes. They sum to 1 and some may be negative. Forces that go to
// nodes by these shares are the gradient of the depth, and keep momentum. Tried and not kept: forces by the
// four nodes of the tet alone made plates swing up until the rollout was lost.
#include <algorithm>

#include "fem/detail/surface_contact.h"

namespace limber::fem::detail {

// With X = Σ wᵢ Xᵢ and Fᵢ = Σⱼ xⱼ gᵢⱼᵀ the deformation gradient of node i, Phong Deformation moves X to
//
//     x(X) = Σᵢ wᵢ (xᵢ + ½ Fᵢ (X − Xᵢ)) = Σⱼ sⱼ xⱼ,    sⱼ = wⱼ + Σᵢ ½ wᵢ gᵢⱼ·(X − Xᵢ).
//
// Appends the shares sⱼ times `sign`. scratch holds the sums by node; a node enters the list when its sum
// is zero. A sum may come back to zero on the way, so a node may be listed twice: the second pass keeps the
// first of the two, and leaves scratch as it was, all zero.
template <class Real>
void SurfaceTables<Real>::spread(const Real* rest, const int node[4], const Real weight[4], Real sign,
                                 std::vector<Real>& scratch, std::vector<Share>& out) const {
  Real at_rest[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const std::size_t first = out.size();
  for (int i = 0; i < 4; ++i) {
    Real half[3];
    for (int c = 0; c < 3; ++c) half[c] = Real(0.5) * weight[i] * (at_rest[c] - rest[3 * node[i] + c]);
    for (int k = first_slope[node[i]]; k < first_slope[node[i] + 1]; ++k) {  // the node itself among them
      Real& sum = scratch[slopes[k].node];
      if (sum == 0) out.push_back({slopes[k].node, 0});
      sum += dot(half, slopes[k].gradient) + (slopes[k].node == node[i] ? weight[i] : Real(0));
    }
  }
  std::size_t kept_shares = first;  // a sum may have been 0 in between
  for (std::size_t k = first; k < out.size(); ++k) {
    Real& sum = scratch[out[k].node];
    if (sum != 0) out[kept_shares++] = {out[k].node, sign * sum};
    sum = 0;
  }
  out.resize(kept_shares);
}

template struct SurfaceTables<float>;
template struct SurfaceTables<double>;

}  // namespace limber::fem::detail
