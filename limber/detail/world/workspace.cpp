#include "limber/detail/world/workspace.h"

#include <algorithm>
#include <cmath>

#include "fem/observe.h"

namespace limber::detail {

namespace {

constexpr double cells_a_radius = 4;
constexpr int max_cells = 200000, max_cells_a_sheet = 40000;

// The cells whose middles are in the tet; where a field is given, only those that were inside its surface
// while the tet was at rest.
void mark_tet(const Points& places, const TetMesh& rest, int t, const DistanceField* field,
              plan::Workspace::Cell kind, plan::Workspace& w) {
  Vec3 corner[4];
  Box box;
  for (int i = 0; i < 4; ++i) box.include(corner[i] = places.row(rest.tets(t, i)).transpose());
  const double volume = signed_volume(corner[0], corner[1], corner[2], corner[3]);
  Eigen::Vector3i first, last;
  for (int i = 0; i < 3; ++i) {
    first[i] = std::max(0, int(std::ceil((box.lower[i] - w.box.lower[i]) / w.cell_m - 0.5)));
    last[i] = std::min(w.cells[i] - 1, int(std::floor((box.upper[i] - w.box.lower[i]) / w.cell_m - 0.5)));
  }
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vec3 p = w.box.lower + w.cell_m * Vec3(x + 0.5, y + 0.5, z + 0.5);
        bool inside = true;
        Vec3 at_rest = Vec3::Zero();
        for (int i = 0; i < 4 && inside; ++i) {
          Vec3 with[4] = {corner[0], corner[1], corner[2], corner[3]};
          with[i] = p;
          const double part = signed_volume(with[0], with[1], with[2], with[3]);
          inside = part >= 0;
          at_rest += part / volume * rest.positions.row(rest.tets(t, i)).transpose();
        }
        if (inside && field) inside = field->at(at_rest) < 0;
        if (inside) w.what[std::size_t((z * w.cells.y() + y) * w.cells.x() + x)] = kind;
      }
}

// Where the middle of a cell is inside the body's fine surface.
void mark_surface(const DistanceField& field, plan::Workspace::Cell kind, plan::Workspace& w) {
  Eigen::Vector3i first, last;
  for (int i = 0; i < 3; ++i) {
    const double lower = field.lower_m[i], upper = lower + field.cell_m * (field.nodes[std::size_t(i)] - 1);
    first[i] = std::max(0, int(std::ceil((lower - w.box.lower[i]) / w.cell_m - 0.5)));
    last[i] = std::min(w.cells[i] - 1, int(std::floor((upper - w.box.lower[i]) / w.cell_m - 0.5)));
  }
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x)
        if (field.at(w.box.lower + w.cell_m * Vec3(x + 0.5, y + 0.5, z + 0.5)) < 0)
          w.what[std::size_t((z * w.cells.y() + y) * w.cells.x() + x)] = kind;
}

}  // namespace

plan::Workspace workspace_of(const fem::World& world, const std::optional<State>& given,
                             const std::vector<plan::Hole>& holes) {
  plan::Workspace w;
  w.holes = holes;
  w.robot_radius_m = fem::inner_radius_m(world, world.robot);
  w.box = world.bounds_m, w.walls = world.walls;
  const Vec3 size = w.box.size();
  w.cell_m = std::max(w.robot_radius_m / cells_a_radius,
                      std::cbrt(size.prod() / (holes.empty() ? max_cells : max_cells_a_sheet)));
  for (int i = 0; i < 3; ++i) w.cells[i] = std::max(1, int(std::ceil(size[i] / w.cell_m - 1e-9)));
  w.what.assign(std::size_t(w.cells.prod()), plan::Workspace::open);
  const State start = given.value_or(fem::start_state(world));
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    const fem::Body& body = world.bodies[std::size_t(b)];
    if (b == world.robot) continue;
    const auto kind = body.kind == fem::BodyKind::deformable ? plan::Workspace::soft : plan::Workspace::rigid;
    const bool at_rest = !body.moving || (!given && world.parting.pairs.empty());
    if (body.shape && at_rest) {
      mark_surface(body.shape->field, kind, w);
      continue;
    }
    const Points places = fem::body_positions(world, start, b);
    for (int t = 0; t < body.cage.tets.rows(); ++t)
      mark_tet(places, body.cage, t, body.shape ? &body.shape->field : nullptr, kind, w);
  }
  return w;
}

}  // namespace limber::detail
