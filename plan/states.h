// The states of a tree. What a node shares with its parent is kept once: bodies that sleep cost a few bytes.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "core/state.h"

namespace limber::plan {

// All of one length. Only grows.
class States {
 public:
  int size() const { return int(steps_.size()); }
  State operator[](std::size_t i) const;                // put together: a copy
  void push_back(const State& state, int parent = -1);  // parent < size(), or −1
  std::size_t numbers() const { return numbers_; }      // positions of a state, and as many velocities
  std::size_t bytes() const;                            // that are held
  std::size_t bytes_unshared() const;                   // that would be held if nothing were shared

 private:
  // Pieces of 32 nodes' positions or velocities, the last filled up with zeros.
  using Piece = std::array<float, 96>;
  std::size_t pieces_a_half() const { return (numbers_ + Piece{}.size() - 1) / Piece{}.size(); }

  std::size_t numbers_ = 0;
  std::vector<std::int64_t> steps_;
  std::vector<std::uint32_t> piece_of_;  // [state][positions, velocities][piece] in pieces_
  std::deque<Piece> pieces_;
};

}  // namespace limber::plan
