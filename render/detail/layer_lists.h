// Of each pixel, or of each sample, a list of what is drawn there half transparent, with its depth and the
// samples of the pixel that it covers: an A-buffer (Carpenter 1984) as linked lists (Yang et al., Real-time
// concurrent linked list construction on the GPU, 2010). What shaders put and read with is in shaders.cpp.
// Many layers in a large picture do not fit at once, and are then drawn band by band.
#pragma once

#include <cstddef>

#include "render/detail/program.h"

namespace limber::render::detail {

class LayerLists {
 public:
  LayerLists(int columns, int rows);

  // Empty lists for so many rows; 1 … max_rows().
  void clear(int first_row, int rows);
  int max_rows() const;
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  void set_uniforms(const Program&) const;  // of a program that puts or reads, in use

  // How many were put since they were cleared; those beyond the room are not in any list.
  std::size_t wanted() const;
  std::size_t room() const { return room_; }
  // Makes room for so many, with a reserve; what the lists hold is lost. False, and nothing is done: OpenGL
  // allows no buffer as large.
  bool make_room(std::size_t fragments);

 private:
  int columns_, rows_, first_row_ = 0, rows_with_heads_ = 0;
  std::size_t largest_buffer_, room_ = 0;
  unsigned heads_ = 0, fragments_ = 0;
};

}  // namespace limber::render::detail
