// Folders from strangers: whoever changes a plan can write its hashes, too. Each command says what is wrong.
#include <sys/stat.h>

#include "core/npz.h"
#include "plan/plan_file.h"
#include "tests/app/program.h"

namespace limber::app {
namespace {

class Strangers : public Program {
 protected:
  void SetUp() override {
    ASSERT_EQ(limber_program({"plan", scene(), "-o", out()}).code, exit_done);
    good_ = plan::read_plan(file());
  }
  fs::path file() const { return fs::path(out()) / "plan.npz"; }
  void write(const std::function<void(plan::Plan&)>& change) {
    plan::Plan bad = good_.plan;
    change(bad);
    plan::write_plan(file(), bad, good_.given);
  }
  // Every command that reads a plan ends with exit code 2 and these words.
  void expect_refused(const std::string& words) {
    for (std::vector<std::string> command :
         {std::vector<std::string>{"verify", out()},
          {"render", out(), "--set", "film.forces=true"},
          {"export", out(), "--format", "gltf"},
          {"report", out()},
          {"robust", out(), "-n", "1"},
          {"refine", out(), "-o", out("fine")},
          {"plan", scene(), "-o", out(), "--resume"}}) {
      const Result result = limber_program(command);
      EXPECT_EQ(result.code, exit_bad_input) << command[0] << ": " << result.err;
      EXPECT_NE(result.err.find(words), std::string::npos) << command[0] << ": " << result.err;
      EXPECT_NE(result.err.find("plan.npz"), std::string::npos) << command[0] << ": " << result.err;
    }
  }
  plan::PlanFile good_;
};

TEST_F(Strangers, AControlAtANodeThatTheRobotLacksIsRefused) {
  for (const int node : {-7, 27, 1 << 30}) {
    write([&](plan::Plan& p) {
      p.trajectory.controls[0].manipulation = Manipulation::control_point;
      p.trajectory.controls[0].node = node;
    });
    expect_refused(fmt::format("path_node[0] is {}", node));
  }
  write([](plan::Plan& p) { p.tree.controls[1].node = 27; });
  expect_refused("tree_node[1] is 27");
}

// The whole file is of one piece, but of another world.
TEST_F(Strangers, StatesOfOtherBodiesAreRefused) {
  write([](plan::Plan& p) {
    const auto cut = [](State s) {
      s.positions.resize(30), s.velocities.resize(30);
      return s;
    };
    plan::States states;
    for (std::size_t i = 0; i < std::size_t(p.tree.size()); ++i)
      states.push_back(cut(p.tree.states[i]), p.tree.parents[i]);
    p.tree.states = states;
    for (State& frame : p.trajectory.frames) frame = cut(frame);
    p.trajectory.end = cut(p.trajectory.end);
  });
  expect_refused("its states hold 30 numbers");
}

// 2³¹ − 1 steps in a path of three frames, all that can be added up being right.
TEST_F(Strangers, APathThatHasFewerFramesThanItsReplayIsRefused) {
  write([](plan::Plan& p) {
    plan::Trajectory& t = p.trajectory;
    const std::int64_t more = std::numeric_limits<std::int32_t>::max() - t.controls.back().steps;
    t.controls.back().steps += std::int32_t(more), t.end.step += more;
  });
  expect_refused("lacks the frame at step");
}

TEST_F(Strangers, NumbersThatNoPlanHasAreRefused) {
  write([](plan::Plan& p) { p.trajectory.frames[1].positions[0] = std::numeric_limits<float>::quiet_NaN(); });
  expect_refused("frame_positions[1] holds nan");
  for (const double fps : {0.0, -1.0, 1e9, 1e-300}) {
    write([&](plan::Plan& p) { p.settings.frames_per_second = p.trajectory.frames_per_second = fps; });
    expect_refused("frames_per_second is");
  }
  write([](plan::Plan& p) { p.statistics.iterations = std::int64_t(1) << 62; });
  expect_refused("statistics.iterations is");
}

}  // namespace
}  // namespace limber::app
