// A mesh's buffers: what moves (positions, normals) is streamed each frame, what seldom changes (triangles,
// tint, scalars) has buffers of its own.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh.h"
#include "render/detail/drawn_mesh.h"

namespace limber::render::detail {

class GpuMesh {
 public:
  GpuMesh(const Triangles&, const Points& rest_positions, double crease_angle_deg, const Appearance& = {});

  void set_positions(const Points& positions, const Points& normals);
  // Linear colour and the share of the sky that is open, per row of the positions, (V × 4).
  void set_tints(const Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>&);
  void set_scalars(const Eigen::VectorXd&);
  void set_rest(const Points& rest_positions);  // for the grain
  void draw() const { draw(0, drawn_.corners.size()); }
  void draw(std::size_t first_corner, std::size_t corners) const;
  Points edge_ends();  // each edge once, row 2i to row 2i + 1

  // As the caller has them.
  Points positions() const;
  Triangles triangles() const;
  void release();  // the buffers; the card's memory goes with the context else

  const DrawnMesh& drawn() const { return drawn_; }
  Eigen::Index vertices() const { return vertices_; }
  const Box& box() const { return box_; }
  bool tinted() const { return tint_buffer_ != 0; }
  // (drawn × 4) 65535 is 1, and (drawn × 3); empty where none were set.
  const std::vector<std::uint16_t>& tints() const { return tints_; }
  const std::vector<float>& rest() const { return rest_; }

 private:
  DrawnMesh drawn_;
  Eigen::Index vertices_;  // rows the caller hands over
  Box box_;
  std::vector<std::uint16_t> tints_;
  std::vector<float> rest_;
  unsigned array_ = 0, position_buffer_ = 0, normal_buffer_ = 0, tint_buffer_ = 0, scalar_buffer_ = 0,
           rest_buffer_ = 0, corner_buffer_ = 0;
  std::vector<std::pair<int, int>> edges_;  // drawn vertices; found when first asked for
};

}  // namespace limber::render::detail
