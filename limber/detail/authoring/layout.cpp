#include "limber/detail/authoring/layout.h"

#include <algorithm>

#include "core/mesh.h"
#include "core/progress.h"

namespace limber::detail {

namespace {

constexpr int max_rounds = 200;
// Parting goes by so much farther, of the size of all.
constexpr double slack = 1e-4;
// Of the cells of the coarser field: by so much two surfaces that touch nowhere may seem to be in one
// another, at their edges.
constexpr double field_error = 0.3;

Vec3 gradient(const DistanceField& field, const Vec3& p) {
  Vec3 rise;
  for (int c = 0; c < 3; ++c) {
    const Vec3 step = 0.5 * field.cell_m * Vec3::Unit(c);
    rise[c] = field.at(p + step) - field.at(p - step);
  }
  return rise.norm() > 0 ? Vec3(rise.normalized()) : Vec3::UnitZ();
}

Box box_of(const DistanceField& field) {
  const Vec3 cells(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  return {field.lower_m, field.lower_m + field.cell_m * cells};
}

// Of the samples of one in the field of the other, which is `shift` away from where it is looked up.
void look_up(const SurfaceSamples& samples, const DistanceField& field, const Vec3& shift, double room_m,
             double sign, Nearness& deepest) {
  const Box box = box_of(field);
  for (const Vec3 sample : samples.positions_m.rowwise()) {
    const Vec3 p = sample + shift;
    if ((p.array() < box.lower.array()).any() || (p.array() > box.upper.array()).any()) continue;
    const double depth = room_m - field.at(p);
    if (!(depth > deepest.depth_m)) continue;
    deepest.depth_m = depth, deepest.way_m = sign * depth * gradient(field, p);
  }
}

struct Layout {
  std::vector<LaidBody> bodies;
  std::vector<Vec3> way_m;
  std::vector<double> room_m;  // [pair]
  double slack_m;

  Layout(std::vector<LaidBody> laid, double room)
      : bodies(std::move(laid)),
        way_m(bodies.size(), Vec3::Zero()),
        room_m(bodies.size() * bodies.size(), room) {
    Box all;
    for (const LaidBody& body : bodies) all.include(box_of(body.shape->field));
    slack_m = slack * all.diagonal();
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (std::size_t j = i + 1; j < bodies.size(); ++j) {
        const double gap = room - overlap(i, j).depth_m,
                     cell = std::max(bodies[i].shape->field.cell_m, bodies[j].shape->field.cell_m);
        if (gap > -field_error * cell) room_m[i * bodies.size() + j] = gap - 0.01 * slack_m;
      }
  }
  void move(std::size_t i, const Vec3& by) { way_m[i] += by; }
  // Of two that may part.
  Nearness overlap(std::size_t i, std::size_t j) const {
    if (bodies[i].held && bodies[j].held) return {};
    const double room = room_m[std::min(i, j) * bodies.size() + std::max(i, j)];
    return nearness(*bodies[i].shape, way_m[i], *bodies[j].shape, way_m[j], room);
  }
  bool is_free(std::size_t i) const {
    for (std::size_t j = 0; j < bodies.size(); ++j)
      if (j != i && overlap(i, j).depth_m > 0) return false;
    return true;
  }
  double farthest() const {
    double way = 0;
    for (const Vec3& w : way_m) way = std::max(way, w.norm());
    return way;
  }

  // Whether there was nothing to part.
  bool part_all() {
    bool apart = true;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (std::size_t j = i + 1; j < bodies.size(); ++j) {
        const Nearness found = overlap(i, j);
        if (found.depth_m == 0) continue;
        apart = false;
        const Vec3 way = (1 + slack_m / found.depth_m) * found.way_m;
        const double share = bodies[i].held ? 0 : bodies[j].held ? 1 : 0.5;
        move(i, share * way), move(j, -(1 - share) * way);
      }
    return apart;
  }

  std::pair<std::size_t, std::size_t> deepest() const {
    std::pair<std::size_t, std::size_t> pair(0, 0);
    double depth_m = -1;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (std::size_t j = i + 1; j < bodies.size(); ++j)
        if (const double found_m = overlap(i, j).depth_m; found_m > depth_m) depth_m = found_m, pair = {i, j};
    return pair;
  }

  // Whether one went back by more than a little.
  bool go_back() {
    bool gone = false;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (double share = 1; way_m[i].norm() * share > 10 * slack_m; share /= 2) {
        const Vec3 back = -share * way_m[i];
        move(i, back);
        if (is_free(i)) {
          gone = true;
          break;
        }
        move(i, -back);
      }
    return gone;
  }
};

}  // namespace

Nearness nearness(const ContactShape& one, const Vec3& way_of_one_m, const ContactShape& other,
                  const Vec3& way_of_other_m, double room_m) {
  Nearness deepest;
  const Vec3 shift = way_of_one_m - way_of_other_m;
  look_up(one.samples, other.field, shift, room_m, 1, deepest);
  look_up(other.samples, one.field, -shift, room_m, -1, deepest);
  return deepest;
}

std::optional<std::vector<Vec3>> ways_apart(std::vector<LaidBody> bodies, double room_m, double reach_m,
                                            std::pair<std::size_t, std::size_t>* stuck) {
  Layout layout(std::move(bodies), room_m);
  const auto give_up = [&] {
    if (stuck) *stuck = layout.deepest();
    return std::nullopt;
  };
  int round = 0;
  for (; !layout.part_all(); ++round) {
    throw_if_stopped();
    if (round == max_rounds || layout.farthest() > 2 * reach_m) return give_up();
  }
  while (round > 0 && layout.go_back()) throw_if_stopped();
  if (layout.farthest() > reach_m) return give_up();
  return layout.way_m;
}

}  // namespace limber::detail
