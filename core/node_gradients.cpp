#include "core/node_gradients.h"

#include <map>

namespace limber {

NodeGradients node_gradients(const TetMesh& rest) {
  const std::size_t nodes = std::size_t(rest.positions.rows());
  // Six volumes of a tet times the gradients of its corners' weights: no quotient, so flat tets do no harm.
  std::vector<std::map<int, Vec3>> sums(nodes);
  std::vector<double> volumes(nodes, 0.0);
  for (Eigen::Index t = 0; t < rest.tets.rows(); ++t) {
    const auto tet = rest.tets.row(t);
    const Vec3 a = rest.positions.row(tet[0]), b = Vec3(rest.positions.row(tet[1])) - a,
               c = Vec3(rest.positions.row(tet[2])) - a, d = Vec3(rest.positions.row(tet[3])) - a;
    const Vec3 of_b = c.cross(d), of_c = d.cross(b), of_d = b.cross(c);
    const Vec3 gradients[4] = {-(of_b + of_c + of_d), of_b, of_c, of_d};
    for (int i = 0; i < 4; ++i) {
      volumes[std::size_t(tet[i])] += b.dot(of_b);
      for (int j = 0; j < 4; ++j)
        sums[std::size_t(tet[i])].try_emplace(tet[j], Vec3::Zero()).first->second += gradients[j];
    }
  }
  NodeGradients result;
  result.begin.push_back(0);
  for (const auto& row : sums) result.begin.push_back(result.begin.back() + int(row.size()));
  result.gradient.resize(result.begin.back(), 3);
  for (std::size_t i = 0; i < nodes; ++i)
    for (const auto& [j, sum] : sums[i]) {
      result.gradient.row(Eigen::Index(result.neighbour.size())) = sum / volumes[i];
      result.neighbour.push_back(j);
    }
  return result;
}

}  // namespace limber
