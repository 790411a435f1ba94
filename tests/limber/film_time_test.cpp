// Which moment of the motion a frame shows.
#include "limber/detail/film/film_time.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace limber::detail {
namespace {

constexpr PaceRange range{0.2, 2};

// Twenty frames of contact in the middle of a hundred and one.
std::vector<double> touched() {
  std::vector<double> shares(101, 0);
  std::fill(shares.begin() + 40, shares.begin() + 60, 1);
  return shares;
}

// The slowness, linear between frames of the motion.
double slowness_at(const std::vector<double>& contact, double at) {
  const std::size_t i = std::min(std::size_t(at), contact.size() - 2);
  const double share = contact[i] + (contact[i + 1] - contact[i]) * (at - double(i));
  return (1 - share) / range.quickest + share / range.slowest;
}

TEST(Eased, ReachesWhatItIsMadeFromAndHasNoJump) {
  for (const int reach : {2, 5, 9}) {
    const std::vector<double> shares = touched(), smooth = eased(shares, 2 * reach);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      EXPECT_GE(smooth[i], shares[i] - 1e-12) << i;
      EXPECT_LE(smooth[i], 1 + 1e-12);
      if (i > 0) {
        EXPECT_LE(std::abs(smooth[i] - smooth[i - 1]), 1.0 / (2 * reach + 1) + 1e-12) << i;
      }
    }
    EXPECT_EQ(smooth.front(), 0);
    EXPECT_NEAR(std::accumulate(smooth.begin(), smooth.end(), 0.0), 20 + 4 * reach, 1e-9);
  }
}

// The integral of the slowness: half a frame each, and 4.5 more where the eased contact, 40 frames, is.
TEST(Paced, GoesOnSmoothlyWithinItsRangeAndTakesTheIntegralOfItsSlowness) {
  const std::vector<double> contact = eased(touched(), 10);
  const std::vector<Moment> film = paced(contact, range);
  ASSERT_EQ(film.size(), 1 + std::size_t(100 * 0.5 + 40 * 4.5));
  EXPECT_EQ(film.front().at, 0);
  EXPECT_EQ(film.back().at, 100);
  double slowest = 100, quickest = 0;
  for (std::size_t k = 0; k + 1 < film.size(); ++k) {
    const double step = film[k + 1].at - film[k].at;
    EXPECT_GE(step, range.slowest - 1e-9) << k;
    EXPECT_LE(step, range.quickest + 1e-9) << k;
    slowest = std::min(slowest, step), quickest = std::max(quickest, step);
    EXPECT_NEAR(film[k].pace, 1 / slowness_at(contact, film[k].at), 1e-9) << k;
    // Of a smooth map the step is the mean of the paces at its ends, but for the third order.
    EXPECT_NEAR(step, 0.5 * (film[k].pace + film[k + 1].pace), 0.05 * step) << k;
  }
  EXPECT_NEAR(slowest, range.slowest, 1e-9);
  EXPECT_NEAR(quickest, range.quickest, 1e-9);
}

TEST(Paced, TakesTheLengthAskedForWithinItsRange) {
  const std::vector<double> contact = eased(touched(), 10);
  for (const double length : {50.0, 51.0, 120.0, 230.0, 300.0, 499.0, 500.0}) {
    const std::vector<Moment> film = paced(contact, range, length);
    ASSERT_EQ(film.size(), std::size_t(length) + 1);
    for (std::size_t k = 0; k + 1 < film.size(); ++k) {
      EXPECT_GE(film[k + 1].at - film[k].at, range.slowest - 1e-6) << length;
      EXPECT_LE(film[k + 1].at - film[k].at, range.quickest + 1e-6) << length;
    }
  }
}

TEST(Paced, WithoutContactALengthIsOnePace) {
  for (const double length : {50.0, 160.0, 500.0}) {
    const std::vector<Moment> film = paced(std::vector<double>(101, 0), range, length);
    ASSERT_EQ(film.size(), std::size_t(length) + 1);
    for (std::size_t k = 0; k < film.size(); ++k) {
      EXPECT_NEAR(film[k].at, 100 * double(k) / length, 1e-9);
      EXPECT_NEAR(film[k].pace, 100 / length, 1e-9);
    }
  }
}

TEST(Paced, EvenlyItIsFrameByFrame) {
  const std::vector<Moment> film = paced(touched(), {1, 1});
  ASSERT_EQ(film.size(), 101u);
  for (std::size_t k = 0; k < film.size(); ++k) {
    EXPECT_EQ(film[k].at, double(k));
    EXPECT_EQ(film[k].pace, 1);
  }
  EXPECT_EQ(paced({1}, range).size(), 1u);
}

TEST(StateAt, IsExactOfCubicMotion) {
  constexpr double dt = 0.01;
  const auto place = [](double t) { return 1 - 2 * t + 3 * t * t - 0.7 * t * t * t; };
  const auto velocity = [](double t) { return -2 + 6 * t - 2.1 * t * t; };
  std::vector<State> frames;
  for (const std::int64_t step : {0, 50, 110, 160}) {  // not evenly
    const double t = double(step) * dt;
    frames.push_back(
        {step, {float(place(t)), 0, float(-place(t))}, {float(velocity(t)), 0, float(-velocity(t))}});
  }
  for (const double at : {0.1, 0.5, 1.25, 2.9}) {
    const State state = state_at(frames, dt, at);
    const std::size_t f = std::size_t(at);
    const double t =
        dt * (double(frames[f].step) + (at - double(f)) * double(frames[f + 1].step - frames[f].step));
    EXPECT_NEAR(state.positions[0], place(t), 1e-6);
    EXPECT_NEAR(state.positions[2], -place(t), 1e-6);
    EXPECT_NEAR(state.velocities[0], velocity(t), 1e-5);
    EXPECT_EQ(state.step, std::llround(t / dt));
  }
  for (std::size_t f = 0; f < frames.size(); ++f) EXPECT_EQ(state_at(frames, dt, double(f)), frames[f]);
}

TEST(FirstAtRest, IsWhereTheLastMotionEnds) {
  std::vector<State> frames;
  for (int f = 0; f < 30; ++f)
    frames.push_back({f, {0, 0, 0, float(std::min(f, 20)), 1, 0}, std::vector<float>(6, 0)});
  EXPECT_EQ(first_at_rest(frames, 0.5), 20);
  EXPECT_EQ(first_at_rest(frames, 1.5), 19);
  EXPECT_EQ(first_at_rest(frames, 100), 0);
  frames.back().positions[0] = 1;  // one that moves at the very end
  EXPECT_EQ(first_at_rest(frames, 0.5), 29);
}

}  // namespace
}  // namespace limber::detail
