// The arrays that steppers read, made from bodies. All is computed in double; the reference reads that, and
// the float steppers its roundings, so the two differ by rounding alone.
//
// What always holds: nodes and elements are numbered body after body, moving bodies first, so the elements
// of a body are one range and State is the front of all nodes. A block has sixteen elements in columns, for
// the kernel that puts elements of one rollout side by side in a vector; each run begins a block of its
// own. A law's members are all numbers of one type, so a law is read as an array (kernels.h).
#include "fem/detail/make_tables.h"

#include <algorithm>
#include <cstddef>

#include <Eigen/LU>

#include "fem/detail/make_body.h"

namespace limber::fem::detail {
namespace {

// Fills the blocks of a run. The last is filled up with the run's last element, which is harmless to compute;
// the kernel adds no forces of those.
template <class E>
void pack(ElementTable<E>& table, Run& run) {
  constexpr std::size_t size = block_size;
  run.block = int(table.blocks.size());
  const std::size_t count = std::size_t(run.count), blocks = (count + size - 1) / size;
  table.blocks.resize(table.blocks.size() + blocks);
  for (std::size_t e = 0; e < blocks * size; ++e) {
    const E& element = table.elements[std::size_t(run.element) + std::min(e, count - 1)];
    auto& block = table.blocks[std::size_t(run.block) + e / size];
    for (int i = 0; i < E::nodes; ++i) block.node[i][e % size] = element.node[i];
    const float* numbers = reinterpret_cast<const float*>(&element.law);
    for (int i = 0; i < Block<E>::numbers; ++i) block.law[i][e % size] = numbers[i];
  }
}

// A law of another kind of number, member by member.
template <class To, class From>
void convert(const From& from, To& to) {
  const double* numbers = reinterpret_cast<const double*>(&from);
  float* out = reinterpret_cast<float*>(&to);
  for (std::size_t i = 0; i < sizeof(From) / sizeof(double); ++i) out[i] = float(numbers[i]);
}

}  // namespace

void append(const ElementLists& of_body, int first_node, ElementLists& all) {
  const auto add = [&](const auto& from, auto& to) {
    for (auto element : from) {
      for (int& n : element.node) n += first_node;
      to.push_back(element);
    }
  };
  add(of_body.springs, all.springs), add(of_body.dashpots, all.dashpots);
  add(of_body.volumes, all.volumes), add(of_body.neo_hookeans, all.neo_hookeans);
}

void append_nodes(const Body& body, Tables<double>& tables) {
  for (int n = 0; n < body.node_count(); ++n) {
    tables.node_mass.push_back(body.node_mass_kg[n]);
    tables.inverse_mass.push_back(body.fixed[n] ? 0 : 1 / body.node_mass_kg[n]);
    for (int c = 0; c < 3; ++c) tables.rest_positions.push_back(body.cage.positions(n, c));
  }
}

// Of a rigid body at rest, with X from its centre of mass: S = Σ m X Xᵀ, of which the affine map of the
// nodes is found, and the inertia J = tr(S) I − S; both inverted, kg⁻¹ m⁻². Masses are those at the nodes,
// so J is that of points. How they are used: docs/dynamics.md, "Rigid bodies".
RigidTable make_rigid(const Body& body) {
  const Vec3 center = center_of(body, body.cage.positions);
  RigidTable table{body.node_mass_kg, {}, {}};
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int n = 0; n < body.node_count(); ++n) {
    const Vec3 place = body.cage.positions.row(n).transpose() - center;
    table.place.insert(table.place.end(), place.data(), place.data() + 3);
    spread += body.node_mass_kg[n] * place * place.transpose();
  }
  const auto put = [](const Eigen::Matrix3d& m, double* six) {
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) *six++ = m(i, j);
  };
  put(spread.inverse(), table.sums.inverse_spread);
  put((spread.trace() * Eigen::Matrix3d::Identity() - spread).inverse(), table.sums.inverse_inertia);
  table.sums.inverse_mass = 1 / body.mass_kg;
  return table;
}

// Node numbers and ranges are copied as they are, numbers rounded.
Tables<float> single_precision(const Tables<double>& t) {
  Tables<float> out;
  out.elements.runs = t.elements.runs, out.elements.runs_of_body = t.elements.runs_of_body;
  const auto round = [&]<int Kind>(std::integral_constant<int, Kind>) {
    auto& to = std::get<Kind>(out.elements.of_kind);
    for (const auto& element : std::get<Kind>(t.elements.of_kind).elements) {
      auto& copy = to.elements.emplace_back();
      std::copy(std::begin(element.node), std::end(element.node), copy.node);
      convert(element.law, copy.law);
    }
    for (Run& run : out.elements.runs)
      if (run.kind == Kind) pack(to, run);
  };
  [&]<int... Kind>(std::integer_sequence<int, Kind...>) { (round(std::integral_constant<int, Kind>()), ...); }
  (std::make_integer_sequence<int, kinds>());
  const auto copy = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  out.node_mass = copy(t.node_mass), out.inverse_mass = copy(t.inverse_mass);
  out.rest_positions = copy(t.rest_positions), out.goal_from_center = copy(t.goal_from_center);
  out.pair_friction = copy(t.pair_friction), out.skin = copy(t.skin);
  return out;
}

}  // namespace limber::fem::detail
