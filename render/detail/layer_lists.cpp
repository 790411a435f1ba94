#include "render/detail/layer_lists.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>

namespace limber::render::detail {

namespace {

constexpr std::size_t fragment_bytes = 16, word_bytes = 4;

}  // namespace

LayerLists::LayerLists(int columns, int rows) : columns_(columns), rows_(rows) {
  GLint64 largest = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
  largest_buffer_ = std::min(std::size_t(largest), std::size_t(1) << 30);
}

int LayerLists::max_rows() const {
  return int(std::min(std::size_t(rows_), largest_buffer_ / word_bytes / std::size_t(columns_) - 1));
}

void LayerLists::clear(int first_row, int rows) {
  first_row_ = first_row;
  if (heads_ == 0) glGenBuffers(1, &heads_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, heads_);
  if (rows > rows_with_heads_) {
    const std::size_t words = 1 + std::size_t(columns_) * std::size_t(rows);
    glBufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(word_bytes * words), nullptr, GL_DYNAMIC_DRAW);
    rows_with_heads_ = rows;
  }
  const GLuint none = 0;
  glClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &none);
  if (room_ == 0) make_room(std::size_t(columns_));
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, fragments_);
}

void LayerLists::set_uniforms(const Program& p) const {
  p.set("columns", columns_);
  p.set("first_row", first_row_);
}

std::size_t LayerLists::wanted() const {
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  GLuint count = 0;
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, heads_);
  glGetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof count, &count);
  return count;
}

bool LayerLists::make_room(std::size_t fragments) {
  const std::size_t most = largest_buffer_ / fragment_bytes;
  if (fragments > most) return false;
  room_ = std::min(fragments + fragments / 4, most);
  if (fragments_ == 0) glGenBuffers(1, &fragments_);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, fragments_);
  glBufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(room_ * fragment_bytes), nullptr, GL_DYNAMIC_DRAW);
  return true;
}

}  // namespace limber::render::detail
