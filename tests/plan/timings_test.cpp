#include "plan/timings.h"

#include <gtest/gtest.h>

namespace limber::plan {
namespace {

const Json told = Json::parse(R"({
  "solved": true,
  "statistics": {"iterations": 7, "cpu_s": 1.5, "wall_s": 0.5, "rollouts": 9, "rollouts_wrong": 2, "diverged": 0},
  "dynamics": {"load_us": 3},
  "improve": {"improvements": [{"wall_s": 1, "iterations": 2}, {"wall_s": 3, "iterations": 4}], "searches": 5},
  "refine": {"how": "tracked", "track_cpu_s": 4},
  "frames": [1, 2],
  "from": {"folder": "a"}
})");

TEST(Timings, TakenOutAndPutBackAllIsThere) {
  const Json rest = without_timings(told), timings = timings_of(told);
  EXPECT_EQ(rest, Json::parse(R"({
    "solved": true, "statistics": {"iterations": 7, "diverged": 0},
    "improve": {"improvements": [{"iterations": 2}, {"iterations": 4}], "searches": 5}, "refine": {"how": "tracked"},
    "frames": [1, 2], "from": {"folder": "a"}})"));
  EXPECT_EQ(timings, Json::parse(R"({
    "statistics": {"cpu_s": 1.5, "wall_s": 0.5, "rollouts": 9, "rollouts_wrong": 2}, "dynamics": {"load_us": 3},
    "improve": {"improvements": [{"wall_s": 1}, {"wall_s": 3}]}, "refine": {"track_cpu_s": 4}})"));
  EXPECT_EQ(nlohmann::json(with_timings(rest, timings)), nlohmann::json(told));  // in any order
  EXPECT_TRUE(timings_of(rest).is_null());
  EXPECT_EQ(without_timings(rest), rest);
}

// Whoever changes the file beside a plan adds no claim to it.
TEST(Timings, NothingElseComesIn) {
  const Json rest = without_timings(told);
  for (const char* text :
       {R"({"quality": "best"})", R"({"solved": {"cpu_s": 1}})", R"({"new": {"cpu_s": 1}})",
        R"({"statistics": {"iterations": 1}})", R"({"improve": {"improvements": [{"wall_s": 1}]}})",
        R"({"frames": [{"cpu_s": 1}, {"cpu_s": 1}]})", R"([1])", R"(7)", R"(null)"})
    EXPECT_EQ(with_timings(rest, Json::parse(text)), rest) << text;
}

}  // namespace
}  // namespace limber::plan
