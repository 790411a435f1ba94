// By how much the elements of a body are too stiff for its mesh. Linear tets bend and shear too stiffly,
// and the more so the coarser they are ("locking"). The same load f moves the elements by u and the
// material by u'; the share is
//
//     f·u / f·u',    the compliances at rest: f·u = fᵀ K⁻¹ f.
//
// Multiplied by it the elements give way as their material does. The material's answer is that of quadratic
// tets on the cage, and on the cage with each tet cut in eight, extrapolated from the two to finer ones.
// Loads are those that move the body most easily: a uniform force along each axis where nodes are held,
// else its four softest modes, and those that are as soft as the fourth.
//
// What always holds: the result is a multiple of 1/512, so no rounding on the way shows in it; the modes
// begin from a written seed; of modes that are equally soft, as a cube has them, those combinations are taken
// that the material has for its own, for which of them an eigensolver finds is up to rounding.
//
// Tried and not kept (docs/dynamics.md, "One material, any mesh"): the factors of the linear cage to show
// conjugate gradients the way on the cut mesh. They then took 140 to more than 500 steps in place of 30 to
// 240, and what was cut off left plates a quarter per cent and a dragon 14 % too stiff. Falls short: it is
// one number a body, right for its softest way to give way and too soft for the others. Quadratic tets and
// their integration are in every textbook, Zienkiewicz and Taylor's "The Finite Element Method" for one.
#include "fem/detail/locking.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <utility>

#include "core/random.h"
#include "core/threads.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;
using Vector = Eigen::VectorXd;
using Solver = Eigen::SimplicialLDLT<Sparse>;

// Meshes of more tets are not cut in eight, or, of more than the second number, taken to be fine enough.
constexpr int max_refined_tets = 1500, max_tets = 20000;
constexpr int modes = 4;               // that count
constexpr double equally_soft = 1.01;  // ratio of two modes' ω²
// Where edges are held stress is singular, and what a mesh of size h is missing falls as h^1.4, so by 2.6
// when tets are cut. What is then still missing is 1/(2.6 − 1) of the last gain.
constexpr double still_missing = 0.6;
constexpr double hold_free = 1e-9;  // share of the diagonal that is added, so that free bodies do not drift
constexpr int edge_ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// The middles of a mesh's edges, numbered as nodes behind its own. Both ends in ascending order name one.
struct Middles {
  std::map<std::pair<int, int>, int> node;
  int of(int i, int j) const { return node.at(std::minmax(i, j)); }
};
Middles middles_of(const TetMesh& mesh) {
  Middles middles;
  int next = int(mesh.positions.rows());
  for (int t = 0; t < mesh.tets.rows(); ++t)
    for (const auto& [i, j] : edge_ends)
      next += middles.node.try_emplace(std::minmax(mesh.tets(t, i), mesh.tets(t, j)), next).second;
  return middles;
}

// Values at nodes → values at nodes and middles: a middle has the mean of its ends.
Sparse interpolation(const Middles& middles, int nodes) {
  Triplets entries;
  for (int n = 0; n < nodes; ++n) entries.emplace_back(n, n, 1.0);
  for (const auto& [edge, middle] : middles.node)
    entries.emplace_back(middle, edge.first, 0.5), entries.emplace_back(middle, edge.second, 0.5);
  Sparse matrix(nodes + int(middles.node.size()), nodes);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Each tet cut in eight: four at its corners, and four round the diagonal from middle 02 to middle 13 of
// the octahedron that is left between them. Part k of tet t is tet 8t + k.
TetMesh refined(const TetMesh& mesh, const Middles& middles) {
  TetMesh fine{interpolation(middles, int(mesh.positions.rows())) * mesh.positions,
               Tets(8 * mesh.tets.rows(), 4)};
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    const auto q = mesh.tets.row(t);
    const auto m = [&](int i, int j) { return middles.of(q[i], q[j]); };
    const int parts[8][4] = {{q[0], m(0, 1), m(0, 2), m(0, 3)},    {m(0, 1), q[1], m(1, 2), m(1, 3)},
                             {m(0, 2), m(1, 2), q[2], m(2, 3)},    {m(0, 3), m(1, 3), m(2, 3), q[3]},
                             {m(0, 1), m(0, 2), m(0, 3), m(1, 3)}, {m(0, 1), m(0, 2), m(1, 3), m(1, 2)},
                             {m(0, 2), m(0, 3), m(1, 3), m(2, 3)}, {m(0, 2), m(1, 2), m(2, 3), m(1, 3)}};
    for (int k = 0; k < 8; ++k)
      fine.tets.row(8 * t + k) << parts[k][0], parts[k][1], parts[k][2], parts[k][3];
  }
  return fine;
}

