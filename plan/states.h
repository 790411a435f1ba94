// The states of a tree. What a node shares with its parent is kept once: bodies that sleep cost a few bytes.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
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

  // As they are held, for a file: pieces of 32 nodes' positions or velocities, the last of a state's filled
  // up with zeros.
  static constexpr std::size_t piece_length = 96;
  using Piece = std::array<float, piece_length>;
  std::size_t pieces_a_half() const { return (numbers_ + piece_length - 1) / piece_length; }
  std::span<const std::int64_t> steps() const { return steps_; }
  // [state][positions, velocities][piece]
  std::span<const std::int32_t> piece_of() const { return piece_of_; }
  const std::deque<Piece>& pieces() const { return pieces_; }
  // From these again; every index is that of a piece.
  static States of_pieces(std::size_t numbers, std::span<const std::int64_t> steps,
                          std::vector<std::int32_t> piece_of, std::deque<Piece> pieces);

 private:
  std::size_t numbers_ = 0;
  std::vector<std::int64_t> steps_;
  std::vector<std::int32_t> piece_of_;  // index in pieces_
  std::deque<Piece> pieces_;
};

}  // namespace limber::plan
