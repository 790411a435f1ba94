#include "app/seen.h"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>

#include "app/motion_files.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "meshing/surface_overlap.h"

namespace limber::app {

namespace {

// Whom a body presses: another body, or a wall of the bounds.
struct Side {
  int body, other;  // other −1: a wall
  int axis = -1, upper = 0;
  auto operator<=>(const Side&) const = default;
};
using Pressing = std::map<Side, double>;  // the forces' lengths, summed

Pressing pressing_in(const fem::World& world, const State& state) {
  Pressing pressing;
  for (const fem::ContactForce& contact : fem::contact_forces(world, state)) {
    if (contact.other == contact.body) continue;
    Side side{contact.body, contact.other};
    if (contact.other >= 0) {
      side = {std::min(contact.body, contact.other), std::max(contact.body, contact.other)};
    } else {
      const Vec3 below = world.bounds_m.lower - contact.place_m,
                 above = contact.place_m - world.bounds_m.upper;
      side.upper = above.maxCoeff() > below.maxCoeff();
      (side.upper ? above : below).maxCoeff(&side.axis);
    }
    pressing[side] += contact.force_n.norm();
  }
  return pressing;
}

double gap_to_wall(const Box& bounds, const Side& side, const Box& surface) {
  const double gap = side.upper ? bounds.upper[side.axis] - surface.upper[side.axis]
                                : surface.lower[side.axis] - bounds.lower[side.axis];
  return std::max(0.0, gap);
}

class Surfaces {
 public:
  Surfaces(const fem::World& world, const std::vector<PreparedBody>& bodies)
      : world_(world), bodies_(bodies) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const Points rest = surface_at_rest(world.bodies[b], bodies[b]);
      at_rest_.emplace_back(shapes_.emplace_back(rest, bodies[b].surface.triangles), rest);
    }
  }

  SeenFrame measure(const State& state, const Pressing& pressing, double least_force_n) const {
    std::deque<meshing::PlacedSurface> moved;
    std::vector<const meshing::PlacedSurface*> now;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      now.push_back(world_.bodies[b].moving
                        ? &moved.emplace_back(shapes_[b], surface_at(world_, bodies_[b], state, int(b)))
                        : &at_rest_[b]);
    SeenFrame frame;
    for (int a = 0; a < int(now.size()); ++a) {
      const fem::Body& body = world_.bodies[std::size_t(a)];
      const meshing::PlacedSurface& one = *now[std::size_t(a)];
      for (int b = a + 1; b < int(now.size()); ++b) {
        if (!body.moving && !world_.bodies[std::size_t(b)].moving) continue;
        const double depth = meshing::overlap(one, *now[std::size_t(b)]).depth_m;
        if (depth > frame.overlap_m) frame.overlap_m = depth, frame.overlap_body = a, frame.overlap_other = b;
      }
      if (!body.moving || body.kind != fem::BodyKind::deformable) continue;
      const double depth = meshing::self_overlap(one, at_rest_[std::size_t(a)]).depth_m;
      if (depth > frame.self_overlap_m) frame.self_overlap_m = depth, frame.self_overlap_body = a;
    }
    for (const auto& [side, force] : pressing) {
      if (!(force > least_force_n)) continue;
      const meshing::PlacedSurface& one = *now[std::size_t(side.body)];
      frame.gaps.push_back({side.body, side.other,
                            side.other < 0
                                ? gap_to_wall(world_.bounds_m, side, one.box())
                                : meshing::gap(one, *now[std::size_t(side.other)], 1e6).distance_m});
    }
    return frame;
  }

 private:
  const fem::World& world_;
  const std::vector<PreparedBody>& bodies_;
  std::deque<meshing::SurfaceShape> shapes_;
  std::deque<meshing::PlacedSurface> at_rest_;
};

}  // namespace

std::vector<SeenFrame> measure_seen(const fem::World& world, const std::vector<PreparedBody>& bodies,
                                    const std::vector<State>& frames) {
  const Surfaces surfaces(world, bodies);
  std::vector<Pressing> pressing(frames.size());
  parallel_for(int(frames.size()),
               [&](int f) { pressing[std::size_t(f)] = pressing_in(world, frames[std::size_t(f)]); });
  double largest_n = 0;
  for (const Pressing& of_frame : pressing)
    for (const auto& [side, force] : of_frame) largest_n = std::max(largest_n, force);
  std::vector<SeenFrame> seen(frames.size());
  parallel_for(int(frames.size()), [&](int f) {
    const std::size_t i = std::size_t(f);
    seen[i] = surfaces.measure(frames[i], pressing[i], pressing_share * largest_n);
  });
  return seen;
}

}  // namespace limber::app
