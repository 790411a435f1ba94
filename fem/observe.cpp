#include "fem/observe.h"

#include <Eigen/SVD>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "fem/detail/overlap.h"
#include "fem/detail/stepper.h"
#include "fem/reference.h"

namespace limber::fem {
namespace {

Vec3 velocity(const State& state, int node) {
  return Eigen::Map<const Vec3f>(&state.velocities[3 * node]).cast<double>();
}

}  // namespace

Points body_positions(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  if (!body.moving) return body.cage.positions;
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(&state.positions.at(std::size_t(3 * body.first_node)), body.node_count(), 3)
      .cast<double>();
}

std::vector<LigamentPull> ligament_pulls(const World& world, const State& state) {
  std::vector<LigamentPull> pulls;
  const auto at_end = [&](const Ligament::End& end) {
    if (end.body < 0) return std::pair<Vec3, Vec3>(end.point_m, Vec3::Zero());
    std::pair<Vec3, Vec3> sums(Vec3::Zero(), Vec3::Zero());  // place, velocity
    for (std::size_t i = 0; i < end.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        const Body& body = world.bodies[std::size_t(end.body)];
        const std::size_t at = std::size_t(3 * end.nodes[i] + c);
        sums.first[c] +=
            end.weights[i] * (body.moving ? double(state.positions[at])
                                          : body.cage.positions(end.nodes[i] - body.first_node, c));
        if (body.moving) sums.second[c] += end.weights[i] * double(state.velocities[at]);
      }
    return sums;
  };
  for (const Ligament& ligament : world.ligaments) {
    const auto [from, velocity] = at_end(ligament.ends[0]);
    const auto [to, other_velocity] = at_end(ligament.ends[1]);
    const double length = (to - from).norm(), longer = length - ligament.rest_length_m;
    double tension = 0;
    if (length > 0 && (longer > 0 || ligament.pushes))
      tension = ligament.stiffness_n_m * longer +
                ligament.damping_n_s_m * (other_velocity - velocity).dot(to - from) / length;
    pulls.push_back({from, to, ligament.pushes ? tension : std::max(0.0, tension)});
  }
  return pulls;
}

double time_s(const World& world, const State& state) { return double(state.step) * world.dt_s; }

double volume_m3(const World& world, const State& state, int body) {
  return volume(TetMesh{body_positions(world, state, body), world.bodies[body].cage.tets});
}

double largest_volume_change(const World& world, const State& state) {
  double largest = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b)
    if (world.bodies[b].moving)
      largest = std::max(largest, std::abs(volume_m3(world, state, b) / world.bodies[b].rest_volume_m3 - 1));
  return largest;
}

Vec3 center_of_mass_m(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  const Points positions = body_positions(world, state, index);
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < body.node_count(); ++n) sum += body.node_mass_kg[n] * positions.row(n).transpose();
  return sum / body.mass_kg;
}

double inner_radius_m(const World& world, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  const auto corner = [&](int node) -> Vec3 { return body.cage.positions.row(node); };
  Vec3 center = Vec3::Zero();
  for (int n = 0; n < body.node_count(); ++n) center += body.node_mass_kg[n] * corner(n) / body.mass_kg;
  if (body.shape)
    if (const double distance = body.shape->field.at(center); distance < 0) return -distance;
  double radius = std::numeric_limits<double>::infinity();
  for (const auto& t : body.surface.rowwise())
    radius = std::min(radius, detail::distance_to_triangle(center, corner(t[0]), corner(t[1]), corner(t[2])));
  return radius;
}

Vec3 center_velocity_m_s(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < body.node_count() && body.moving; ++n)
    sum += body.node_mass_kg[n] * velocity(state, body.first_node + n);
  return sum / body.mass_kg;
}

double mean_speed_m_s(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  double sum = 0;
  for (int n = 0; n < body.node_count() && body.moving; ++n)
    sum += body.node_mass_kg[n] * velocity(state, body.first_node + n).norm();
  return sum / body.mass_kg;
}

double elastic_energy_j(const World& world, const State& state) {
  return elastic_energy_j(world, reference_state(state));
}

double elastic_energy_j(const World& world, const State& state, int body) {
  return elastic_energy_j(world, reference_state(state), body);
}

double kinetic_energy_j(const World& world, const State& state) {
  double energy = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b) energy += kinetic_energy_j(world, state, b);
  return energy;
}