// A middle is held where both of its ends are.
std::vector<bool> fixed_with_middles(const std::vector<bool>& fixed, const Middles& middles) {
  std::vector<bool> all = fixed;
  all.resize(fixed.size() + middles.node.size());
  for (const auto& [edge, middle] : middles.node) all[middle] = fixed[edge.first] && fixed[edge.second];
  return all;
}

// Numbers of what may move, three a node that is not fixed: vectors and matrices of the solvers are over
// these. A field over nodes is a row of three a node.
struct Freedoms {
  std::vector<int> first;  // of a node; −1 where fixed
  int count = 0;
  explicit Freedoms(const std::vector<bool>& fixed) {
    for (const bool f : fixed) first.push_back(f ? -1 : count), count += f ? 0 : 3;
  }
  // Adds a 3 × 3 block, or what of it may move.
  void add(Triplets& entries, int a, int b, const Eigen::Matrix3d& block) const {
    if (first[a] < 0 || first[b] < 0) return;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries.emplace_back(first[a] + i, first[b] + j, block(i, j));
  }
  Vector from_nodes(const Points& field) const {
    Vector v(count);
    for (std::size_t n = 0; n < first.size(); ++n)
      if (first[n] >= 0) v.segment<3>(first[n]) = field.row(Eigen::Index(n)).transpose();
    return v;
  }
  Points to_nodes(const Vector& v) const {
    Points field = Points::Zero(Eigen::Index(first.size()), 3);
    for (std::size_t n = 0; n < first.size(); ++n)
      if (first[n] >= 0) field.row(Eigen::Index(n)) = v.segment<3>(first[n]).transpose();
    return field;
  }
};

