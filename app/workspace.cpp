#include "app/workspace.h"

#include <algorithm>
#include <cmath>

#include "fem/observe.h"

namespace limber::app {

namespace {

constexpr double cells_a_radius = 4;
constexpr int most_cells = 200000;

void mark_tet(const TetMesh& cage, int t, plan::Workspace::Cell kind, plan::Workspace& w) {
  Vec3 corner[4];
  Box box;
  for (int i = 0; i < 4; ++i) box.include(corner[i] = cage.positions.row(cage.tets(t, i)).transpose());
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
        for (int i = 0; i < 4 && inside; ++i) {
          Vec3 with[4] = {corner[0], corner[1], corner[2], corner[3]};
          with[i] = p;
          inside = signed_volume(with[0], with[1], with[2], with[3]) >= 0;
        }
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

plan::Workspace workspace_of(const fem::World& world) {
  plan::Workspace w;
  w.robot_radius_m = fem::inner_radius_m(world, world.robot);
  w.box = world.bounds_m, w.walls = world.walls;
  const Vec3 size = w.box.size();
  w.cell_m = std::max(w.robot_radius_m / cells_a_radius, std::cbrt(size.prod() / most_cells));
  for (int i = 0; i < 3; ++i) w.cells[i] = std::max(1, int(std::ceil(size[i] / w.cell_m - 1e-9)));
  w.what.assign(std::size_t(w.cells.prod()), plan::Workspace::open);
  for (int b = 0; b < int(world.bodies.size()); ++b) {
    const fem::Body& body = world.bodies[std::size_t(b)];
    if (b == world.robot) continue;
    const auto kind = body.kind == fem::BodyKind::deformable ? plan::Workspace::soft : plan::Workspace::rigid;
    if (body.shape) mark_surface(body.shape->field, kind, w);
    for (int t = 0; t < body.cage.tets.rows() && !body.shape; ++t) mark_tet(body.cage, t, kind, w);
  }
  return w;
}

}  // namespace limber::app
