#include "plan/states.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/error.h"

namespace limber::plan {

State States::operator[](std::size_t i) const {
  LIMBER_CHECK(i < steps_.size(), i, steps_.size());
  State state{steps_[i], std::vector<float>(numbers_), std::vector<float>(numbers_)};
  const std::int32_t* piece = &piece_of_[2 * i * pieces_a_half()];
  for (auto* half : {&state.positions, &state.velocities})
    for (std::size_t first = 0; first < numbers_; first += Piece{}.size(), ++piece)
      std::copy_n(pieces_[std::size_t(*piece)].begin(), std::min(Piece{}.size(), numbers_ - first),
                  half->begin() + std::ptrdiff_t(first));
  return state;
}

void States::push_back(const State& state, int parent) {
  if (steps_.empty()) numbers_ = state.positions.size();
  LIMBER_CHECK(state.positions.size() == numbers_ && state.velocities.size() == numbers_,
               state.positions.size(), state.velocities.size(), numbers_);
  LIMBER_CHECK(parent >= -1 && parent < size(), parent, size());
  LIMBER_CHECK(pieces_.size() + 2 * pieces_a_half() < std::size_t(std::numeric_limits<std::int32_t>::max()),
               pieces_.size());
  std::size_t of_parent = 2 * std::size_t(std::max(parent, 0)) * pieces_a_half();
  for (const auto* half : {&state.positions, &state.velocities})
    for (std::size_t first = 0; first < numbers_; first += Piece{}.size(), ++of_parent) {
      Piece piece{};
      std::copy_n(half->begin() + std::ptrdiff_t(first), std::min(piece.size(), numbers_ - first),
                  piece.begin());
      // The very bits: 0 and −0 differ.
      const bool same =
          parent >= 0 && std::memcmp(&pieces_[std::size_t(piece_of_[of_parent])], &piece, sizeof piece) == 0;
      if (!same) pieces_.push_back(piece);
      piece_of_.push_back(same ? piece_of_[of_parent] : std::int32_t(pieces_.size() - 1));
    }
  steps_.push_back(state.step);
}

std::size_t States::bytes() const {
  return pieces_.size() * sizeof(Piece) + piece_of_.size() * sizeof(std::int32_t) +
         steps_.size() * sizeof(std::int64_t);
}
std::size_t States::bytes_unshared() const {
  return steps_.size() * (2 * numbers_ * sizeof(float) + sizeof(std::int64_t));
}

std::vector<float> States::pieces() const {
  std::vector<float> all;
  all.reserve(pieces_.size() * piece_length);
  for (const Piece& piece : pieces_) all.insert(all.end(), piece.begin(), piece.end());
  return all;
}

States States::of_pieces(std::size_t numbers, std::span<const std::int64_t> steps,
                         std::span<const std::int32_t> piece_of, std::span<const float> pieces) {
  States states;
  states.numbers_ = numbers;
  const std::size_t count = pieces.size() / piece_length;
  LIMBER_CHECK(
      pieces.size() == count * piece_length && piece_of.size() == 2 * steps.size() * states.pieces_a_half(),
      numbers, steps.size(), piece_of.size(), pieces.size());
  for (const std::int32_t i : piece_of) LIMBER_CHECK(i >= 0 && std::size_t(i) < count, i, count);
  states.steps_.assign(steps.begin(), steps.end());
  states.piece_of_.assign(piece_of.begin(), piece_of.end());
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(pieces.begin() + std::ptrdiff_t(i * piece_length), piece_length,
                states.pieces_.emplace_back().begin());
  return states;
}

}  // namespace limber::plan
