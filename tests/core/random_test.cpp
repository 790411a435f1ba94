#include "core/random.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <thread>

#include "core/error.h"
#include "core/hash.h"
#include "core/same_bits.h"
#include "core/threads.h"

namespace limber {
namespace {

// Known answers of Philox4x32-10, published with Random123 (kat_vectors).
TEST(Random, PhiloxGivesItsPublishedAnswers) {
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}),
            (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
            (std::array<std::uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (std::array<std::uint32_t, 4>{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, StreamsAreDifferentAndRepeatable) {
  std::set<std::uint32_t> first;
  for (std::uint64_t stream = 0; stream < 1000; ++stream) first.insert(Rng(7, stream).bits());
  EXPECT_EQ(first.size(), 1000u);
  Rng a(7, 3), b(7, 3);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.bits(), b.bits());
}

TEST(Random, MomentsOfUniformAndDirection) {
  Rng rng(1, 1);
  const int n = 100000;
  double sum = 0, square = 0;
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (int i = 0; i < n; ++i) {
    const double u = rng.uniform();
    ASSERT_TRUE(u >= 0 && u < 1) << u;
    sum += u, square += u * u;
    const Vec3 d = rng.direction();
    ASSERT_NEAR(d.norm(), 1, 1e-12);
    mean += d, second += d * d.transpose();
  }
  const double five_sigma = 5 / std::sqrt(12.0 * n);
  EXPECT_NEAR(sum / n, 0.5, five_sigma);
  EXPECT_NEAR(square / n, 1.0 / 3, five_sigma);
  EXPECT_LT((mean / n).norm(), 5 / std::sqrt(double(n)));
  EXPECT_LT((second / n - Eigen::Matrix3d::Identity() / 3).norm(), 0.01);
}

TEST(Random, BelowIsUniform) {
  Rng rng(2, 1);
  std::array<int, 6> count{};
  for (int i = 0; i < 60000; ++i) ++count[std::size_t(rng.below(6))];
  for (const int c : count) EXPECT_NEAR(c, 10000, 5 * std::sqrt(60000 * 5.0 / 36));
}

TEST(SameBits, MinusZeroIsNotZero) {
  const State state{3, {0, 2, 3}, {4, 5, 0}};
  EXPECT_TRUE(same_bits(state, State(state)));
  State other = state;
  other.positions[0] = -0.f;
  EXPECT_TRUE(other == state && !same_bits(other, state));
  other = state, other.velocities[2] = -0.f;
  EXPECT_TRUE(other == state && !same_bits(other, state));
  EXPECT_FALSE(same_bits(state, State{4, state.positions, state.velocities}));
  EXPECT_FALSE(same_bits(state, State{3, {0, 2}, {4, 5}}));
  for (const auto& change : std::vector<std::function<void(Control&)>>{
           [](Control& c) { c.force_n.y() = -0.f; }, [](Control& c) { c.target_m.z() = -0.f; },
           [](Control& c) { c.radius_m = -0.f; }, [](Control& c) { c.max_force_n = -0.f; }}) {
    Control control;
    EXPECT_TRUE(same_bits(control, Control{}));
    change(control);
    EXPECT_TRUE(control == Control{} && !same_bits(control, Control{}));
  }
  Control pushed;
  pushed.steps = 1;
  EXPECT_FALSE(same_bits(pushed, Control{}));
}

TEST(Hash, SeesEveryPartOfAState) {
  const State state{3, {1, 2, 3}, {4, 5, 6}};
  State other = state;
  EXPECT_EQ(hash_of(state), hash_of(other));
  other.step = 4;
  EXPECT_NE(hash_of(state), hash_of(other));
  other = state, other.positions[1] = std::nextafter(2.0f, 3.0f);
  EXPECT_NE(hash_of(state), hash_of(other));
  other = state, other.velocities[2] = -6;
  EXPECT_NE(hash_of(state), hash_of(other));
  // Moving a number from one array to its neighbour is seen, too.
  EXPECT_NE(hash_of(State{3, {1, 2, 3, 4}, {5, 6}}), hash_of(State{3, {1, 2, 3}, {4, 5, 6}}));
}

TEST(Hash, HexRoundTripAndRefusal) {
  for (const std::uint64_t v : {std::uint64_t(0), std::uint64_t(0x0123456789abcdef), ~std::uint64_t(0)})
    EXPECT_EQ(hash_from_hex(hex(v)), v);
  EXPECT_THROW(hash_from_hex("123"), InputError);
  EXPECT_THROW(hash_from_hex("0123456789abcdeg"), InputError);
}

TEST(Control, LargestForceIsWhatTheManipulationMayExert) {
  Control control;
  control.force_n = {3, 0, 4}, control.max_force_n = 9;
  EXPECT_EQ(largest_force(control), 0);
  control.manipulation = Manipulation::body;
  EXPECT_EQ(largest_force(control), 5);
  control.manipulation = Manipulation::control_point;
  EXPECT_EQ(largest_force(control), 5);
  control.second_node = 3, control.second_force_n = {0, 6, 0};
  EXPECT_EQ(largest_force(control), 6) << "of the stronger carrier";
  control.manipulation = Manipulation::interpolation;
  EXPECT_EQ(largest_force(control), 9);
}

TEST(Threads, EachIndexIsVisitedOnceAndExceptionsArrive) {
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    std::vector<int> visits(1000, 0);
    parallel_for(1000, [&](int i) { ++visits[std::size_t(i)]; });
    EXPECT_EQ(visits, std::vector<int>(1000, 1));
    EXPECT_THROW(parallel_for(10,
                              [](int i) {
                                if (i == 7) throw InputError("seven");
                              }),
                 InputError);
  }
  set_thread_count(0);
}

TEST(Threads, SideBySideEachIsCalledOnceAndMayLoopItself) {
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    std::vector<int> sums(7, 0);
    side_by_side(7, [&](int i) {
      std::vector<int> squares(100);
      parallel_for(100, [&](int k) { squares[std::size_t(k)] = k * k; });
      sums[std::size_t(i)] += std::accumulate(squares.begin(), squares.end(), i);
    });
    for (int i = 0; i < 7; ++i) EXPECT_EQ(sums[std::size_t(i)], 328350 + i);
  }
  set_thread_count(0);
}

TEST(Threads, SideBySideTheFirstExceptionIsPassedOnAndNoneBeginsBehindIt) {
  set_thread_count(2);
  std::atomic<bool> has_thrown{false};
  std::vector<int> begun(100, 0);
  try {
    side_by_side(100, [&](int i) {
      begun[std::size_t(i)] = 1;
      // Where there are two cores the other goes on to 3 meanwhile.
      for (int k = 0; i == 2 && k < 1000 && !has_thrown; ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (i < 2) return;
      has_thrown = true;
      throw InputError(std::to_string(i));
    });
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "2");
  }
  EXPECT_LE(std::accumulate(begun.begin(), begun.end(), 0), 4);
  set_thread_count(0);
}

TEST(Check, PrintsTheValues) {
  const int rows = 3, columns = 4;
  try {
    LIMBER_CHECK(rows == columns, rows, columns);
    FAIL();
  } catch (const InternalError& error) {
    EXPECT_NE(std::string(error.what()).find("rows == columns does not hold; (rows, columns) = (3, 4)"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace limber
