#include "limber/detail/world/seen.h"

#include <algorithm>
#include <map>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/observe.h"
#include "fem/parting.h"
#include "limber/detail/world/surface_at.h"
#include "limber/detail/world/wall.h"

namespace limber::detail {

namespace {

// Whom a body presses: another body, or a wall of the bounds.
struct Side {
  int body, other;  // other −1: a wall
  Wall wall = {};
  auto operator<=>(const Side&) const = default;
};
struct Press {
  double force_n = 0;  // the lengths of all forces, summed
  double strongest_n = 0;
  Vec3 place_m = Vec3::Zero();  // of the strongest
};
using Pressing = std::map<Side, Press>;

Pressing pressing_in(const fem::World& world, const State& state) {
  Pressing pressing;
  for (const fem::ContactForce& contact : fem::contact_forces(world, state)) {
    if (contact.other == contact.body) continue;
    Side side{contact.body, contact.other};
    if (contact.other >= 0) {
      side = {std::min(contact.body, contact.other), std::max(contact.body, contact.other)};
    } else {
      side.wall = wall_at(world.bounds_m, contact.place_m);
    }
    const double force = contact.force_n.norm();
    Press& press = pressing[side];
    press.force_n += force;
    if (force > press.strongest_n) press.strongest_n = force, press.place_m = contact.place_m;
  }
  return pressing;
}

// From the nearest point of either surface, 0 where that is inside the other.
double gap_near(const meshing::PlacedSurface& a, const meshing::PlacedSurface& b, const Vec3& place) {
  const auto from = [&](const meshing::PlacedSurface& one, const meshing::PlacedSurface& other) {
    const Vec3 point = one.closest_point(place);
    return other.winding(point) > 0.5 ? 0.0 : other.distance(point);
  };
  return std::min(from(a, b), from(b, a));
}

// How far a surface is beyond the walls, farther than it was.
double beyond_walls(const Box& bounds, const Box& before, const Box& now) {
  const auto more = [](const Vec3& then, const Vec3& later) {
    return (later.cwiseMax(0) - then.cwiseMax(0)).maxCoeff();
  };
  return std::max({0.0, more(bounds.lower - before.lower, bounds.lower - now.lower),
                   more(before.upper - bounds.upper, now.upper - bounds.upper)});
}

double gap_to_wall(const Box& bounds, const Side& side, const Box& surface) {
  const int axis = side.wall.axis;
  const double gap =
      side.wall.upper ? bounds.upper[axis] - surface.upper[axis] : surface.lower[axis] - bounds.lower[axis];
  return std::max(0.0, gap);
}

std::vector<SeenFrame::Gap> gaps_of(const fem::World& world,
                                    const std::vector<const meshing::PlacedSurface*>& now,
                                    const Pressing& pressing) {
  std::vector<SeenFrame::Gap> gaps;
  for (const auto& [side, press] : pressing) {
    const meshing::PlacedSurface& one = *now[std::size_t(side.body)];
    if (side.other < 0) {
      const Vec3 near = one.closest_point(press.place_m);
      gaps.push_back({side.body, -1, gap_to_wall(world.bounds_m, side, one.box()),
                      gap_to_wall(world.bounds_m, side, {near, near}), press.force_n});
    } else {
      const meshing::PlacedSurface& other = *now[std::size_t(side.other)];
      const double near = gap_near(one, other, press.place_m);
      gaps.push_back({side.body, side.other, meshing::gap(one, other, near).distance_m, near, press.force_n});
    }
  }
  return gaps;
}

}  // namespace

Surfaces::Surfaces(const fem::World& world, const std::vector<PreparedBody>& bodies)
    : world_(world), bodies_(bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Points rest = surface_at_rest(world.bodies[b], bodies[b]);
    at_rest_.emplace_back(shapes_.emplace_back(rest, bodies[b].surface.triangles), rest);
  }
}

