#include "plan/expansion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/plan/toy.h"

namespace limber::plan {
namespace {

using testing::Toy;
using testing::toy_settings;

constexpr int draws = 20000;

// Six standard deviations: with the written seed this is one fixed number, not a matter of luck.
void expect_share(std::int64_t count, std::int64_t of, double p, const char* what) {
  EXPECT_NEAR(double(count), double(of) * p, 6 * std::sqrt(double(of) * p * (1 - p))) << what;
}

TEST(Sample, ManipulationsFollowTheirWeights) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  s.goal_bias = 0.3;
  s.weights = {3, 1, 2};
  std::int64_t goal = 0, at_goal[4] = {}, elsewhere[4] = {};
  for (int i = 0; i < draws; ++i) {
    const Sample d = draw_sample(s, toy, i);
    goal += d.towards_goal;
    ++(d.towards_goal ? at_goal : elsewhere)[int(d.manipulation)];
  }
  expect_share(goal, draws, 0.3, "towards the goal");
  expect_share(at_goal[1], goal, 3.0 / 6, "body at the goal");
  expect_share(at_goal[2], goal, 1.0 / 6, "control point at the goal");
  expect_share(at_goal[3], goal, 2.0 / 6, "interpolation at the goal");
  expect_share(elsewhere[1], draws - goal, 3.0 / 4, "body elsewhere");
  expect_share(elsewhere[2], draws - goal, 1.0 / 4, "control point elsewhere");
  EXPECT_EQ(elsewhere[3], 0);
  EXPECT_EQ(at_goal[0] + elsewhere[0], 0);
}

TEST(Sample, AWeightOfZeroIsNever) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  s.goal_bias = 0.5;
  for (const ManipulationWeights w : {ManipulationWeights{1, 0, 0}, ManipulationWeights{0, 1, 0}}) {
    s.weights = w;
    const Manipulation only = w.body > 0 ? Manipulation::body : Manipulation::control_point;
    for (int i = 0; i < draws; ++i) ASSERT_EQ(draw_sample(s, toy, i).manipulation, only);
  }
  s.weights = {0, 0, 1};
  s.goal_bias = 1;
  for (int i = 0; i < draws; ++i) ASSERT_EQ(draw_sample(s, toy, i).manipulation, Manipulation::interpolation);
}

TEST(Sample, PointsDurationsForcesAndNodesFillTheirRanges) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  s.min_force_share = 0.25;
  s.max_force_share = 0.75;
  const Box bounds = toy.sample_bounds();
  Box points;
  int nodes[5] = {};
  double min_force = 1e9, max_force = 0;
  int min_steps = 1 << 30, max_steps = 0;
  for (int i = 0; i < draws; ++i) {
    const Sample d = draw_sample(s, toy, i);
    if (d.towards_goal) {
      ASSERT_EQ(d.point, s.goal.center_of_mass_m);
    } else {
      points.include(d.point);
    }
    ++nodes[d.robot_node];
    min_force = std::min(min_force, d.force_n), max_force = std::max(max_force, d.force_n);
    min_steps = std::min(min_steps, d.steps), max_steps = std::max(max_steps, d.steps);
  }
  EXPECT_TRUE((points.lower.array() >= bounds.lower.array()).all() &&
              (points.upper.array() <= bounds.upper.array()).all());
  EXPECT_GT((points.size().array() / bounds.size().array()).minCoeff(), 0.999);
  for (const int count : nodes) expect_share(count, draws, 0.2, "robot node");
  EXPECT_GE(min_force, 2);
  EXPECT_LE(max_force, 6);
  EXPECT_GT(max_force - min_force, 3.99);
  EXPECT_EQ(min_steps, 20);
  EXPECT_EQ(max_steps, 100);
}

TEST(Sample, DependsOnSeedAndIterationAlone) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  const Sample a = draw_sample(s, toy, 12);
  draw_sample(s, toy, 13);
  const Sample again = draw_sample(s, toy, 12);
  EXPECT_TRUE(a.point == again.point && a.force_n == again.force_n && a.steps == again.steps);
  EXPECT_NE(draw_sample(s, toy, 13).force_n, a.force_n);
  ++s.seed;
  EXPECT_NE(draw_sample(s, toy, 12).force_n, a.force_n);
}

TEST(Control, PushesAlongTheWayAndNeverAboveTheMaximum) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  s.goal_bias = 0.5;
  s.min_force_share = 1;  // the worst case for rounding
  s.max_force_n = 7.3;
  const Vec3 center(3, 2, 1);
  for (int i = 0; i < draws; ++i) {
    const Sample d = draw_sample(s, toy, i);
    const Control c = control_of(d, s, center);
    ASSERT_LE(largest_force(c), s.max_force_n);
    ASSERT_NEAR(largest_force(c), s.max_force_n, 1e-5 * s.max_force_n);
    ASSERT_EQ(c.steps, d.steps);
    if (c.manipulation == Manipulation::interpolation) {
      ASSERT_EQ(c.target_m, s.goal.center_of_mass_m.cast<float>());
    } else {
      const Vec3 way = (d.point - center).normalized();
      ASSERT_NEAR(way.dot(c.force_n.cast<double>().normalized()), 1, 1e-9);
      ASSERT_EQ(c.node >= 0, c.manipulation == Manipulation::control_point);
    }
  }
}

