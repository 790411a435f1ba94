#include "limber/detail/bench/bench.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "core/version.h"
#include "limber/detail/film/frame_list.h"
#include "limber/detail/plan/diagnosis.h"
#include "limber/detail/plan/plan.h"
#include "limber/detail/world/analysis.h"
#include "limber/detail/world/scene_world.h"

namespace limber::detail {

// A scene under a preset: all that its runs share. Stays where it is, for the system knows its bodies.
struct BenchRuns::Setup {
  Setup(const BenchOptions& bench, const std::string& scene_given, const std::string& preset)
      : options(options_of(bench, scene_given, preset)),
        scene(read_scene(options)),
        bodies(prepare_bodies(scene, bench.data, bench.out / scene.name, bench.store)),
        world(build_world_in(bench.out / scene.name, bench.store, scene, bodies)),
        system(world, bodies, goal_rules_of(scene)) {
    system.surfaces()->require_apart(system.start(), true);
  }
  Setup(const Setup&) = delete;

  static PlanOptions options_of(const BenchOptions& bench, const std::string& scene,
                                const std::string& preset) {
    PlanOptions options;
    options.scene = {scene, bench.sets, bench.data};
    options.preset = preset;
    options.iterations = bench.iterations;
    options.time_limit_s = bench.time_limit_s;
    options.in_flight = bench.in_flight;
    return options;
  }

  PlanOptions options;
  scenes::Scene scene;
  std::vector<PreparedBody> bodies;
  fem::World world;
  FemSystem system;
};

namespace {

InOrder<VolumeFigures> volume_figures(const fem::World& world, const MotionFigures& figures) {
  InOrder<VolumeFigures> bodies;
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    if (!world.bodies[b].moving) continue;
    const auto within = [&](double percent) {
      return std::count_if(figures.frames.begin(), figures.frames.end(), [&](const FrameFigures& frame) {
        return std::abs(frame.bodies[b].volume_change) <= 0.01 * percent;
      });
    };
    VolumeFigures& of = bodies.emplace_back(world.bodies[b].name, VolumeFigures{}).second;
    of.largest_percent = 100 * figures.largest_volume_change[b];
    of.frames = std::ssize(figures.frames);
    for (std::size_t i = 0; i < of.within.size(); ++i) of.within[i] = within(volume_limits_percent[i]);
  }
  return bodies;
}

// Every tenth of a second, to the millimetre: enough to see which way the robot went.
Json robot_path(const FemSystem& system, const plan::Trajectory& path) {
  Json places = Json::array();
  const double millimetre = 1000;
  for (double f = 0; f < double(path.frames.size()); f += std::max(1.0, path.frames_per_second / 10)) {
    const Vec3 place = system.robot_center(path.frames[std::size_t(f)]);
    Json& list = places.emplace_back(Json::array());
    for (const double x : place) list.push_back(std::round(millimetre * x) / millimetre);
  }
  return places;
}

Json record_of(const BenchRuns::Setup& setup, const plan::Plan& plan, const RunIdentity& identity) {
  std::string explanation = plan::explain(plan);
  if (!plan.solved()) explanation += " " + diagnose(setup.world, setup.system, plan).text;
  Json record{{"scene", setup.scene.name},         {"preset", setup.scene.planner.preset},
              {"seed", plan.settings.seed},        {"solved", plan.solved()},
              {"explanation", explanation},        {"nodes", plan.tree.size()},
              {"distance_m", plan.best_distance_m}};
  record.update(plan::json_of(plan.statistics));
  record.update(record_of_motion(setup.world, setup.bodies, setup.system, plan.trajectory));
  record.update({{"tree_hash", hex(plan::hash_of(plan.tree))}, {"identity", json_of_fields(identity)}});
  return record;
}

struct IdentityTold {
  RunIdentity identity;
  template <class Fields>
  void fields(Fields& f) {
    f("identity", identity);
  }
};

std::string date_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32] = "";
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &utc);
  return text;
}

// One file a scene: OMPL's log knows one experiment each. Several get the scene's name before the extension.
std::vector<fs::path> write_ompl_logs(const RunRecords& records, const fs::path& path) {
  std::map<std::string, RunRecords> scenes;
  for (const RunRecord& record : records) scenes[record.scene].push_back(record);
  std::vector<fs::path> written;
  for (const auto& [name, of_scene] : scenes) {
    fs::path file = path;
    if (scenes.size() > 1)
      file.replace_filename(fmt::format("{}.{}{}", path.stem().string(), name, path.extension().string()));
    write_file(file, ompl_log(of_scene, date_now()));
    written.push_back(file);
  }
  return written;
}

}  // namespace

Json record_of_motion(const fem::World& world, const std::vector<PreparedBody>& bodies,
                      const FemSystem& system, const plan::Trajectory& motion) {
  const MotionFigures figures = measure_motion(world, bodies, motion, system.surfaces());
  char host[256] = "unknown";
  ::gethostname(host, sizeof host - 1);
  Json record{{"motion_s", double(motion.end.step) * world.dt_s},
              {"robot_path_m", robot_path(system, motion)},
              {"volume", json_of_fields(volume_figures(world, figures))},
              {"deepest_penetration_percent", 100 * figures.deepest_penetration_m / figures.robot_size_m}};
  record.update(json_of(figures));
  record.update(
      {{"trajectory_hash", hex(plan::hash_of(motion))}, {"threads", thread_count()}, {"host", host}});
  return record;
}

RunIdentity identity_of_run(const scenes::Scene& scene, const FemSystem& system,
                            const plan::Settings& settings) {
  Hasher text;
  text.text(scene.text);
  for (const std::string& set : scene.sets) text.text(set);
  Json shaping = plan::json_of(settings);
  shaping.erase("in_flight");
  return {version, program_hash(), hex(text.digest()), hex(system.hash()), shaping};
}