// Entries that name one place are added.
Sparse matrix_of(const Triplets& entries, int rows, int columns) {
  Sparse matrix(rows, columns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// A matrix over nodes as one over what may move, the same for each axis.
Sparse over_axes(const Sparse& by_node, const Freedoms& rows, const Freedoms& columns) {
  Triplets entries;
  for (int n = 0; n < by_node.outerSize(); ++n)
    for (Sparse::InnerIterator it(by_node, n); it; ++it)
      for (int c = 0; c < 3 && rows.first[it.row()] >= 0 && columns.first[n] >= 0; ++c)
        entries.emplace_back(rows.first[it.row()] + c, columns.first[n] + c, it.value());
  return matrix_of(entries, rows.count, columns.count);
}

// ∇λ of a tet's four barycentric coordinates λ, as rows, 1/m, which are constant in it; and its volume, m³.
struct TetShape {
  Eigen::Matrix<double, 4, 3> gradient;
  double volume;
  TetShape(const Points& x, const Tets& tets, int t) {
    Vec3 p[4];
    for (int i = 0; i < 4; ++i) p[i] = x.row(tets(t, i));
    const Vec3 b = p[1] - p[0], c = p[2] - p[0], d = p[3] - p[0];
    const double volume6 = b.dot(c.cross(d));
    gradient.row(1) = c.cross(d) / volume6, gradient.row(2) = d.cross(b) / volume6;
    gradient.row(3) = b.cross(c) / volume6;
    gradient.row(0) = -gradient.bottomRows<3>().colwise().sum();
    volume = volume6 / 6;
  }
};

// Quadratic tets of an isotropic linear material. With λ the barycentric coordinates their ten functions
// are
//
//     Nᵢ = λᵢ (2λᵢ − 1) at the corners,    Nᵢⱼ = 4 λᵢ λⱼ at the middles of edges,
//
// so a displacement that is quadratic in space is exact. Integrals take four points a tet, which is exact
// for products of two gradients in tets of straight edges.
class Quadratic {
 public:
  Quadratic(const TetMesh& mesh, const std::vector<bool>& fixed, const std::vector<Lame>& of_tet)
      : middles_(middles_of(mesh)),
        freedoms_(fixed_with_middles(fixed, middles_)),
        mesh_nodes_(int(mesh.positions.rows())) {
    for (int t = 0; t < mesh.tets.rows(); ++t) {
      const auto q = mesh.tets.row(t);
      Element e{{q[0], q[1], q[2], q[3]}, TetShape(mesh.positions, mesh.tets, t), of_tet[std::size_t(t)]};
      for (int k = 0; k < 6; ++k) e.node[4 + k] = middles_.of(q[edge_ends[k][0]], q[edge_ends[k][1]]);
      elements_.push_back(e);
    }
  }

  // Values at the mesh's nodes → at this one's.
  Sparse from_mesh() const { return interpolation(middles_, mesh_nodes_); }
  // Values at this one's nodes → at those of `fine`, whose mesh is this one's, refined. Functions that are
  // quadratic in the coarse tets are so in the fine ones, so the two are the same functions: each new
  // middle takes the values of the coarse functions Nᵢ and Nᵢⱼ there.
  Sparse to_refined(const Quadratic& fine) const {
    Triplets entries;
    for (int n = 0; n < fine.mesh_nodes_; ++n) entries.emplace_back(n, n, 1.0);
    std::vector<bool> done(fine.freedoms_.first.size(), false);
    for (std::size_t part = 0; part < fine.elements_.size(); ++part) {
      const Element &e = elements_[part / 8], &of_fine = fine.elements_[part];
      const auto place = [&](int node) {  // barycentric
        const int a = int(std::find(e.node, e.node + 10, node) - e.node);
        if (a < 4) return Eigen::Vector4d(Eigen::Vector4d::Unit(a));
        const auto [i, j] = edge_ends[a - 4];
        return Eigen::Vector4d(0.5 * (Eigen::Vector4d::Unit(i) + Eigen::Vector4d::Unit(j)));
      };
      for (int k = 0; k < 6; ++k) {
        const int middle = of_fine.node[4 + k];
        if (done[std::size_t(middle)]) continue;
        done[std::size_t(middle)] = true;
        const Eigen::Vector4d at =
            0.5 * (place(of_fine.node[edge_ends[k][0]]) + place(of_fine.node[edge_ends[k][1]]));
        for (int i = 0; i < 4; ++i)
          if (at[i] != 0 && at[i] != 0.5) entries.emplace_back(middle, e.node[i], at[i] * (2 * at[i] - 1));
        for (int m = 0; m < 6; ++m)
          if (const double w = 4 * at[edge_ends[m][0]] * at[edge_ends[m][1]]; w != 0)
            entries.emplace_back(middle, e.node[4 + m], w);
      }
    }
    return matrix_of(entries, int(fine.freedoms_.first.size()), int(freedoms_.first.size()));
  }
  const Freedoms& freedoms() const { return freedoms_; }

  // The load ∫ Nₐ f dV of a force a volume f that is given at the mesh's nodes (N × 3) and linear in tets.
  Vector load(const Points& force) const {
    Points sum = Points::Zero(Eigen::Index(freedoms_.first.size()), 3);
    for (const Element& e : elements_)
      for (int point = 0; point < 4; ++point) {
        Eigen::RowVector3d here = Eigen::RowVector3d::Zero();
        for (int i = 0; i < 4; ++i) here += e.shape.volume / 4 * weight(point, i) * force.row(e.node[i]);
        for (int i = 0; i < 4; ++i)
          sum.row(e.node[i]) += weight(point, i) * (2 * weight(point, i) - 1) * here;
        for (int k = 0; k < 6; ++k)
          sum.row(e.node[4 + k]) +=
              4 * weight(point, edge_ends[k][0]) * weight(point, edge_ends[k][1]) * here;
      }
    return freedoms_.from_nodes(sum);
  }

  // K u without K: from ∇u at each point of integration the stress σ = μ (∇u + ∇uᵀ) + λ tr(∇u) 1, and of
  // that σ ∇Nₐ.
  Vector forces(const Vector& displacements) const {
    const Points u = freedoms_.to_nodes(displacements);
    Points sum = Points::Zero(u.rows(), 3);
    for (const Element& e : elements_) {
      Nodal of_element, force = Nodal::Zero();
      for (int a = 0; a < 10; ++a) of_element.row(a) = u.row(e.node[a]);
      for (int point = 0; point < 4; ++point) {
        const Nodal g = gradients(e.shape, point);
        const Eigen::Matrix3d change = of_element.transpose() * g;  // ∂u_i/∂x_j
        const Eigen::Matrix3d stress = e.lame.mu * (change + change.transpose()) +
                                       e.lame.lambda * change.trace() * Eigen::Matrix3d::Identity();
        force += e.shape.volume / 4 * g * stress;
      }
      for (int a = 0; a < 10; ++a) sum.row(e.node[a]) += force.row(a);
    }
    return freedoms_.from_nodes(sum);
  }
  // K itself, for elimination. Its 3 × 3 block of nodes a and b is ∫ λ ∇Nₐ∇N_bᵀ + μ (∇N_b∇Nₐᵀ + ∇Nₐ·∇N_b 1)
  // dV.
  Sparse stiffness() const {
    Triplets entries;
    for (const Element& e : elements_)
      for (int a = 0; a < 10; ++a)
        for (int b = 0; b < 10; ++b) {
          Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
          for (int point = 0; point < 4; ++point) {
            const Nodal g = gradients(e.shape, point);
            const Vec3 ga = g.row(a), gb = g.row(b);
            block += e.shape.volume / 4 *
                     (e.lame.lambda * ga * gb.transpose() +
                      e.lame.mu * (gb * ga.transpose() + ga.dot(gb) * Eigen::Matrix3d::Identity()));
          }
          freedoms_.add(entries, e.node[a], e.node[b], block);
        }
    return matrix_of(entries, freedoms_.count, freedoms_.count);
  }
  // The diagonal of K, for conjugate gradients that do not have K.
  Vector diagonal() const {
    Points sum = Points::Zero(Eigen::Index(freedoms_.first.size()), 3);
    for (const Element& e : elements_)
      for (int point = 0; point < 4; ++point) {
        const Nodal g = gradients(e.shape, point);
        for (int a = 0; a < 10; ++a)
          sum.row(e.node[a]) += e.shape.volume / 4 *
                                ((e.lame.mu + e.lame.lambda) * g.row(a).cwiseAbs2() +
                                 e.lame.mu * g.row(a).squaredNorm() * Eigen::RowVector3d::Ones());
      }
    return freedoms_.from_nodes(sum);
  }

 private:
  using Nodal = Eigen::Matrix<double, 10, 3>;
  struct Element {
    int node[10];  // corners, then middles
    TetShape shape;
    Lame lame;
  };
  // λ of a corner at a point of integration: each point is nearest to one corner.
  static double weight(int point, int corner) {
    return point == corner ? 0.58541019662496845 : 0.13819660112501051;  // (5 + 3√5)/20 and (5 − √5)/20
  }
  // ∇N of the ten functions at a point of integration, as rows.
  static Nodal gradients(const TetShape& shape, int point) {
    Nodal g;
    for (int i = 0; i < 4; ++i) g.row(i) = (4 * weight(point, i) - 1) * shape.gradient.row(i);
    for (int k = 0; k < 6; ++k) {
      const auto [i, j] = edge_ends[k];
      g.row(4 + k) =
          4 * (weight(point, i) * shape.gradient.row(j) + weight(point, j) * shape.gradient.row(i));
    }
    return g;
  }

  Middles middles_;
  Freedoms freedoms_;
  int mesh_nodes_;
  std::vector<Element> elements_;
};

// K of the elements that the steppers have, at rest: k n nᵀ for a spring along n, k g gᵀ for a volume with
// g = ∂(6V). Neo-Hookean tets are at small strain linear tets of Lamé's moduli.
Sparse stiffness_at_rest(const ElementLists& elements, const TetMesh& mesh, const std::vector<Lame>& of_tet,
                         const Freedoms& freedoms) {
  const Points& x = mesh.positions;
  Triplets entries;
  for (const auto& [node, law] : elements.springs) {
    const Vec3 n = (x.row(node[1]) - x.row(node[0])).normalized();
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b)
        freedoms.add(entries, node[a], node[b], (a == b ? 1 : -1) * law.stiffness * n * n.transpose());
  }
  const bool springs = elements.neo_hookeans.empty();
  for (int t = 0; t < mesh.tets.rows(); ++t) {
    const TetShape shape(x, mesh.tets, t);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const Vec3 ga = shape.gradient.row(a), gb = shape.gradient.row(b);
        const auto& [mu, lambda] = of_tet[std::size_t(t)];
        // Springs give λ = μ already; their volume terms have the rest, λ − μ.
        Eigen::Matrix3d block = shape.volume * (springs ? lambda - mu : lambda) * ga * gb.transpose();
        if (!springs)
          block += shape.volume * mu * (gb * ga.transpose() + ga.dot(gb) * Eigen::Matrix3d::Identity());
        freedoms.add(entries, mesh.tets(t, a), mesh.tets(t, b), block);
      }
  }
  return matrix_of(entries, freedoms.count, freedoms.count);
}