double kinetic_energy_j(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  double energy = 0;
  for (int n = 0; n < body.node_count() && body.pushed(); ++n)
    energy += 0.5 * body.node_mass_kg[n] * velocity(state, body.first_node + n).squaredNorm();
  return energy;
}

Strains strains(const World& world, const State& state, int index) {
  const Body& body = world.bodies.at(std::size_t(index));
  const Points now = body_positions(world, state, index);
  const auto edges_of = [&](const Points& p, int tet) {
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i)
      edges.col(i) = p.row(body.cage.tets(tet, i + 1)) - p.row(body.cage.tets(tet, 0));
    return edges;
  };
  Strains result;
  for (int t = 0; t < body.cage.tets.rows(); ++t) {
    const Eigen::Matrix3d gradient = edges_of(now, t) * edges_of(body.cage.positions, t).inverse();
    const Eigen::Matrix3d green = 0.5 * (gradient.transpose() * gradient - Eigen::Matrix3d::Identity());
    const Eigen::Matrix3d deviator = green - green.trace() / 3 * Eigen::Matrix3d::Identity();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(green, Eigen::EigenvaluesOnly);
    result.largest.push_back(solver.eigenvalues().cwiseAbs().maxCoeff());
    const auto stretch_of = [](double strain) { return std::sqrt(std::max(0.0, 1 + 2 * strain)); };
    result.longest.push_back(stretch_of(solver.eigenvalues().maxCoeff()));
    result.shortest.push_back(stretch_of(solver.eigenvalues().minCoeff()));
    result.von_mises.push_back(std::sqrt(2.0 / 3 * deviator.squaredNorm()));
  }
  return result;
}

std::vector<double> volume_changes(const World& world, const State& state, int index) {
  const TetMesh& rest = world.bodies.at(std::size_t(index)).cage;
  const Points now = body_positions(world, state, index);
  const auto volume_of = [&](const Points& p, int t) {
    const auto q = rest.tets.row(t);
    return signed_volume(p.row(q[0]), p.row(q[1]), p.row(q[2]), p.row(q[3]));
  };
  std::vector<double> changes;
  for (int t = 0; t < rest.tets.rows(); ++t)
    changes.push_back(volume_of(now, t) / volume_of(rest.positions, t) - 1);
  return changes;
}

namespace {

// The robot's nodes as seen from its centre of mass, (N × 3).
Points robot_from_center(const World& world, const State& state) {
  Points places = body_positions(world, state, world.robot);
  places.rowwise() -= center_of_mass_m(world, state, world.robot).transpose();
  return places;
}

// About a unit axis a: x ↦ 2 a (a·x) − x.
Points half_turned(const Points& shape, const Vec3& axis) {
  return 2 * (shape * axis) * axis.transpose() - shape;
}

}  // namespace

double turn_from_goal_shape_deg(const World& world, const State& state,
                                const std::optional<Vec3>& half_turn) {
  const Points now = robot_from_center(world, state);
  const Body& robot = world.bodies[std::size_t(world.robot)];
  const auto turn_from = [&](const Points& shape) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int n = 0; n < robot.node_count(); ++n)
      sum += robot.node_mass_kg[std::size_t(n)] * now.row(n).transpose() * shape.row(n);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d u = svd.matrixU();
    if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;  // a rotation, not a mirror
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(u * svd.matrixV().transpose()));
    return std::abs(turn.angle()) * 180 / std::numbers::pi;
  };
  const double turn = turn_from(world.goal_shape_m);
  return half_turn ? std::min(turn, turn_from(half_turned(world.goal_shape_m, *half_turn))) : turn;
}

double distance_from_goal_shape_m(const World& world, const State& state,
                                  const std::optional<Vec3>& half_turn) {
  const Points now = robot_from_center(world, state);
  const auto distance_from = [&](const Points& shape) { return (now - shape).rowwise().norm().maxCoeff(); };
  const double distance = distance_from(world.goal_shape_m);
  return half_turn ? std::min(distance, distance_from(half_turned(world.goal_shape_m, *half_turn)))
                   : distance;
}

Hole hole_of(const World& world, const State& state, int ring) {
  const Points nodes = body_positions(world, state, ring);
  const Vec3 middle = nodes.colwise().mean().transpose();
  const Points from_middle = nodes.rowwise() - middle.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(from_middle.transpose() * from_middle);
  const Vec3 normal = spread.eigenvectors().col(0);  // along which they spread least
  const Points in_plane = from_middle - (from_middle * normal) * normal.transpose();
  return {middle, normal, in_plane.rowwise().norm().mean()};
}