bool is_done(const fs::path& file, const RunIdentity& identity) {
  if (!fs::exists(file)) return false;
  const RunIdentity there =
      read_fields<IdentityTold>(read_json(file), file.string(), "it is no record of limber bench: remove it")
          .identity;
  if (json_of_fields(there) == json_of_fields(identity)) return true;
  std::string what = "other settings";
  if (there.program != identity.program) what = "another build of limber";
  if (there.scene_hash != identity.scene_hash) what = "another text of the scene, or other --set";
  throw InputError(fmt::format("{}: was made with {}; take another folder with -o, or remove {}",
                               file.string(), what, file.parent_path().string()));
}

BenchRuns::BenchRuns(BenchOptions options) : options_(std::move(options)) {
  if (options_.scenes.empty()) throw InputError("bench: name one scene at least, or folders with --merge");
  if (options_.out.empty()) throw InputError("bench: say with -o where the records go");
  if (options_.presets.empty()) options_.presets = {""};
  if (std::set(options_.presets.begin(), options_.presets.end()).size() != options_.presets.size() ||
      std::set(options_.scenes.begin(), options_.scenes.end()).size() != options_.scenes.size())
    throw InputError("bench: a scene or preset is named twice; name each once");
  seeds_ = parse_seeds(options_.seeds);
}

BenchRuns::~BenchRuns() = default;

std::size_t BenchRuns::count() const {
  return seeds_.size() * options_.scenes.size() * options_.presets.size();
}

BenchRuns::Setup& BenchRuns::setup_of(std::size_t scene, std::size_t preset) {
  const std::string& given = options_.scenes[scene];
  std::unique_ptr<Setup>& setup = setups_[scene * options_.presets.size() + preset];
  if (!setup) setup = std::make_unique<Setup>(options_, given, options_.presets[preset]);
  const std::string& name = setup->scene.name;
  const std::string& first = scene_from_name_.try_emplace(name, given).first->second;
  if (first != given)
    throw InputError(
        fmt::format("{} and {}: are both scenes with the name \"{}\"; rename one", first, given, name));
  return *setup;
}

void BenchRuns::prepare(std::size_t scene) { setup_of(scene, 0); }

std::string BenchRuns::run(std::size_t run) {
  const std::size_t a_seed = options_.scenes.size() * options_.presets.size(), which = run % a_seed;
  const std::size_t scene_index = which / options_.presets.size();
  Setup& setup = setup_of(scene_index, which % options_.presets.size());
  setup.options.seed = seeds_[run / a_seed];
  const plan::Settings settings = settings_of(setup.scene, setup.options);
  const std::string& preset = setup.scene.planner.preset;
  const std::string label = fmt::format("{}.{}.{}", setup.scene.name, preset, settings.seed);
  const fs::path file = options_.out / "runs" / (label + ".json");
  const RunIdentity identity = identity_of_run(setup.scene, setup.system, settings);
  if (is_done(file, identity)) return label;
  try {
    const plan::Plan plan = plan::plan(setup.system, settings);
    if (plan.ending == plan::Ending::stopped) throw_if_stopped();
    const Json record = record_of(setup, plan, identity);
    make_folder(file.parent_path());
    write_file(file, text_of(record) + "\n");
    log::info("{}: {} after {} iterations, {:.2f} CPU s", label, plan.solved() ? "solved" : "not solved",
              plan.statistics.iterations, plan.statistics.cpu_s);
  } catch (const InternalError&) {
    const std::string sets =
        options_.sets.empty() ? "" : fmt::format(" --set {}", fmt::join(options_.sets, " --set "));
    log::warn("this run failed; to see it again: limber plan {} --preset {} --seed {} -o DIR{}",
              options_.scenes[scene_index], preset, settings.seed, sets);
    throw;
  }
  return label;
}

Benchmark bench(const BenchOptions& options) {
  if (options.merge.empty()) {
    BenchRuns runs(options);
    std::vector<int> wanted(runs.count());
    std::iota(wanted.begin(), wanted.end(), 0);
    wanted = chunk_of(wanted, options.chunk);
    try {
      Progress progress("bench", std::int64_t(wanted.size()));
      std::int64_t done = 0;
      for (const int run : wanted) {
        const std::string label = runs.run(std::size_t(run));
        progress.update(++done, label);
      }
    } catch (const Interrupted&) {
      log::info("{}: the finished runs are kept; the same command goes on", options.out.string());
      throw;
    }
  } else if (!options.scenes.empty()) {
    throw InputError("bench: --merge runs nothing, so it takes no scene; leave one of the two out");
  }
  const RunRecords records =
      read_records(options.merge.empty() ? std::vector<fs::path>{options.out} : options.merge);
  Benchmark benchmark{
      .report = report_of(records), .runs = records.size(), .records = {}, .page = {}, .ompl_logs = {}};
  // Machines that share a folder would write this file at the same time; --merge makes it for them.
  if (!options.out.empty() && options.chunk.empty()) {
    make_folder(options.out);
    std::string lines;
    for (const RunRecord& record : records) lines += text_of(record.json) + "\n";
    benchmark.records = options.out / "runs.jsonl", benchmark.page = options.out / "bench.html";
    write_file(*benchmark.records, lines);
    write_file(*benchmark.page, page_of_bench(records, benchmark.report));
    make_folder(options.out / "curves");
    for (const auto& [name, svg] : curves_of_bench(records)) write_file(options.out / "curves" / name, svg);
  }
  if (options.ompl_log) benchmark.ompl_logs = write_ompl_logs(records, *options.ompl_log);
  return benchmark;
}

}  // namespace limber::detail