// Of each node the least one that tets join it to.
std::vector<int> piece_of_nodes(const TetMesh& mesh) {
  std::vector<int> up(std::size_t(mesh.positions.rows()));
  std::iota(up.begin(), up.end(), 0);
  const auto top = [&](int n) {
    while (up[std::size_t(n)] != n) n = up[std::size_t(n)] = up[std::size_t(up[std::size_t(n)])];
    return n;
  };
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t)
    for (int i = 1; i < 4; ++i) {
      const auto [least, other] = std::minmax({top(mesh.tets(t, 0)), top(mesh.tets(t, i))});
      up[std::size_t(other)] = least;
    }
  for (int n = 0; n < int(up.size()); ++n) up[std::size_t(n)] = top(n);
  return up;
}

// The six rigid motions at small turns of each piece of the body, as fields (N × 3): along each axis, and
// about it through the piece's centre.
std::vector<Points> rigid_motions(const TetMesh& mesh) {
  const std::vector<int> piece = piece_of_nodes(mesh);
  std::vector<Points> motions;
  for (int first = 0; first < int(piece.size()); ++first) {
    if (piece[std::size_t(first)] != first) continue;
    std::vector<int> nodes;
    for (int n = first; n < int(piece.size()); ++n)
      if (piece[std::size_t(n)] == first) nodes.push_back(n);
    const Eigen::RowVector3d center = Points(mesh.positions(nodes, Eigen::all)).colwise().mean();
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 along = Vec3::Unit(axis);
      Points shift = Points::Zero(mesh.positions.rows(), 3), turn = shift;
      for (const int n : nodes) {
        shift.row(n) = along.transpose();
        turn.row(n) = along.cross((mesh.positions.row(n) - center).transpose()).transpose();
      }
      motions.insert(motions.end(), {shift, turn});
    }
  }
  return motions;
}