// Neighbours that the plane cuts share an edge that it cuts.
int pieces_through(const World& world, const State& state, int ring) {
  const Hole hole = hole_of(world, state, ring);
  const Points nodes = body_positions(world, state, world.robot);
  const Eigen::VectorXd height = (nodes.rowwise() - hole.middle_m.transpose()) * hole.normal;
  const Tets& tets = world.bodies[std::size_t(world.robot)].cage.tets;
  std::map<std::pair<int, int>, int> piece_of_edge;
  std::vector<int> parent;  // of each cut tet's piece
  const auto root = [&](int piece) {
    while (parent[std::size_t(piece)] != piece) piece = parent[std::size_t(piece)];
    return piece;
  };
  for (Eigen::Index t = 0; t < tets.rows(); ++t) {
    std::vector<std::pair<int, int>> edges;
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        const auto [a, b] = std::minmax(tets(t, i), tets(t, j));
        if ((height[a] < 0) == (height[b] < 0)) continue;
        const double share = height[a] / (height[a] - height[b]);
        sum += (1 - share) * nodes.row(a).transpose() + share * nodes.row(b).transpose();
        edges.emplace_back(a, b);
      }
    if (edges.empty() || (sum / double(edges.size()) - hole.middle_m).norm() >= hole.radius_m) continue;
    const int piece = int(parent.size());
    parent.push_back(piece);
    for (const auto& edge : edges)
      if (const auto [found, is_new] = piece_of_edge.try_emplace(edge, piece); !is_new)
        parent[std::size_t(root(piece))] = root(found->second);
  }
  int pieces = 0;
  for (std::size_t p = 0; p < parent.size(); ++p) pieces += parent[p] == int(p);
  return pieces;
}

int inverted_tets(const World& world, const State& state) {
  int count = 0;
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    if (!world.bodies[b].moving) continue;
    const Points p = body_positions(world, state, b);
    const Tets& tets = world.bodies[b].cage.tets;
    for (int t = 0; t < tets.rows(); ++t)
      count +=
          !(signed_volume(p.row(tets(t, 0)), p.row(tets(t, 1)), p.row(tets(t, 2)), p.row(tets(t, 3))) > 0);
  }
  return count;
}

namespace {

// Whether all singular values of F lie within 1/s and s, which is clear where their squares, or those of the
// inverse, sum to no more than s².
bool stretched_within(const Eigen::Matrix3d& f, double s) {
  const double square = s * s;
  const Eigen::Matrix3d c = f.transpose() * f;
  const double determinant = f.determinant();
  const double cofactors = 0.5 * (c.trace() * c.trace() - (c * c).trace());  // Σ of products of two squares
  if (c.trace() <= square && cofactors <= square * determinant * determinant) return true;
  const Vec3 squares =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(c, Eigen::EigenvaluesOnly).eigenvalues();
  return squares[2] <= square && squares[0] * square >= 1;
}

}  // namespace

Fault fault_of(const World& world, const State& state) {
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    const Body& body = world.bodies[b];
    if (!body.moving) continue;
    const auto corner = [at = &state.positions[std::size_t(3 * body.first_node)]](int node) -> Vec3 {
      return Eigen::Map<const Vec3f>(at + 3 * node).cast<double>();
    };
    double volume = 0;
    for (Eigen::Index k = 0; k < body.cage.tets.rows(); ++k) {
      const auto t = body.cage.tets.row(k);
      const Vec3 a = corner(t[0]);
      Eigen::Matrix3d edges;
      for (int i = 0; i < 3; ++i) edges.col(i) = corner(t[i + 1]) - a;
      const double of_tet = edges.determinant() / 6;
      if (!(of_tet > 0)) return {Fault::inverted, b};
      volume += of_tet;
      if (std::isfinite(body.max_stretch) &&
          !stretched_within(edges * body.inverse_rest_edges[std::size_t(k)], body.max_stretch))
        return {Fault::stretched, b};
    }
    if (!(std::abs(volume / body.rest_volume_m3 - 1) <= body.max_volume_change)) return {Fault::volume, b};
  }
  return {};
}

