// What contact on fine surfaces reads of a body at rest: the distance to its surface, and by which nodes
// Phong Deformation moves a place of it.
//
// The signed distance φ lies on a grid as 16-bit integers (core/contact_shape.h; how it is made:
// docs/contact.md, "Field and samples") and is read by trilinear interpolation. So φ is continuous
// everywhere, and its gradient within a cell. Interpolation rounds edges off to the outside; the values of
// the grid are fitted so that half of that error is gone.
//
// Phong Deformation (James 2020; docs/binding.md) is linear in the positions of all nodes round a tet, so a
// place of the surface has fixed shares of nodes. They sum to 1 and some may be negative. Forces that go to
// nodes by these shares are the gradient of the depth, and keep momentum. Tried and not kept: forces by the
// four nodes of the tet alone made plates swing up until the rollout was lost.
#include <algorithm>

#include "fem/detail/surface_contact.h"

namespace limber::fem::detail {

// φ at a place at rest, in metres, and ∇φ, without a unit. `part` is where the place lies in its cell, 0 to
// 1 on each axis. Interpolation goes along x, then y, then z; the slope along an axis is the difference of
// the two ends, interpolated along the other two. Outside of the grid it is the φ of the nearest place in
// the grid, which does not change along the axes that the place is outside on.
template <class Real>
Real SurfaceTables<Real>::Field::at(const Real place[3], Real gradient[3]) const {
  int cell[3];
  Real part[3];
  bool within[3];
  for (int c = 0; c < 3; ++c) {
    const Real last = Real(nodes[c] - 1), t = (place[c] - lower[c]) * inverse_cell;
    within[c] = t >= 0 && t <= last;
    const Real held = within[c] ? t : (t > last ? last : Real(0));  // 0 of what is not a number
    cell[c] = std::min(int(held), nodes[c] - 2);
    part[c] = held - Real(cell[c]);
  }
  const std::ptrdiff_t row = nodes[0], slice = row * nodes[1];
  const std::int16_t* v = values + cell[2] * slice + cell[1] * row + cell[0];
  const auto value = [&](int i, int j, int k) { return Real(v[k * slice + j * row + i]); };
  const auto mix = [](Real a, Real b, Real t) { return a + t * (b - a); };
  Real along_x[2][2], rise_x[2][2];
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j) {
      rise_x[k][j] = value(1, j, k) - value(0, j, k);
      along_x[k][j] = value(0, j, k) + part[0] * rise_x[k][j];
    }
  const Real low = mix(along_x[0][0], along_x[0][1], part[1]),
             high = mix(along_x[1][0], along_x[1][1], part[1]);
  const Real scale = unit * inverse_cell;
  gradient[0] = within[0] ? scale * mix(mix(rise_x[0][0], rise_x[0][1], part[1]),
                                        mix(rise_x[1][0], rise_x[1][1], part[1]), part[2])
                          : Real(0);
  gradient[1] = within[1] ? scale * mix(along_x[0][1] - along_x[0][0], along_x[1][1] - along_x[1][0], part[2])
                          : Real(0);
  gradient[2] = within[2] ? scale * (high - low) : Real(0);
  return unit * mix(low, high, part[2]);
}

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