// The softest modes of a free body: K x = ω² M x with the diagonal mass M, softest first, apart from its
// rigid motions. Subspace iteration: solve K y = M x for some columns more than are asked for, then take the
// modes within what these span, until ω² of those that count stay. Rigid motions are taken out of x and y in
// each pass: K hardly resists them, so they would soon be all that y has.
struct Modes {
  Eigen::MatrixXd shapes;      // as columns: those asked for, and those equally soft as the last of them
  std::vector<int> same_from;  // of each the first that is equally soft, from one to the next
  bool stay = false;
};
Modes softest_modes(const Sparse& k, const Solver& solver, const Vector& m, const Eigen::MatrixXd& rigid,
                    int count) {
  constexpr int passes = 200;
  constexpr double stays = 1e-8;  // of ω²; shapes are then right to its square root
  Rng rng(19, 0);
  const int columns = std::min(int(k.rows() - rigid.cols()), count + 8);
  const Eigen::MatrixXd heavy = m.asDiagonal() * rigid;
  const Eigen::LDLT<Eigen::MatrixXd> of_rigid(rigid.transpose() * heavy);
  const auto without_rigid = [&](const Eigen::MatrixXd& of) -> Eigen::MatrixXd {
    return of - rigid * of_rigid.solve(heavy.transpose() * of);
  };
  Eigen::MatrixXd x =
      without_rigid(Eigen::MatrixXd::NullaryExpr(k.rows(), columns, [&] { return rng.uniform(-1, 1); }));
  Vector squared;  // ω²
  Modes modes;
  for (int pass = 0; pass < passes; ++pass) {
    const Eigen::MatrixXd y = without_rigid(solver.solve(m.asDiagonal() * x));
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(y.transpose() * (k * y),
                                                                          y.transpose() * m.asDiagonal() * y);
    x = y * eigen.eigenvectors();
    const Vector before = std::exchange(squared, eigen.eigenvalues());
    modes.same_from.clear();
    for (int c = 0; c < columns; ++c) {
      const bool same = c > 0 && squared[c] < equally_soft * squared[c - 1];
      if (c >= count && !same) break;
      modes.same_from.push_back(same ? modes.same_from.back() : c);
    }
    const Eigen::Index counting = Eigen::Index(modes.same_from.size());
    if (pass > 0 &&
        ((squared - before).head(counting).array().abs() < stays * squared.head(counting).array()).all()) {
      modes.stay = true;
      break;
    }
  }
  modes.shapes = x.leftCols(Eigen::Index(modes.same_from.size()));
  return modes;
}

