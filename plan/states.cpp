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

States States::of_pieces(std::size_t numbers, std::span<const std::int64_t> steps,
                         std::vector<std::int32_t> piece_of, std::deque<Piece> pieces) {
  States states;
  states.numbers_ = numbers;
  LIMBER_CHECK(piece_of.size() == 2 * steps.size() * states.pieces_a_half(), numbers, steps.size(),
               piece_of.size());
  for (const std::int32_t i : piece_of)
    LIMBER_CHECK(i >= 0 && std::size_t(i) < pieces.size(), i, pieces.size());
  states.steps_.assign(steps.begin(), steps.end());
  states.piece_of_ = std::move(piece_of), states.pieces_ = std::move(pieces);
  return states;
}

}  // namespace limber::plan