SeenFrame Surfaces::at(const State& state) const {
  const std::uint64_t hash = hash_of(state);
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = known_.find(hash); known != known_.end()) return known->second;
  }
  const SeenFrame frame = measure(state);
  const std::lock_guard lock(mutex_);
  return known_[hash] = frame;
}

void Surfaces::require_apart(const State& start, bool as_promised) const {
  const SeenFrame seen = at(start);
  if (seen.overlap_body < 0) return;
  const auto size_m = [&](int body) { return shapes_[std::size_t(body)].size_m(); };
  const auto name = [&](int body) { return world_.bodies[std::size_t(body)].name; };
  const int one = seen.overlap_body, other = seen.overlap_other,
            smaller = size_m(one) < size_m(other) ? one : other;
  const std::string what = fmt::format("bodies {} and {} overlap at the start, {:.3g} m deep", name(one),
                                       name(other), seen.overlap_m);
  if (seen.overlap_m > fem::deepest_parted_share * size_m(smaller))
    throw InputError(fmt::format("{}, which is more than a quarter of {}'s size, {:.3g} m; move them apart",
                                 what, name(smaller), size_m(smaller)));
  const double promised = SeenLimits().overlap, robot_m = size_m(world_.robot);
  if (as_promised && world_.touches_on_surfaces() && seen.overlap_m > promised * robot_m)
    throw InputError(fmt::format(
        "{}, {:.2f} % of the robot's size, where {:g} % is promised of every frame; move them apart", what,
        100 * seen.overlap_m / robot_m, 100 * promised));
}

SeenFrame Surfaces::measure(const State& state) const {
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
      if (!body.pushed() && !world_.bodies[std::size_t(b)].pushed()) continue;
      const double depth = meshing::overlap(one, *now[std::size_t(b)]).depth_m;
      if (depth > frame.overlap_m) frame.overlap_m = depth, frame.overlap_body = a, frame.overlap_other = b;
    }
    if (world_.walls && body.pushed()) {
      const double depth = beyond_walls(world_.bounds_m, at_rest_[std::size_t(a)].box(), one.box());
      if (depth > frame.wall_overlap_m) frame.wall_overlap_m = depth, frame.wall_overlap_body = a;
    }
    if (!body.moving || body.kind != fem::BodyKind::deformable) continue;
    const double depth = meshing::self_overlap(one, at_rest_[std::size_t(a)]).depth_m;
    if (depth > frame.self_overlap_m) frame.self_overlap_m = depth, frame.self_overlap_body = a;
  }
  frame.gaps = gaps_of(world_, now, pressing_in(world_, state));
  return frame;
}

void keep_what_presses(std::vector<SeenFrame>& frames) {
  double largest_n = 0;
  for (const SeenFrame& frame : frames)
    for (const SeenFrame::Gap& gap : frame.gaps) largest_n = std::max(largest_n, gap.force_n);
  for (SeenFrame& frame : frames)
    std::erase_if(frame.gaps,
                  [&](const SeenFrame::Gap& gap) { return !(gap.force_n > pressing_share * largest_n); });
}

double largest_cage_penetration_m(const fem::World& world) {
  const TetMesh& cage = world.bodies[std::size_t(world.robot)].cage;
  return largest_cage_penetration * bounding_box(cage.positions).size().maxCoeff();
}

std::vector<SeenFrame> measure_seen(const Surfaces& surfaces, const std::vector<State>& frames) {
  std::vector<SeenFrame> seen(frames.size());
  Progress progress("what is seen", std::ssize(frames));
  std::mutex mutex;
  std::int64_t done = 0;
  parallel_for(int(frames.size()), [&](int f) {
    if (nothing_to_keep()) throw_if_stopped();
    seen[std::size_t(f)] = surfaces.at(frames[std::size_t(f)]);
    const std::lock_guard lock(mutex);
    progress.update(++done, "frames");
  });
  keep_what_presses(seen);
  return seen;
}

}  // namespace limber::detail
