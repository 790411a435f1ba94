#include "render/detail/gpu_mesh.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>

namespace limber::render::detail {

namespace {

enum Attribute : GLuint { at_position, at_normal, at_tint, at_scalar, at_rest, at_uv, at_color };

GLuint new_attribute(GLuint array, Attribute attribute, GLint components, GLenum type) {
  GLuint buffer = 0;
  glBindVertexArray(array);
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glVertexAttribPointer(attribute, components, type, GL_TRUE, 0, nullptr);
  glEnableVertexAttribArray(attribute);
  return buffer;
}

template <class Values>
void upload(GLuint buffer, const Values& values) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(values.size() * sizeof values[0]), values.data(), GL_STREAM_DRAW);
}

}  // namespace

GpuMesh::GpuMesh(const Triangles& triangles, const Points& rest_positions, double crease_angle_deg,
                 const Appearance& appearance)
    : drawn_(order_for_drawing(triangles, rest_positions, crease_angle_deg, appearance)),
      vertices_(rest_positions.rows()) {
  glGenVertexArrays(1, &array_);
  position_buffer_ = new_attribute(array_, at_position, 3, GL_FLOAT);
  normal_buffer_ = new_attribute(array_, at_normal, 3, GL_FLOAT);
  glGenBuffers(1, &corner_buffer_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, corner_buffer_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(drawn_.corners.size() * sizeof drawn_.corners[0]),
               drawn_.corners.data(), GL_STATIC_DRAW);
  if (!drawn_.uv.empty()) upload(new_attribute(array_, at_uv, 2, GL_FLOAT), drawn_.uv);
  if (!drawn_.colors.empty()) upload(new_attribute(array_, at_color, 4, GL_UNSIGNED_SHORT), drawn_.colors);
  set_positions(rest_positions, {});
}

void GpuMesh::set_positions(const Points& positions, const Points& normals) {
  deform(drawn_, positions, normals);
  box_ = bounding_box(positions);
  upload(position_buffer_, drawn_.positions);
  upload(normal_buffer_, drawn_.normals);
}

void GpuMesh::set_tints(const Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>& tints) {
  tints_.clear();
  tints_.reserve(4 * drawn_.vertex_from_drawn.size());
  for (const int vertex : drawn_.vertex_from_drawn)
    for (int c = 0; c < 4; ++c)
      tints_.push_back(std::uint16_t(65535 * std::clamp(tints(vertex, c), 0.0f, 1.0f) + 0.5f));
  if (tint_buffer_ == 0) tint_buffer_ = new_attribute(array_, at_tint, 4, GL_UNSIGNED_SHORT);
  upload(tint_buffer_, tints_);
}

void GpuMesh::set_scalars(const Eigen::VectorXd& values) {
  std::vector<float> drawn;
  drawn.reserve(drawn_.vertex_from_drawn.size());
  for (const int vertex : drawn_.vertex_from_drawn) drawn.push_back(float(values[vertex]));
  if (scalar_buffer_ == 0) scalar_buffer_ = new_attribute(array_, at_scalar, 1, GL_FLOAT);
  upload(scalar_buffer_, drawn);
}

void GpuMesh::set_rest(const Points& rest_positions) {
  rest_.clear();
  rest_.reserve(3 * drawn_.vertex_from_drawn.size());
  for (const int vertex : drawn_.vertex_from_drawn)
    for (int i = 0; i < 3; ++i) rest_.push_back(float(rest_positions(vertex, i)));
  if (rest_buffer_ == 0) rest_buffer_ = new_attribute(array_, at_rest, 3, GL_FLOAT);
  upload(rest_buffer_, rest_);
}

void GpuMesh::draw(std::size_t first_corner, std::size_t corners) const {
  glBindVertexArray(array_);
  if (scalar_buffer_ == 0) glVertexAttrib1f(at_scalar, 0);
  glDrawElements(GL_TRIANGLES, GLsizei(corners), GL_UNSIGNED_INT,
                 reinterpret_cast<void*>(first_corner * sizeof(std::uint32_t)));
}

Points GpuMesh::positions() const {
  Points rows = Points::Zero(vertices_, 3);
  for (std::size_t d = 0; d < drawn_.vertex_from_drawn.size(); ++d)
    for (int i = 0; i < 3; ++i)
      rows(drawn_.vertex_from_drawn[d], i) = drawn_.positions[3 * d + std::size_t(i)];
  return rows;
}

Triangles GpuMesh::triangles() const {
  Triangles rows(Eigen::Index(drawn_.corners.size() / 3), 3);
  for (std::size_t c = 0; c < drawn_.corners.size(); ++c)
    rows(Eigen::Index(c / 3), int(c % 3)) = drawn_.vertex_from_drawn[drawn_.corners[c]];
  return rows;
}

void GpuMesh::release() {
  glDeleteVertexArrays(1, &array_);
  for (const GLuint buffer :
       {position_buffer_, normal_buffer_, tint_buffer_, scalar_buffer_, rest_buffer_, corner_buffer_})
    glDeleteBuffers(1, &buffer);
}

Points GpuMesh::edge_ends() {
  if (edges_.empty()) {
    // Vertices that a crease parts are one to an edge: the first of them stands for all.
    std::vector<int> first(std::size_t(vertices_), -1);
    for (int d = int(drawn_.vertex_from_drawn.size()) - 1; d >= 0; --d)
      first[std::size_t(drawn_.vertex_from_drawn[std::size_t(d)])] = d;
    const auto merged = [&](std::uint32_t d) { return first[std::size_t(drawn_.vertex_from_drawn[d])]; };
    for (std::size_t c = 0; c < drawn_.corners.size(); ++c) {
      const std::size_t next = c % 3 == 2 ? c - 2 : c + 1;
      edges_.push_back(std::minmax({merged(drawn_.corners[c]), merged(drawn_.corners[next])}));
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }
  Points ends(2 * Eigen::Index(edges_.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [a, b] : edges_)
    for (const int d : {a, b}) {
      const float* p = &drawn_.positions[3 * std::size_t(d)];
      ends.row(row++) << p[0], p[1], p[2];
    }
  return ends;
}

}  // namespace limber::render::detail