// The material's answer at one fineness: the cage itself, or the cage cut in eight. Fields and loads are
// given at the cage's nodes, so both levels answer the same question.
class Level {
 public:
  Sparse to_mesh;  // values at the cage's nodes → at those of the mesh whose tets are quadratic
  Quadratic tets;
  Sparse from_coarse;  // what may move of the cage → of this

  Level(const TetMesh& mesh, const Sparse& interpolate, const std::vector<bool>& fixed,
        const std::vector<Lame>& of_tet, const Freedoms& coarse)
      : to_mesh(interpolate),
        tets(mesh, fixed, of_tet),
        from_coarse(over_axes(tets.from_mesh() * to_mesh, tets.freedoms(), coarse)) {}

  bool all_found() const { return all_found_; }  // of what moved() was asked so far

  // From now on conjugate gradients are shown the way by that level, whose tets this one's are cut from.
  void stand_on(const Level& below) {
    below_ = &below;
    from_below_ = over_axes(below.tets.to_refined(tets), tets.freedoms(), below.tets.freedoms());
  }
  // From now on all is solved by elimination. For thousands of freedoms.
  bool eliminate(double hold) {
    Sparse stiffness = tets.stiffness();
    stiffness += hold * Sparse(stiffness.diagonal().asDiagonal());
    whole_ = std::make_unique<Solver>(stiffness);
    return whole_->info() == Eigen::Success;
  }
  // The compliance f·u: how far a load moves the quadratic tets, as the work that it does. A residual of a
  // thousandth is enough, since the error of f·u falls with its square.
  double compliance(const Vector& load, double hold, const Solver& cage) const {
    return load.dot(moved(load, hold, cage, 1e-3));
  }
  // u, K u = f. By elimination, or by preconditioned conjugate gradients until the residual is that share of
  // the load: the residual r is answered by ½ D⁻¹ r, D the diagonal, and by the solution of what is coarser,
  // brought down and up again. That is the level below, whose tets this one's are cut from, or else the cage.
  Vector moved(const Vector& load, double hold, const Solver& cage, double residual) const {
    constexpr int most = 2000;
    if (whole_) return whole_->solve(load);
    const Sparse& from = below_ ? from_below_ : from_coarse;
    const Solver& coarser = below_ ? *below_->whole_ : cage;
    const Vector diagonal = tets.diagonal();
    const double enough = residual * load.norm();
    Vector u = Vector::Zero(load.size()), r = load, p;
    double rz = 0;
    for (int i = 0; i < most && r.norm() > enough; ++i) {
      const Vector z = 0.5 * r.cwiseQuotient(diagonal) + from * coarser.solve(from.transpose() * r);
      const double before = std::exchange(rz, r.dot(z));
      p = i == 0 ? z : Vector(z + rz / before * p);
      const Vector q = tets.forces(p) + hold * diagonal.cwiseProduct(p);
      const double step = rz / p.dot(q);
      u += step * p, r -= step * q;
    }
    if (!(r.norm() <= enough)) all_found_ = false;
    return u;
  }