// Half of the pushes are slack, and all towards the goal; the others are of any pressure up to the largest.
TEST(Control, ABalloonIsBlownUpInHalfOfItsPushes) {
  const Toy toy(5, false, false, 99);
  Settings s = toy_settings();
  EXPECT_EQ(control_of(draw_sample(s, toy, 3), s, {3, 2, 1}).pressure_pa, 0);
  s.max_pressure_pa = 700, s.settle.pressure_pa = 600;
  int slack = 0, low = 0, all = 0;
  for (int i = 0; i < draws; ++i) {
    const Sample d = draw_sample(s, toy, i);
    Sample without = draw_sample(toy_settings(), toy, i);
    const Control c = control_of(d, s, {3, 2, 1});
    ASSERT_EQ(d.point, without.point);  // all else is drawn as ever
    ASSERT_LE(c.pressure_pa, 700);
    if (d.towards_goal) {
      ASSERT_EQ(c.pressure_pa, 0);
      continue;
    }
    ++all, slack += c.pressure_pa == 0, low += c.pressure_pa > 0 && c.pressure_pa < 350;
  }
  EXPECT_NEAR(double(slack) / all, 0.5, 0.05);
  EXPECT_NEAR(double(low) / all, 0.25, 0.05);
  EXPECT_EQ(settle_control(s, 5).pressure_pa, 600);
  EXPECT_EQ(goal_control(s, 5).pressure_pa, 0);
  s.via.push_back({s.goal, true});
  EXPECT_EQ(settings_of_leg(s, 0).settle.pressure_pa, 0);
  EXPECT_EQ(settings_of_leg(s, 1).settle.pressure_pa, 600);
}

TEST(Control, AtThePointItselfThereIsNoDirectionAndNoForce) {
  Sample d;
  d.manipulation = Manipulation::body;
  d.force_n = 5;
  d.point = Vec3(1, 2, 3);
  EXPECT_EQ(control_of(d, toy_settings(), d.point).force_n, Vec3f(0, 0, 0));
}

TEST(Settings, OutOfRangeIsAnInputErrorThatNamesTheSetting) {
  const Toy toy;
  const double nan = std::nan("");
  const std::vector<std::pair<std::string, std::function<void(Settings&)>>> bad = {
      {"max_iterations", [](Settings& s) { s.max_iterations = -1; }},
      {"center_of_mass_m", [&](Settings& s) { s.goal.center_of_mass_m.y() = nan; }},
      {"radius_m", [](Settings& s) { s.goal.radius_m = 0; }},
      {"radius_m", [&](Settings& s) { s.goal.radius_m = nan; }},
      {"goal_bias", [](Settings& s) { s.goal_bias = 1.1; }},
      {"goal_bias", [&](Settings& s) { s.goal_bias = nan; }},
      {"body", [](Settings& s) { s.weights.body = -1; }},
      {"control_point", [&](Settings& s) { s.weights.control_point = nan; }},
      {"interpolation",
       [](Settings& s) { s.weights.interpolation = std::numeric_limits<double>::infinity(); }},
      {"weight 0",
       [](Settings& s) {
         s.weights = {0, 0, 1};
       }},
      {"weight 0",
       [](Settings& s) {
         s.weights = {0, 0, 0}, s.goal_bias = 1;
       }},
      {"max_force_n", [](Settings& s) { s.max_force_n = -1; }},
      {"max_force_share", [](Settings& s) { s.max_force_share = 2; }},
      {"min_force_share", [](Settings& s) { s.min_force_share = 0.9, s.max_force_share = 0.8; }},
      {"min_duration_s", [](Settings& s) { s.min_duration_s = 2; }},
      {"max_duration_s", [](Settings& s) { s.max_duration_s = 1e30; }},
      {"control_point_radius_m", [](Settings& s) { s.control_point_radius_m = 0; }},
      {"settle", [](Settings& s) { s.settle.max_duration_s = -1; }},
      {"settle", [](Settings& s) { s.settle.mean_speed_m_s = 0; }},
      {"settle", [](Settings& s) { s.settle.max_force_share = 1.5; }},
      {"frames_per_second", [](Settings& s) { s.frames_per_second = 0; }},
      {"in_flight", [](Settings& s) { s.in_flight = -2; }},
      {"time_limit_s", [&](Settings& s) { s.time_limit_s = nan; }}};
  validate(toy_settings(), toy);
  for (const auto& [name, change] : bad) {
    Settings s = toy_settings();
    change(s);
    try {
      validate(s, toy);
      ADD_FAILURE() << name << " passed";
    } catch (const InputError& trouble) {
      EXPECT_NE(std::string(trouble.what()).find(name), std::string::npos) << trouble.what();
    }
  }
}

TEST(Settings, SurviveJson) {
  Settings s = toy_settings();
  s.seed = 0xffffffffffffffffu;
  s.goal.center_of_mass_m = Vec3(1.0 / 3, -0.1, 1e-300);
  s.settle.mean_speed_m_s = 0.1 + 0.2;
  for (const double limit : {12.5, std::numeric_limits<double>::infinity()}) {
    s.time_limit_s = limit;
    const Json json = parse_json(json_of(s).dump(), "test");
    const Settings back = settings_from_json(json, "test");
    EXPECT_EQ(json_of(back), json_of(s));
    EXPECT_EQ(back.goal.center_of_mass_m, s.goal.center_of_mass_m);
    EXPECT_EQ(back.time_limit_s, limit);
  }
  const Json whole = json_of(s);
  for (const auto& [key, value] : whole.items()) {
    Json missing = whole;
    missing.erase(key);
    EXPECT_THROW(settings_from_json(missing, "test"), InputError) << key;
  }
  // What no whole number can hold must not be cut to one.
  for (const char* key : {"/seed", "/max_iterations", "/in_flight", "/laws/lag"})
    for (const Json& odd : {Json(1e300), Json(-0x1p63), Json("1")}) {
      Json other = whole;
      other[Json::json_pointer(key)] = odd;
      EXPECT_THROW(settings_from_json(other, "test"), InputError) << key << " " << odd;
    }
}

}  // namespace
}  // namespace limber::plan
