#include "limber/detail/report/report_motion.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "fem/observe.h"
#include "limber/detail/world/surface_at.h"
#include "render/image.h"

namespace limber::detail {

namespace {

Json coordinates(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

class Packer {
 public:
  template <class T>
  Json add(const std::vector<T>& values) {
    bytes.resize((bytes.size() + 3) / 4 * 4);  // where JavaScript lets an array begin
    const Json place{bytes.size(), values.size()};
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return place;
  }
  // Rows within the box, in 16 bits a number.
  static void quantise(const Points& rows, const Box& box, std::vector<std::uint16_t>& to) {
    const Vec3 step = step_of(box);
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
      for (int k = 0; k < 3; ++k) {
        const double level = step[k] > 0 ? (rows(i, k) - box.lower[k]) / step[k] : 0;
        to.push_back(std::uint16_t(std::lround(std::clamp(level, 0.0, 65535.0))));
      }
  }
  static Vec3 step_of(const Box& box) { return box.size() / 65535; }

  std::string bytes;
};

std::vector<std::uint32_t> ends_of_edges(const Triangles& triangles) {
  std::set<std::pair<int, int>> edges;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax({triangles(t, k), triangles(t, (k + 1) % 3)}));
  std::vector<std::uint32_t> ends;
  for (const auto& [a, b] : edges) ends.push_back(std::uint32_t(a)), ends.push_back(std::uint32_t(b));
  return ends;
}

}  // namespace

PackedMotion pack_motion(const fem::World& world, const std::vector<PreparedBody>& bodies,
                         const std::vector<Vec3>& colors_srgb, const std::vector<State>& frames) {
  Packer packer;
  PackedMotion packed;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const PreparedBody& prepared = bodies[b];
    const fem::Body& body = world.bodies[b];
    const Points rest = surface_at_rest(body, prepared);
    const Box box = bounding_box(rest);
    std::vector<std::uint16_t> positions;
    Packer::quantise(rest, box, positions);
    const bool wide = rest.rows() > 65536;
    const Triangles& triangles = prepared.surface.triangles;
    const auto as = [](const auto& matrix, auto zero) {
      return std::vector<decltype(zero)>(matrix.data(), matrix.data() + matrix.size());
    };
    Json entry{{"name", body.name},
               {"color", coordinates(render::linear_from_srgb(colors_srgb[b]))},
               {"low", coordinates(box.lower)},
               {"step", coordinates(Packer::step_of(box))},
               {"positions", packer.add(positions)},
               {"wide", wide},
               {"triangles", wide ? packer.add(as(triangles, std::uint32_t()))
                                  : packer.add(as(triangles, std::uint16_t()))}};
    if (body.moving) {
      std::vector<Points> places;
      Box reach;
      for (const State& state : frames) {
        places.push_back(fem::body_positions(world, state, int(b)));
        reach.include(bounding_box(places.back()));
      }
      std::vector<std::uint16_t> levels;
      for (const Points& place : places) Packer::quantise(place, reach, levels);
      entry["cage"] = packer.add(as(prepared.cage.positions, float()));
      entry["tets"] = packer.add(as(prepared.cage.tets, std::uint32_t()));
      entry["edges"] = packer.add(ends_of_edges(body.surface));
      entry["tet_from_vertex"] = packer.add(as(prepared.binding.tet_from_vertex, std::uint32_t()));
      entry["phong"] = prepared.deformation == scenes::Deformation::phong;
      entry["frames"] = packer.add(levels);
      entry["frames_low"] = coordinates(reach.lower);
      entry["frames_step"] = coordinates(Packer::step_of(reach));
    }
    packed.bodies.push_back(std::move(entry));
  }
  packed.bytes = std::move(packer.bytes);
  return packed;
}

}  // namespace limber::detail