 private:
  mutable std::atomic<bool> all_found_ = true;
  std::unique_ptr<Solver> whole_;
  const Level* below_ = nullptr;
  Sparse from_below_;  // what may move of that → of this
};

// Takes rigid motions out of force fields (N × 3 at the cage's nodes) until their loads move nothing as a
// whole: the sums of forces and torques vanish. A free body could not balance them otherwise. With no rigid
// motions given, nothing is taken out.
class Balance {
 public:
  Balance(const Level& level, const Freedoms& coarse, const std::vector<Points>& rigid)
      : level_(level), rigid_(rigid) {
    const Eigen::Index count = Eigen::Index(rigid.size());
    for (const Points& motion : rigid) motions_.push_back(coarse.from_nodes(motion));
    of_rigid_.resize(count, count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const Vector pushed = load(rigid[std::size_t(j)]);
      for (Eigen::Index i = 0; i < count; ++i) of_rigid_(i, j) = motions_[std::size_t(i)].dot(pushed);
    }
  }
  Points operator()(const Points& field) const {
    const Vector pushed = load(field);
    Vector of_field(of_rigid_.rows());
    for (std::size_t i = 0; i < rigid_.size(); ++i) of_field[Eigen::Index(i)] = motions_[i].dot(pushed);
    const Vector drift = of_rigid_.ldlt().solve(of_field);
    Points rest = field;
    for (std::size_t i = 0; i < rigid_.size(); ++i) rest -= drift[Eigen::Index(i)] * rigid_[i];
    return rest;
  }

 private:
  Vector load(const Points& field) const {
    return level_.from_coarse.transpose() * level_.tets.load(level_.to_mesh * field);
  }
  const Level& level_;
  const std::vector<Points>& rigid_;
  std::vector<Vector> motions_;
  Eigen::MatrixXd of_rigid_;  // work of a motion against another's load
};

// Of what these fields (N × 3) span the material's own modes: G x = γ S x, Gᵢⱼ = fᵢ·uⱼ the compliances and
// Sᵢⱼ the work of load i along field j. They are the same whichever combinations of them are given.
void take_the_materials(std::span<Points> fields, const Level& level, const Balance& balance,
                        const Freedoms& coarse, double hold, const Solver& cage) {
  const Eigen::Index count = Eigen::Index(fields.size());
  std::vector<Points> forces;
  std::vector<Vector> loads;
  for (const Points& field : fields) {
    forces.push_back(balance(field));
    loads.push_back(level.tets.load(level.to_mesh * forces.back()));
  }
  Eigen::MatrixXd gives(count, count), size(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Vector moved = level.moved(loads[std::size_t(j)], hold, cage, 1e-6),
                 along = coarse.from_nodes(forces[std::size_t(j)]);
    for (Eigen::Index i = 0; i < count; ++i) {
      gives(i, j) = loads[std::size_t(i)].dot(moved);
      size(i, j) = (level.from_coarse.transpose() * loads[std::size_t(i)]).dot(along);
    }
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> own(gives, size);
  if (own.info() != Eigen::Success) return;
  for (Eigen::Index k = 0; k < count; ++k) {
    Points& field = fields[std::size_t(k)];
    field.setZero();
    for (Eigen::Index j = 0; j < count; ++j) field += own.eigenvectors()(j, k) * forces[std::size_t(j)];
  }
}

}  // namespace

