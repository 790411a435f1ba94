#include "fem/detail/effective_mass.h"

namespace limber::fem::detail {

// The bound by which this is stable counts six motions as one, so twice as much is (docs/dynamics.md).
constexpr double slack = 2;

template <class Real>
void EffectiveMass::measure(const LaneView<Real>& view, const Topology::Body& body,
                            const std::vector<Real>& node_mass) {
  double mass = 0, sum[3] = {0, 0, 0};
  for (int n = body.first_node; n < body.last_node; ++n) {
    mass += double(node_mass[n]);
    for (int c = 0; c < 3; ++c) sum[c] += double(node_mass[n]) * double(view.x[view.state.at(n, c)]);
  }
  inverse_mass_ = 1 / mass;
  for (int c = 0; c < 3; ++c) center_[c] = sum[c] / mass;
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // of the inertia
  for (int n = body.first_node; n < body.last_node; ++n) {
    double r[3];
    for (int c = 0; c < 3; ++c) r[c] = double(view.x[view.state.at(n, c)]) - center_[c];
    const double m = double(node_mass[n]);
    xx += m * (r[1] * r[1] + r[2] * r[2]), yy += m * (r[2] * r[2] + r[0] * r[0]);
    zz += m * (r[0] * r[0] + r[1] * r[1]);
    xy -= m * r[0] * r[1], xz -= m * r[0] * r[2], yz -= m * r[1] * r[2];
  }
  const double cofactors[6] = {yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy,
                               xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy};
  const double determinant = xx * cofactors[0] + xy * cofactors[1] + xz * cofactors[2];
  for (int k = 0; k < 6; ++k) inverse_inertia_[k] = cofactors[k] / determinant;
}

template <class Real>
double EffectiveMass::inverse_mass(const Real at[3], const Real along[3], Real depth) const {
  double r[3], t[3];
  for (int c = 0; c < 3; ++c) r[c] = double(at[c]) - center_[c];
  for (int c = 0; c < 3; ++c) {
    const int d = (c + 1) % 3, e = (c + 2) % 3;
    t[c] = r[d] * double(along[e]) - r[e] * double(along[d]);
  }
  const double* i = inverse_inertia_;
  const double turning = t[0] * (i[0] * t[0] + i[1] * t[1] + i[2] * t[2]) +
                         t[1] * (i[1] * t[0] + i[3] * t[1] + i[4] * t[2]) +
                         t[2] * (i[2] * t[0] + i[4] * t[1] + i[5] * t[2]);
  return depths / double(depth) / slack * (inverse_mass_ + turning);
}

template void EffectiveMass::measure(const LaneView<float>&, const Topology::Body&,
                                     const std::vector<float>&);
template void EffectiveMass::measure(const LaneView<double>&, const Topology::Body&,
                                     const std::vector<double>&);
template double EffectiveMass::inverse_mass(const float at[3], const float along[3], float depth) const;
template double EffectiveMass::inverse_mass(const double at[3], const double along[3], double depth) const;

}  // namespace limber::fem::detail
