#pragma once

#include <functional>
#include <optional>

#include "fem/detail/lane_view.h"
#include "fem/world.h"

namespace limber::fem::testing {

// One lane of a world, with the boxes and travel that a stepper would keep.
struct Lane {
  const World& world;
  std::vector<float> x, v, f, lower, upper, travel, inner_travel;

  explicit Lane(const World& w)
      : world(w),
        x(w.tables.rest_positions),
        v(x.size()),
        f(x.size()),
        lower(3 * w.bodies.size()),
        upper(lower),
        travel(w.bodies.size()),
        inner_travel(travel) {
    update_boxes();
  }
  void update_boxes() {
    for (std::size_t b = 0; b < world.bodies.size(); ++b)
      for (int c = 0; c < 3; ++c) {
        lower[3 * b + c] = 1e30f, upper[3 * b + c] = -1e30f;
        for (int n = world.topology.bodies[b].first_node; n < world.topology.bodies[b].last_node; ++n) {
          lower[3 * b + c] = std::min(lower[3 * b + c], x[3 * n + c]);
          upper[3 * b + c] = std::max(upper[3 * b + c], x[3 * n + c]);
        }
      }
  }
  // Moves the nodes of a body and counts the way of the fastest.
  void move(int body, const std::function<Vec3f(const Vec3f&)>& place) {
    float farthest = 0;
    for (int n = world.topology.bodies[body].first_node; n < world.topology.bodies[body].last_node; ++n) {
      Eigen::Map<Vec3f> p(&x[3 * n]);
      const Vec3f q = place(p);
      farthest = std::max(farthest, (q - p).norm());
      p = q;
    }
    travel[body] += farthest, inner_travel[body] += 2 * farthest;
    update_boxes();
  }
  State state() const {
    State state;
    state.positions.assign(x.begin(), x.begin() + 3 * world.moving_nodes);
    state.velocities.assign(state.positions.size(), 0.f);
    return state;
  }
  detail::LaneView<float> view() {
    return {x.data(), v.data(),     f.data(),     {3, 1},        {3, 1},
            1,        lower.data(), upper.data(), travel.data(), inner_travel.data()};
  }
  Vec3 place(int point) const {
    const auto& p = world.topology.points[point];
    return p.share[0] * node(p.node[0]) + p.share[1] * node(p.node[1]);
  }
  Vec3 node(int n) const { return Eigen::Map<const Vec3f>(&x[3 * n]).cast<double>(); }

  // Barycentric coordinates in double; empty when outside.
  std::optional<Eigen::Vector4d> weights(const Vec3& p, int tet) const {
    const int* n = world.topology.tets[tet].node;
    const Vec3 a = node(n[0]), b = node(n[1]), c = node(n[2]), d = node(n[3]);
    const double all = signed_volume(a, b, c, d);
    const Eigen::Vector4d w(signed_volume(p, b, c, d), signed_volume(a, p, c, d), signed_volume(a, b, p, d),
                            signed_volume(a, b, c, p));
    if (!(all > 0) || w.minCoeff() < 0) return {};
    return w / all;
  }
};

}  // namespace limber::fem::testing