Penetration deepest_penetration(const World& world, const State& state) {
  Penetration deepest;
  std::vector<Points> positions;
  std::vector<Box> boxes;
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    positions.push_back(body_positions(world, state, b));
    boxes.push_back(bounding_box(positions.back()));
  }
  for (int a = 0; a < int(world.bodies.size()); ++a) {
    const Body& one = world.bodies[a];
    for (int b = a + 1; b < int(world.bodies.size()); ++b) {
      const Body& two = world.bodies[b];
      if ((!one.pushed() && !two.pushed()) || !detail::can_overlap(boxes[a], boxes[b])) continue;
      const auto overlap = detail::deepest_overlap({positions[a], one.cage.tets, one.surface},
                                                   {positions[b], two.cage.tets, two.surface});
      if (overlap.depth_m > deepest.depth_m) deepest = {overlap.depth_m, a, b, overlap.place};
    }
    if (!world.walls || !one.moving) continue;
    for (int n = 0; n < one.node_count(); ++n) {
      const Vec3 p = positions[a].row(n);
      const double out =
          std::max((world.bounds_m.lower - p).maxCoeff(), (p - world.bounds_m.upper).maxCoeff());
      if (!one.fixed[n] && out > deepest.depth_m) deepest = {out, a, -1, p};
    }
  }
  return deepest;
}

int piercing_edges(const World& world, const State& state) {
  int count = 0;
  std::vector<Points> positions;
  std::vector<Box> boxes;
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    positions.push_back(body_positions(world, state, b));
    boxes.push_back(bounding_box(positions.back()));
  }
  for (int a = 0; a < int(world.bodies.size()); ++a)
    for (int b = a + 1; b < int(world.bodies.size()); ++b) {
      const Body &one = world.bodies[a], &two = world.bodies[b];
      if ((one.pushed() || two.pushed()) && detail::can_overlap(boxes[a], boxes[b]))
        count += detail::passing_edges({positions[a], one.cage.tets, one.surface},
                                       {positions[b], two.cage.tets, two.surface});
    }
  return count;
}

struct ContactProbe::Impl {
  detail::Stepper<float> stepper;
};

ContactProbe::ContactProbe(const World& world)
    : impl_(new Impl{detail::Stepper<float>(world, 1, detail::best_isa())}) {}
ContactProbe::~ContactProbe() = default;

std::vector<ContactForce> ContactProbe::forces(const State& state, const Control& control) {
  detail::Stepper<float>& stepper = impl_->stepper;
  stepper.load(0, state.step, state.positions.data(), state.velocities.data(), control, true);
  std::vector<ContactForce> forces;
  for (const auto& e : stepper.contact_records(0)) {
    ContactForce force{e.body, e.against, Vec3::Zero(), Vec3::Zero(), double(e.depth)};
    for (int c = 0; c < 3; ++c) force.force_n[c] = double(e.force[c]), force.place_m[c] = double(e.place[c]);
    forces.push_back(force);
  }
  return forces;
}

std::vector<ContactForce> contact_forces(const World& world, const State& state, const Control& control) {
  return ContactProbe(world).forces(state, control);
}

std::vector<double> contact_loads_n(const World& world, const std::vector<ContactForce>& forces) {
  std::vector<double> loads(world.bodies.size(), 0);
  for (const ContactForce& f : forces) {
    if (f.body == f.other) continue;
    loads[std::size_t(f.body)] += f.force_n.norm();
    if (f.other >= 0) loads[std::size_t(f.other)] += f.force_n.norm();
  }
  return loads;
}

bool within_contact_loads(const World& world, const std::vector<ContactForce>& forces) {
  const std::vector<double> loads = contact_loads_n(world, forces);
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (!(loads[b] <= world.bodies[b].max_contact_load_n)) return false;
  return true;
}

std::vector<PairForce> pair_forces(const std::vector<ContactForce>& forces) {
  std::map<std::pair<int, int>, PairForce> pairs;
  for (const ContactForce& f : forces) {
    const bool turned = f.other >= 0 && f.other < f.body;
    const int body = turned ? f.other : f.body, other = turned ? f.body : f.other;
    PairForce& pair = pairs.try_emplace({body, other}, PairForce{body, other, Vec3::Zero(), 0}).first->second;
    pair.force_n += turned ? Vec3(-f.force_n) : f.force_n;
    ++pair.contacts;
  }
  std::vector<PairForce> sums;
  for (const auto& [key, pair] : pairs) sums.push_back(pair);
  return sums;
}

}  // namespace limber::fem
