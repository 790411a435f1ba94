// The modes of a body at rest, found densely: small bodies.
#pragma once

#include <Eigen/Eigenvalues>
#include <vector>

#include "fem/detail/make_elements.h"
#include "fem/detail/make_stars.h"
#include "fem/detail/timestep.h"

namespace limber::fem::testing {

// ω² of M⁻¹K, ascending, by the masses that the body has; K by differences of the forces over 1e-5 of the
// body's size. Needs stiffness_share.
inline Eigen::VectorXd frequencies2(const Body& body) {
  const detail::ElementTables<double> elements = detail::stars_of(detail::make_elements(body));
  const double nudge = 1e-5 * bounding_box(body.cage.positions).size().maxCoeff();
  std::vector<double> rest;
  for (int n = 0; n < body.node_count(); ++n)
    for (int c = 0; c < 3; ++c) rest.push_back(body.cage.positions(n, c));
  const std::vector<double> still(rest.size(), 0.0);
  const Eigen::Index numbers = Eigen::Index(rest.size());
  Eigen::MatrixXd stiffness(numbers, numbers);
  Eigen::VectorXd root(numbers);
  for (Eigen::Index k = 0; k < numbers; ++k) {
    std::vector<double> ahead = rest, behind = rest;
    ahead[std::size_t(k)] += nudge, behind[std::size_t(k)] -= nudge;
    const std::vector<double> there = detail::forces_of(elements, ahead, still),
                              back = detail::forces_of(elements, behind, still);
    for (Eigen::Index i = 0; i < numbers; ++i)
      stiffness(i, k) = (back[std::size_t(i)] - there[std::size_t(i)]) / (2 * nudge);
    root[k] = 1 / std::sqrt(body.node_mass_kg[std::size_t(k / 3)]);
  }
  const Eigen::MatrixXd scaled = root.asDiagonal() * stiffness * root.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (scaled + scaled.transpose())).eigenvalues();
}

}  // namespace limber::fem::testing