// Solves for each load field on the elements and on the levels of the material. Compliances are divided by
// the work of the load along its own field, so a field's size does not matter. `hold` is 0 where nodes are
// held; to the K of a free body it adds a billionth of the diagonal, which gives it an inverse. Loads count
// by the cube of how far they move the body, so the softest decide.
LockingShare locking_share(const TetMesh& rest, const std::vector<bool>& fixed,
                           const std::vector<Lame>& of_tet, const std::vector<double>& node_mass,
                           const ElementLists& elements) {
  const int tets = int(rest.tets.rows()), nodes = int(rest.positions.rows());
  if (tets > max_tets) return {};
  const Freedoms coarse(fixed);
  const double hold = coarse.count < 3 * nodes ? 0 : hold_free;
  Sparse stiffness = stiffness_at_rest(elements, rest, of_tet, coarse);
  stiffness += hold * Sparse(stiffness.diagonal().asDiagonal());
  const Solver solver(stiffness);
  if (solver.info() != Eigen::Success) return {1, false};

  bool is_found = true;
  std::vector<Points> fields, rigid;    // forces a volume
  std::vector<std::size_t> group_ends;  // of fields that are equally soft
  if (hold == 0) {
    for (int axis = 0; axis < 3; ++axis) fields.push_back(Vec3::Unit(axis).transpose().replicate(nodes, 1));
  } else {
    rigid = rigid_motions(rest);
    Vector mass(3 * nodes);
    for (int k = 0; k < 3 * nodes; ++k) mass[k] = node_mass[std::size_t(k / 3)];
    Eigen::MatrixXd motions(coarse.count, Eigen::Index(rigid.size()));
    for (std::size_t k = 0; k < rigid.size(); ++k) motions.col(Eigen::Index(k)) = coarse.from_nodes(rigid[k]);
    const Modes soft = softest_modes(stiffness, solver, mass, motions, modes);
    is_found = soft.stay;
    for (int k = 0; k < soft.shapes.cols(); ++k) {
      fields.push_back(coarse.to_nodes(soft.shapes.col(k)));
      if (k > 0 && soft.same_from[std::size_t(k)] == soft.same_from[std::size_t(k - 1)])
        group_ends.pop_back();
      group_ends.push_back(fields.size());
    }
  }

  std::deque<Level> levels;  // the second points to the first
  Sparse same(nodes, nodes);
  same.setIdentity();
  levels.emplace_back(rest, same, fixed, of_tet, coarse);
  if (tets <= max_refined_tets) {
    const Middles middles = middles_of(rest);
    std::vector<Lame> of_part;
    for (const Lame& lame : of_tet) of_part.insert(of_part.end(), 8, lame);
    levels.emplace_back(refined(rest, middles), interpolation(middles, nodes),
                        fixed_with_middles(fixed, middles), of_part, coarse);
    if (!levels.front().eliminate(hold)) return {1, false};
    levels.back().stand_on(levels.front());
  }

  std::vector<Balance> balance;
  for (const Level& level : levels) balance.emplace_back(level, coarse, rigid);
  std::size_t begin = 0;
  for (const std::size_t end : group_ends) {
    if (end - begin > 1)
      take_the_materials(std::span(fields).subspan(begin, end - begin), levels[0], balance[0], coarse, hold,
                         solver);
    begin = end;
  }
  struct Gives {
    double coarse = 0, reference = 0;
  };
  std::vector<Gives> gives(fields.size());
  parallel_for(int(fields.size()), [&](int f) {
    const Points& field = fields[std::size_t(f)];
    Gives& now = gives[std::size_t(f)];
    double before = 0;
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const Level& level = levels[l];
      const Points force = balance[l](field);
      const Vector load = level.tets.load(level.to_mesh * force);
      const Vector on_coarse = level.from_coarse.transpose() * load;
      const double size = on_coarse.dot(coarse.from_nodes(force));
      before = std::exchange(now.reference, level.compliance(load, hold, solver) / size);
      now.coarse = on_coarse.dot(solver.solve(on_coarse)) / size;
    }
    if (levels.size() > 1) now.reference += still_missing * (now.reference - before);
  });
  Gives sum;
  for (const Gives& one : gives) {  // the softest decide
    const double weight = std::pow(one.reference, 3);
    sum.coarse += weight * one.coarse, sum.reference += weight * one.reference;
  }
  const double share = sum.coarse / sum.reference;
  for (const Level& level : levels) is_found = is_found && level.all_found();
  if (!std::isfinite(share)) return {1, false};
  // Rounded, so that no other rounding on the way shows.
  return {std::clamp(std::round(512 * share) / 512, min_stiffness_share, max_stiffness_share), is_found};
}

}  // namespace limber::fem::detail
