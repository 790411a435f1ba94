// Plans a scene, throws a handful of pushes at its world, and prepares a model: plan_and_look [SCENE
// [MODEL]].
#include <limber/limber.h>

#include <cstdio>
#include <exception>

namespace {

class Terminal final : public limber::Watcher {
  void warn(const std::string& text) override { std::fprintf(stderr, "%s\n", text.c_str()); }
};

void plan(const std::string& name, const limber::Context& context) {
  const limber::Problem problem(limber::read_scene(name, {.preset = "fast"}), {}, context);
  const limber::Plan plan = problem.solve({.seed = 1}, context);
  std::printf("%s\ntree %s, trajectory %s\n", plan.explanation().c_str(), plan.tree_hash().c_str(),
              plan.trajectory_hash().c_str());

  std::vector<limber::Push> pushes;
  for (int i = 0; i < 8; ++i)
    pushes.push_back({.kind = limber::Push::Kind::body, .force_n = {10.f * float(i), 0, 0}, .steps = 50});
  const limber::States ends = problem.rollout(problem.start(8), pushes, context);
  for (const auto& [x, y, z] : problem.robot_centers(ends)) std::printf("%.6f %.6f %.6f\n", x, y, z);
}

void prepare(const std::string& file) {
  const limber::Body body = limber::prepare(file, {.shells = 16, .tets = 500});
  std::printf("%zu hulls, %zu tets, the certificate %s\n", body.hulls().size(), body.cage().tets.size(),
              body.certificate().holds ? "holds" : "does not hold");
}

}  // namespace

int main(int argc, char** argv) try {
  Terminal terminal;
  plan(argc > 1 ? argv[1] : "barriers1", {.watcher = &terminal, .threads = 2});
  if (argc > 2) prepare(argv[2]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
