// The library beside the command: the same bytes, and nothing that one call does is felt by another.
#include <gmock/gmock.h>

#include <atomic>
#include <functional>
#include <thread>

#include "core/mesh_files.h"
#include "limber/limber.h"
#include "tests/cli/program.h"

namespace limber {
namespace {

using detail::limber_program;
using testing::HasSubstr;

template <class F>
std::string complaint(F&& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

Mesh cube() {
  return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
          {{0, 2, 1},
           {0, 3, 2},
           {4, 5, 6},
           {4, 6, 7},
           {0, 1, 5},
           {0, 5, 4},
           {1, 2, 6},
           {1, 6, 5},
           {2, 3, 7},
           {2, 7, 6},
           {3, 0, 4},
           {3, 4, 7}}};
}

class Library : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::string path(const std::string& name) const { return (folder.path() / name).string(); }
  Scene small() const {
    std::ofstream(path("small.toml")) << detail::small_scene;
    return read_scene(path("small.toml"));
  }
  // Its bodies are prepared once for all tests.
  Problem small_problem() const {
    static const TemporaryFolder work;
    return Problem(small(), work.path());
  }
};

using Library_slow = Library;  // stays out of the sanitizer runs

TEST_F(Library, ACubeIsOneHullInACageThatCarriesIt) {
  const Mesh mesh = cube();
  const Decomposition d = decompose(mesh);
  ASSERT_EQ(d.hulls.size(), 1u);
  EXPECT_EQ(d.hulls[0].vertices.size(), 8u);
  EXPECT_EQ(d.triangles_uncovered, 0);
  const Cage cage = build_cage(cube(), d.hulls, {.tets = 100});
  EXPECT_TRUE(certify(cube(), cage).holds);
  const Binding binding = bind(cube(), cage);
  Vertices moved = cage.nodes;  // (x y z) → (2x + y, y + 3, z − x): affine, so exact
  for (auto& [x, y, z] : moved) std::tie(x, y, z) = std::tuple(2 * x + y, y + 3, z - x);
  const Vertices surface = deform(binding, cage.tets, moved);
  for (std::size_t v = 0; v < surface.size(); ++v) {
    const auto& [x, y, z] = mesh.vertices[v];
    EXPECT_NEAR(surface[v][0], 2 * x + y, 1e-12);
    EXPECT_NEAR(surface[v][1], y + 3, 1e-12);
    EXPECT_NEAR(surface[v][2], z - x, 1e-12);
  }
}

TEST_F(Library, ACageThatLeavesPartOutsideIsNotCertified) {
  Cage cage = build_cage(cube(), {}, {.tets = 100});
  for (auto& node : cage.nodes) node[0] += 0.5;
  const Certificate certificate = certify(cube(), cage);
  EXPECT_FALSE(certificate.holds);
  EXPECT_GT(certificate.vertices_outside, 0);
}

TEST_F(Library, WhatIsWrongIsNamed) {
  Mesh broken = cube();
  broken.faces[3][1] = 17;
  EXPECT_THAT(complaint([&] { decompose(broken); }), HasSubstr("17"));
  EXPECT_THAT(complaint([&] { decompose(cube(), {.max_convex_hull = 0}); }),
              HasSubstr("must be in [1, 1000]"));
  EXPECT_THAT(complaint([&] { build_cage(cube(), {}, {.mode = "lettuce"}); }), HasSubstr("\"lattice\""));
  EXPECT_THAT(complaint([&] { build_cage(cube(), {}, {.tets = 3}); }), HasSubstr("24"));
  EXPECT_THAT(complaint([&] { prepare(cube(), {.tets = 0}); }), HasSubstr("24"));
  EXPECT_THAT(complaint([&] { decompose(cube(), {}, {.threads = -1}); }), HasSubstr("threads is -1"));
  EXPECT_THAT(complaint([&] { decompose(cube(), {}, {.threads = 257}); }), HasSubstr("[0, 256]"));
  Mesh dented = cube();
  dented.vertices[6] = {0.4, 0.4, 0.4};
  EXPECT_THAT(complaint([&] { build_cage(cube(), {cube(), dented}); }), HasSubstr("hull 1: is not convex"));
  EXPECT_THAT(complaint([&] {
                deform({{0}, {{1, 0, 0, 0}}}, {{0, 1, 2, 3}}, {{0, 0, 0}, {0, NAN, 0}, {0, 0, 1}, {1, 0, 0}});
              }),
              HasSubstr("node 1 has a coordinate"));
  EXPECT_THAT(complaint([&] { read_scene("barrier1"); }), HasSubstr("barriers1"));
  EXPECT_THAT(complaint([&] {
                deform({{0}, {{1, 0, 0, 0}}}, {{0, 1, 2, 9}}, cube().vertices);
              }),
              HasSubstr("the node 9"));
}

TEST_F(Library, OptionsOfWorkFoldersOutOfRangeAreRefused) {
  const std::vector<std::pair<const char*, std::function<void()>>> calls{
      {"out is empty", [&] { plan_scene({.scene = {"barriers1"}}); }},
      {"stage's number", [&] { name_of(Stage(77)); }},
      {"portfolio", [&] { plan_scene({.scene = {"barriers1"}, .out = path("out"), .portfolio = 0}); }},
      {"keep_tree", [&] { plan_scene({.scene = {"barriers1"}, .out = path("out"), .keep_tree = "foo"}); }},
      {"tets_factor", [&] { refine_plan({.folder = path("a"), .out = path("b"), .tets_factor = 0}); }},
      {"bits", [&] { render_film(path("a"), {.bits = 7}); }},
      {"\"normal\"", [&] { render_film(path("a"), {.passes = {"heat"}}); }},
      {"repaint", [&] { verify({.folder = path("a"), .repaint = 0}); }},
      {"no format", [&] { export_motion(ExportOptions{.folder = path("a")}); }},
      {"\"sofa\"", [&] { export_body({.folder = path("a"), .formats = {"sofia"}}); }},
      {"perturbations", [&] { test_robustness({.folder = path("a"), .perturbations = 0}); }},
      {"in_flight", [&] { run_benchmark({.scenes = {"barriers1"}, .in_flight = -1, .out = path("b")}); }},
      {"shrink", [&] { make_scene({.from = path("a"), .out = path("b"), .robot = "x", .shrink = 2}); }},
      {"\"conform\"", [&] {
         ModelOptions options;
         options.model = path("a.obj"), options.out = path("b"), options.mode = "lettuce";
         prepare_folder(options);
       }}};
  for (const auto& [what, call] : calls) EXPECT_THAT(complaint(call), HasSubstr(what));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// It would start itself, and itself again.
TEST_F(Library, AnotherProgramIsToldToRunLimber) {
  EXPECT_THAT(complaint([&] { prepare_models({.models = {path("")}}); }), HasSubstr("limber prepare"));
  EXPECT_THAT(complaint([&] { submit_to_farm({}); }), HasSubstr("limber farm"));
}

TEST_F(Library_slow, AWorkFolderIsTheCommands) {
  const Scene scene = small();  // writes its file
  PlanOptions options;
  options.scene.scene = path("small.toml"), options.out = path("library"),
  options.seed = 6;  // a plan that keeps all
  const KeptPlan kept = plan_scene(options);
  EXPECT_TRUE(kept.reached);
  EXPECT_EQ(limber_program({"plan", path("small.toml"), "-o", path("command"), "--seed", "6"}).code, 0);
  EXPECT_EQ(read_file(kept.file), read_file(path("command/plan.npz")));
  EXPECT_THAT(kept.summary_json, HasSubstr(Plan::load(path("command")).trajectory_hash()));
  const RenderedFilm film = render_film(path("library"), {.frames = "0-1", .size = "32x32"});
  EXPECT_EQ(film.painted, 2);
  for (const Promise& promise : verify({.folder = path("library"), .film = true}).promises)
    EXPECT_TRUE(promise.kept) << promise.name << ": " << promise.value;
  EXPECT_EQ(facts_of_file(path("library")).kind, FileFacts::other);
  options.scene.scene = "small";  // no such scene
  EXPECT_THAT(complaint([&] { plan_scene(options); }), HasSubstr("small"));
}

TEST_F(Library_slow, ABodyIsTheBytesThatTheCommandWrites) {
  std::ofstream(path("t.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  ASSERT_EQ(limber_program({"prepare", path("t.obj"), "-o", path("by command"), "--tets", "100"}).code, 0);
  const Body body = prepare(std::filesystem::path(path("t.obj")), {.tets = 100});
  body.save(path("by library"));
  for (const char* file : {"surface.ply", "shells.obj", "cage.msh", "binding.npz", "contact.npz"})
    EXPECT_EQ(read_file(path("by command") + "/" + file), read_file(path("by library") + "/" + file)) << file;
  EXPECT_EQ(limber_program({"verify", path("by library")}).code, 0);
  // Up to date: the command finds nothing to make anew.
  EXPECT_THAT(limber_program({"prepare", path("t.obj"), "-o", path("by library"), "--tets", "100"}).err,
              HasSubstr("up to date"));
  const Body read = Body::load(path("by library"));
  EXPECT_EQ(read.surface().vertices, body.surface().vertices);
  EXPECT_EQ(read.cage().tets, body.cage().tets);
  EXPECT_EQ(read.binding().weights, body.binding().weights);
  EXPECT_EQ(read.deform(read.cage().nodes), body.deform(body.cage().nodes));
  read.save(path("again"));
  EXPECT_EQ(limber_program({"verify", path("again")}).code, 0);
}

TEST_F(Library_slow, APlanIsTheCommands) {
  const Scene scene = small();
  const detail::Result command =
      limber_program({"plan", path("small.toml"), "-o", path("by command"), "--seed", "6", "--json"});
  ASSERT_EQ(command.code, 0) << command.err;
  for (const int threads : {1, 2}) {
    const Problem problem(scene, {}, {.threads = threads});
    const Plan plan = problem.solve({.seed = 6}, {.threads = threads});
    EXPECT_TRUE(plan.solved());
    EXPECT_EQ(plan.tree_hash(), command.json().at("tree_hash"));
    EXPECT_EQ(plan.trajectory_hash(), command.json().at("trajectory_hash"));
    EXPECT_EQ(plan.frame_count(), command.json().at("frames"));
    if (threads == 2) continue;
    plan.save(path("by library"));
    Json summary = Json::parse(plan.summary_json()), told = command.json();
    for (Json* one : {&summary, &told})
      one->erase("statistics"), one->erase("dynamics"), one->erase("shortcut");
    EXPECT_EQ(summary, told);
  }
  const detail::Result verified =
      limber_program({"verify", path("by library"), "--scene", path("small.toml")});
  EXPECT_EQ(verified.code, 0) << verified.out << verified.err;
  const Plan read = Plan::load(path("by library"));
  EXPECT_EQ(read.trajectory_hash(), command.json().at("trajectory_hash"));
  for (const Promise& promise : verify(path("by library"))) EXPECT_TRUE(promise.kept) << promise.name;
}

TEST_F(Library_slow, APathIsSavedAlone) {
  const Problem problem(small());
  ASSERT_EQ(limber_program(
                {"plan", path("small.toml"), "-o", path("by command"), "--seed", "1", "--keep-tree", "path"})
                .code,
            0);
  const auto plan_in = [&](const char* folder) { return read_file(path(std::string(folder) + "/plan.npz")); };
  const Plan plan = problem.solve({.seed = 1});
  plan.save(path("alone"), {.keep_tree = "path"});
  EXPECT_EQ(plan_in("alone"), plan_in("by command"));
  plan.save(path("whole"));  // for the plan itself has all of it
  EXPECT_GT(plan_in("whole").size(), plan_in("alone").size());
  const Plan alone = Plan::load(path("alone")), whole = Plan::load(path("whole"));
  EXPECT_EQ(alone.tree_hash(), whole.tree_hash());
  alone.save(path("alone"), {.keep_tree = "path"});
  EXPECT_THAT(complaint([&] { whole.save(path("whole"), {.keep_tree = "path"}); }),
              HasSubstr("holds the whole tree"));
  EXPECT_THAT(complaint([&] { problem.resume(alone, {.seed = 1}); }), HasSubstr("path alone"));
  EXPECT_THAT(complaint([&] { plan.save(path("none"), {.keep_tree = "foo"}); }), HasSubstr("keep_tree"));
  EXPECT_FALSE(std::filesystem::exists(path("none")));

  const Plan cut = problem.solve({.seed = 1, .iterations = 1, .time_limit_s = 0});
  cut.save(path("cut"), {.keep_tree = "path"});
  EXPECT_EQ(problem.resume(Plan::load(path("cut")), {.seed = 1}).tree_hash(), plan.tree_hash());
}

TEST_F(Library_slow, WorkFoldersStayAndTemporaryOnesGo) {
  std::filesystem::create_directory(path("temporary"));
  ::setenv("TMPDIR", path("temporary").c_str(), 1);
  const auto temporary = [&] {
    return std::distance(std::filesystem::directory_iterator(path("temporary")), {});
  };
  const Scene scene = small();
  {
    const Problem made(scene, path("work")), elsewhere(scene);
    EXPECT_EQ(temporary(), 1);
    made.simulate(0.05).save(path("work"));
    elsewhere.simulate(0.05).save(path("other"));
  }
  EXPECT_EQ(temporary(), 0);
  ::unsetenv("TMPDIR");
  for (const char* kept : {"work", "other"}) {
    { const Plan read = Plan::load(path(kept)); }
    EXPECT_EQ(Plan::load(path(kept)).frame_count(), 1) << kept;
    EXPECT_TRUE(std::filesystem::exists(path(kept) + "/bodies/robot/cage.msh"));
  }
}

TEST_F(Library_slow, AFrameIsDrawnWhereTheCageCarriesIt) {
  const Problem problem = small_problem();
  const Plan plan = problem.solve({.seed = 5});
  const States frames = plan.frames();
  ASSERT_EQ(problem.scene().bodies()[0], "robot");
  const Problem::Range range = problem.nodes_of(0);
  Vertices nodes;
  for (int n = range.first; n < range.first + range.count; ++n) {
    const float* p = &frames.positions[std::size_t(3 * ((frames.count - 1) * frames.nodes + n))];
    nodes.push_back({p[0], p[1], p[2]});
  }
  EXPECT_EQ(plan.surface(0, frames.count - 1), problem.bodies()[0].deform(nodes));
  EXPECT_THAT(complaint([&] { plan.surface(0, frames.count); }), HasSubstr("there is no frame"));
  EXPECT_THAT(complaint([&] { plan.surface(2, 0); }), HasSubstr("there is no body 2"));
}

TEST_F(Library_slow, RolloutsDependOnTheirOwnStateAndPushAlone) {
  const Problem problem = small_problem();
  const auto push = [](int i, int steps) {
    return Push{.kind = i % 3 == 0 ? Push::Kind::body : Push::Kind::control_point,
                .force_n = {0.5f * float(i), 0, 1},
                .node = i,
                .radius_m = 0.3f,
                .steps = steps};
  };
  std::vector<Push> pushes;
  for (int i = 0; i < 21; ++i) pushes.push_back(push(i, 20 + i));
  const States ends = problem.rollout(problem.start(21), pushes, {.threads = 2});
  const std::size_t numbers = std::size_t(3 * problem.nodes());
  for (const int i : {0, 7, 20}) {
    // Alone, and in two halves.
    const States half = problem.rollout(problem.start(), {push(i, 10)});
    const States alone = problem.rollout(half, {push(i, 10 + i)});
    ASSERT_TRUE(alone.sound[0]);
    EXPECT_EQ(alone.steps[0], ends.steps[std::size_t(i)]);
    const auto row = ends.positions.begin() + std::ptrdiff_t(std::size_t(i) * numbers);
    EXPECT_EQ(alone.positions, std::vector<float>(row, row + std::ptrdiff_t(numbers))) << i;
  }
  // A push to the right moves it to the right, the more the harder.
  const auto centers = problem.robot_centers(ends);
  EXPECT_GT(centers[18][0], centers[9][0]);
  EXPECT_GT(centers[9][0], problem.robot_centers(problem.start())[0][0]);
}

TEST_F(Library, AGoalIsThatOfTheScene) {
  const Scene scene = read_scene("barriers1");
  ASSERT_TRUE(scene.goal());
  EXPECT_EQ(scene.goal()->center_of_mass_m, (std::array<double, 3>{9.2, 1.5, 1.5}));
  EXPECT_EQ(read_scene("barriers1", {.sets = {"planner.max_force_n=7"}}).max_force_n(), 7);
}

TEST_F(Library_slow, RolloutsOfWhatDoesNotFitAreRefused) {
  const Problem problem = small_problem();
  const States start = problem.start(2);
  EXPECT_THAT(complaint([&] { problem.rollout(start, {{.steps = 1}}); }), HasSubstr("1 pushes for 2 states"));
  EXPECT_THAT(complaint([&] {
                problem.rollout(start, {{.steps = 1}, {.steps = 0}});
              }),
              HasSubstr("push 1: steps is 0"));
  EXPECT_THAT(
      complaint([&] {
        problem.rollout(start, {{.steps = 1}, {.kind = Push::Kind::control_point, .node = 999, .steps = 1}});
      }),
      HasSubstr("node is 999"));
  EXPECT_THAT(complaint([&] {
                problem.rollout(start, {{.steps = 1}, {.force_n = {NAN, 0, 0}, .steps = 1}});
              }),
              HasSubstr("not finite"));
  States odd = start;
  odd.positions.pop_back();
  EXPECT_THAT(complaint([&] { problem.rollout(odd, {{.steps = 1}, {.steps = 1}}); }), HasSubstr("states"));
  odd = start;
  odd.sound.pop_back();
  EXPECT_THAT(complaint([&] { problem.rollout(odd, {{.steps = 1}, {.steps = 1}}); }), HasSubstr("1 of 2"));
  odd.sound.clear();
  EXPECT_TRUE(problem.rollout(odd, {{.steps = 1}, {.steps = 1}}).sound[0]);
  odd = start;
  odd.velocities[4] = INFINITY;
  EXPECT_THAT(complaint([&] {
                problem.rollout(odd, {{.steps = 1}, {.steps = 1}});
              }),
              HasSubstr("not finite"));
  odd = start;
  odd.steps[1] = -1;
  EXPECT_THAT(complaint([&] {
                problem.rollout(odd, {{.steps = 1}, {.steps = 1}});
              }),
              HasSubstr("state 1: its step is -1"));
  odd = start;
  odd.steps[0] = std::int64_t{1} << 60;
  EXPECT_THAT(complaint([&] { problem.rollout(odd, {{.steps = 1}, {.steps = 1}}); }), HasSubstr("state 0"));
  EXPECT_EQ(problem.rollout(problem.start(0), {}).count, 0);
}

TEST_F(Library_slow, WhatHasDivergedStaysSo) {
  const Problem problem = small_problem();
  const Push too_hard{.kind = Push::Kind::body, .force_n = {1e30f, 0, 0}, .steps = 5}, rest{.steps = 5};
  States states = problem.rollout(problem.start(2), {too_hard, rest});
  EXPECT_THAT(states.sound, testing::ElementsAre(0, 1));
  states = problem.rollout(states, {rest, rest});
  EXPECT_THAT(states.sound, testing::ElementsAre(0, 1));
}

// Each as the command refuses it, before anything is searched: an hour of search would be lost.
TEST_F(Library_slow, OptionsOutOfRangeAreRefusedBeforeTheSearch) {
  struct Searching final : Watcher {
    bool searched = false;
    void progress(const std::string&, std::int64_t, std::int64_t, const std::string&) override {
      searched = true;
    }
  };
  const Problem problem = small_problem();
  const auto refused = [&](const SolveOptions& options) {
    Searching watcher;
    const std::string what = complaint([&] { problem.solve(options, {.watcher = &watcher}); });
    EXPECT_FALSE(watcher.searched) << what;
    return what;
  };
  EXPECT_THAT(refused({.seed = -1}), HasSubstr("seed is -1"));
  EXPECT_THAT(refused({.seed = (std::int64_t{1} << 53) + 1}), HasSubstr("seed is"));
  EXPECT_THAT(refused({.iterations = -1}), HasSubstr("iterations is -1"));
  EXPECT_THAT(refused({.time_limit_s = NAN}), HasSubstr("time_limit_s is nan"));
  EXPECT_THAT(refused({.shortcut_rounds = -1}), HasSubstr("shortcut_rounds is -1"));
  EXPECT_THAT(refused({.cost = "length"}), HasSubstr("there is no cost \"length\""));
}

// Stops after so many questions, and remembers what it was told.
class Listener final : public Watcher {
 public:
  explicit Listener(int questions = -1) : questions_(questions) {}
  void progress(const std::string& stage, std::int64_t, std::int64_t, const std::string&) override {
    stages.insert(stage);
  }
  void warn(const std::string& text) override { warnings.push_back(text); }
  bool stop() override { return questions_ >= 0 && asked_++ >= questions_; }
  std::set<std::string> stages;
  std::vector<std::string> warnings;

 private:
  int questions_;
  std::atomic<int> asked_{0};
};

TEST_F(Library_slow, TwoPlansSideBySideAndOneIsStopped) {
  const Problem problem = small_problem();
  const std::string whole = problem.solve({.seed = 6}).tree_hash();
  Listener patient, hasty(3);
  std::optional<Plan> one, other;
  {
    std::jthread a([&] { one = problem.solve({.seed = 6}, {.watcher = &patient, .threads = 2}); });
    std::jthread b([&] {
      other = problem.solve({.seed = 7, .iterations = 1000000}, {.watcher = &hasty, .threads = 1});
    });
  }
  EXPECT_EQ(one->tree_hash(), whole);
  EXPECT_FALSE(other->solved());
  EXPECT_THAT(other->explanation(), HasSubstr("It was stopped after"));
  EXPECT_FALSE(patient.stages.empty());
  // Nothing is left behind for the next call, nor for the command.
  EXPECT_EQ(problem.solve({.seed = 6}).tree_hash(), whole);
  EXPECT_EQ(limber_program({"plan", path("small.toml"), "-o", path("out"), "--seed", "6"}).code, 0);
}

TEST_F(Library_slow, ASearchThatWasCutGoesOnAsIfItHadNotBeen) {
  const Problem problem = small_problem();
  const Plan whole = problem.solve({.seed = 5});
  ASSERT_GT(whole.iterations(), 1);
  Listener hasty(20);
  std::optional<Plan> plan = problem.solve({.seed = 5, .iterations = 1}, {.watcher = &hasty});
  EXPECT_FALSE(plan->solved());
  EXPECT_EQ(problem.resume(*plan, {.seed = 5}).trajectory_hash(), whole.trajectory_hash());
  // From a folder, too, and with what made the path better counted once.
  plan->save(path("begun"));
  const Plan gone_on = problem.resume(Plan::load(path("begun")), {.seed = 5});
  EXPECT_EQ(gone_on.tree_hash(), whole.tree_hash());
  EXPECT_EQ(gone_on.trajectory_hash(), whole.trajectory_hash());
  EXPECT_EQ(problem.resume(gone_on, {.seed = 5}).trajectory_hash(), whole.trajectory_hash());
  EXPECT_THAT(complaint([&] { problem.resume(*plan, {.seed = 6}); }), HasSubstr("seed"));
  EXPECT_THAT(complaint([&] { problem.resume(problem.simulate(0.1), {}); }), HasSubstr("is a simulation"));
}

TEST_F(Library_slow, AStoppedCallThrowsAndLeavesNothing) {
  Listener hasty(0);
  try {
    prepare(cube(), {}, {.watcher = &hasty});
    ADD_FAILURE() << "was not stopped";
  } catch (const Interrupted& stopped) {
    EXPECT_EQ(stopped.signal_number, Interrupted::by_watcher);
    EXPECT_STREQ(stopped.what(), "stopped, as the watcher asked");
  }
  EXPECT_THROW(Problem(small(), path("work"), {.watcher = &hasty}), Interrupted);
  const Problem problem = small_problem();
  EXPECT_THROW(problem.rollout(problem.start(), {{.steps = 1000}}, {.watcher = &hasty}), Interrupted);
}

TEST_F(Library_slow, WarningsGoToTheWatcherAndNothingToTheTerminal) {
  Mesh open = cube();
  open.faces.pop_back();
  Listener listener;
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  prepare(open, {.tets = 100}, {.watcher = &listener}).save(path("body"));
  small();
  const Problem problem(read_scene(path("small.toml")), {}, {.watcher = &listener});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(listener.stages, testing::Contains("prepare"));
}

}  // namespace
}  // namespace limber
