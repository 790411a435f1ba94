#include "limber/detail/farm/work.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <mutex>
#include <new>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/events.h"
#include "core/hash.h"
#include "core/job.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/threads.h"
#include "limber/detail/body/body_store.h"
#include "limber/detail/farm/engines.h"
#include "limber/detail/farm/lease.h"
#include "limber/detail/report/report.h"
#include "limber/detail/world/scene_world.h"
#include "limber/exit_codes.h"
#include "plan/plan_file.h"
#include "scenes/library.h"

namespace limber::detail {

namespace {

constexpr int max_taken = 5;   // a unit whose owners were killed that often kills them
constexpr int max_rounds = 3;  // in which missing frames are sent once more
constexpr int between_turns_us = 100000;
constexpr double between_saves_s = 300;  // of a search
constexpr double between_asks_s = 0.5;

using Clock = std::chrono::steady_clock;
double elapsed_s(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

// Ends what is at work when this process is told to end, or the farm is cancelled.
class EndWatcher : public Watcher {
 public:
  explicit EndWatcher(const FarmFolder& farm) : farm_(farm) {}
  bool stop() override {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || elapsed_s(asked_) < between_asks_s) return stop_;
    asked_ = Clock::now();
    stop_ = stop_ || signal() != 0 || farm_.is_cancelled() || is_over();
    return stop_;
  }
  void warn(const std::string& text) override {  // into the worker's log
    const WorkingFor nobody(nullptr);
    log::warn("{}", text);
  }

 protected:
  virtual bool is_over() { return false; }
  const FarmFolder& farm_;
  const Clock::time_point began_ = Clock::now();

 private:
  // Of the process: within the job that is watched, stop_signal() tells of the watcher.
  static int signal() {
    const WorkingFor nobody(nullptr);
    return stop_signal();
  }
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  Clock::time_point asked_ = began_;
};

// Ends also a search that cannot win any more, and, to be kept and gone on with, one that has run for long.
class SearchWatcher final : public EndWatcher {
 public:
  SearchWatcher(const FarmFolder& farm, std::uint64_t seed) : EndWatcher(farm), seed_(seed) {}
  void at(std::int64_t iterations) { iterations_ = iterations; }

 private:
  bool is_over() override {
    const std::optional<Best> best = best_search(farm_);
    return (best && iterations_ >= best->iterations_to_beat(seed_)) || elapsed_s(began_) > between_saves_s;
  }
  const std::uint64_t seed_;
  std::atomic<std::int64_t> iterations_{0};
};

class Worker {
 public:
  explicit Worker(const WorkOptions& options)
      : options_(options), farm_(options.folder), leases_(farm_.leases()) {
    const FarmSpec& spec = farm_.spec();
    if (spec.program != program_hash())
      throw InputError(fmt::format(
          "{}: was submitted by another build of limber, whose results may have other bytes; submit it anew "
          "with this one",
          farm_.work().string()));
    if (hash_of_scenes(spec.options) != spec.scene_hash)
      throw InputError(fmt::format("{}: was edited after it was submitted in {}; submit it anew",
                                   spec.options.bench ? "one of its scenes" : spec.options.plan.scene.scene,
                                   farm_.work().string()));
    if (!spec.options.bench && !spec.options.batch) scene_ = read_scene(spec.options.plan);
  }

  WorkDone run() {
    while (true) {
      throw_if_ended();
      const Step step = next();
      if (step == Step::did_one) continue;
      if (step == Step::waits && options_.wait) {
        ::usleep(between_turns_us);
        continue;
      }
      result_.ending = step == Step::waits    ? WorkDone::others_at_work
                       : step == Step::sent   ? WorkDone::sent_again
                       : step == Step::failed ? WorkDone::some_failed
                                              : WorkDone::all_done;
      return result_;
    }
  }

 private:
  enum class Step { did_one, waits, failed, done, sent };

  void throw_if_ended() const {
    throw_if_stopped();
    if (farm_.is_cancelled()) throw Interrupted(SIGTERM);
  }

  // Of the first stage that is not done takes a unit that nobody has.
  Step next() {
    for (const Stage stage : farm_.stages()) {
      if (stage > options_.until) break;
      std::vector<Unit> remaining;
      result_.failed.clear();
      for (Unit& unit : farm_.units(stage)) {
        if (known_done_.contains(unit.name)) continue;
        if (const auto failure = farm_.failure_of(unit)) {
          if (result_.failed.empty()) result_.exit_code = failure->exit_code;
          result_.failed.push_back(fmt::format("{}: {}: {}", unit.name, failure->reason, failure->message));
        } else {
          remaining.push_back(std::move(unit));
        }
      }
      if (remaining.empty() && result_.failed.empty()) continue;
      if (remaining.empty()) return Step::failed;
      const Step step = do_one_of(stage, remaining);
      if (step != Step::done) return step;
      if (!result_.failed.empty()) return Step::failed;
    }
    return Step::done;
  }

  // Done: all are.
  Step do_one_of(Stage stage, const std::vector<Unit>& remaining) {
    const auto held = leases_.look();
    bool others = false, left = false;
    for (const Unit& unit : remaining) {
      const auto found = held.find(unit.name);
      const Leases::Seen* const owner = found == held.end() ? nullptr : &found->second;
      if (owner && !owner->lost) {
        others = true;
        continue;
      }
      if (farm_.is_done(unit)) {
        known_done_.insert(unit.name);
        continue;
      }
      if (owner && owner->taken >= max_taken) {
        farm_.mark_failed(unit, {"crash",
                                 fmt::format("{} processes that did it were killed or crashed; see {}",
                                             max_taken, farm_.logs().string()),
                                 exit_defect});
        return Step::did_one;
      }
      if (sends_again_ && (stage <= Stage::frames || stage == Stage::runs || stage == Stage::models)) {
        left = true;
        continue;
      }
      const auto lease = leases_.take(unit.name, owner);
      if (!lease) {
        others = true;
        continue;
      }
      if (!farm_.is_done(unit)) do_unit(unit, remaining.size());
      return Step::did_one;
    }
    if (others) return Step::waits;
    return left ? send_again() : Step::done;
  }

  // Those who were to do it ended before it was done: all of them are sent once more, for one alone would be
  // long at it.
  Step send_again() {
    const int rounds = farm_.jobs().rounds;
    if (rounds < max_rounds && slurm_is_there()) {
      log::warn("some of it is missing; it is sent once more");
      send_to_slurm(farm_, rounds + 1);
      return Step::sent;
    }
    sends_again_ = false;
    return Step::did_one;
  }

  void do_unit(const Unit& unit, std::size_t of_stage) {
    const FarmOptions& options = farm_.spec().options;
    // On one machine those that are few share what the others leave.
    const int at_once = std::min(options.workers, int(of_stage));
    const int threads = options_.threads > 0 ? options_.threads : options.threads;
    set_thread_count(options.engine == "local" ? std::max(threads, options.workers * threads / at_once)
                                               : threads);
    const Clock::time_point began = Clock::now();
    const double cpu_before = cpu_seconds();
    const auto fail = [&](const char* reason, const std::string& message, int exit_code) {
      log::warn("{}: {}", unit.name, message);
      farm_.mark_failed(unit, {reason, message, exit_code});
    };
    try {
      std::optional<UnitDone> told = result_of(unit);
      if (!told) return;
      told->seconds = std::round(1e3 * elapsed_s(began)) / 1e3;
      told->cpu_s = std::round(1e3 * (cpu_seconds() - cpu_before)) / 1e3;
      told->worker = this_worker();
      farm_.mark_done(unit, *told);
      if (unit.stage == Stage::plan) known_done_.clear();  // there are other frames now
      known_done_.insert(unit.name);
      ++result_.units;
      log::info("{}: {:.2f} s", unit.name, *told->seconds);
    } catch (const FramesFailed& error) {
      fail("frames", error.what(), exit_frames_failed);
    } catch (const InputError& error) {
      fail("refused", error.what(), exit_bad_input);
    } catch (const std::bad_alloc&) {
      fail("memory", not_enough_memory, exit_bad_input);
    } catch (const InternalError& error) {
      fail("defect", error.what(), exit_defect);
    }
  }

  struct FramesFailed : std::runtime_error {
    using std::runtime_error::runtime_error;
  };

  // What is told of it; nothing: something that it needs has gone, and is done again first.
  std::optional<UnitDone> result_of(const Unit& unit) {
    switch (unit.stage) {
      case Stage::bodies:
        return do_body(unit);
      case Stage::search:
        return do_search(unit);
      case Stage::plan:
        return do_plan();
      case Stage::frames:
        return do_frames(unit);
      case Stage::film:
        return do_film();
      case Stage::report:
        return do_report();
      case Stage::runs:
        return do_runs(unit);
      case Stage::table:
        return do_table();
      case Stage::models:
        return do_models(unit);
      case Stage::page:
        return do_page();
    }
    return {};
  }

  const PlanOptions& plan_options() const { return farm_.spec().options.plan; }
  RenderOptions film_options() const { return {farm_.spec().options.film, farm_.work()}; }

  BenchRuns& bench_runs() {
    if (!bench_runs_) bench_runs_ = std::make_unique<BenchRuns>(*farm_.spec().options.bench);
    return *bench_runs_;
  }

  UnitDone do_runs(const Unit& unit) {
    UnitDone told;
    told.records.emplace();
    for (const std::size_t run : unit.runs) told.records->push_back(bench_runs().run(run));
    return told;
  }

  UnitDone do_table() {
    BenchOptions options;
    options.merge = {farm_.work()}, options.out = farm_.work();
    UnitDone told;
    told.runs = int(bench(options).runs);
    return told;
  }

  UnitDone do_report() {
    UnitDone told;
    told.all_kept = report(farm_.work()).all_kept;
    return told;
  }

  // As many at once as it has threads. What models fail does not fail it.
  UnitDone do_models(const Unit& unit) {
    EndWatcher watcher(farm_);
    Job job({.watcher = &watcher, .threads = thread_count()});
    const WorkingFor working(&job);
    try {
      return told_of(prepare_part(*farm_.spec().options.batch, unit.name, unit.models));
    } catch (const Interrupted&) {
      const WorkingFor nobody(nullptr);
      throw_if_ended();
      throw;
    }
  }

  // Looks at all of them once more, and makes what has gone or was changed meanwhile.
  UnitDone do_page() {
    BatchOptions all = *farm_.spec().options.batch;
    all.retry_failed = false;
    return told_of(prepare_many(all));
  }

  static UnitDone told_of(const PreparedMany& prepared) {
    UnitDone told;
    told.models = prepared.models, told.failed_models = prepared.failed + prepared.failed_before;
    told.reasons = prepared.reasons;
    return told;
  }

  UnitDone do_body(const Unit& unit) {
    if (farm_.spec().options.bench) {
      bench_runs().prepare(unit.scene);
      return {};
    }
    const SceneSource& options = plan_options().scene;
    if (unit.body.empty()) {
      prepare_beside(scene_, options.data, farm_.work());
      return {};
    }
    for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
      if (scene_.bodies[b].name == unit.body) {
        prepare_bodies_of(scene_, {b}, options.data, farm_.work(), options.store);
        keep_stiffness_shares(scene_, {b}, farm_.work());  // else each search would find it
      }
    return {};
  }

  struct Setup {
    std::vector<PreparedBody> bodies;
    fem::World world;
    FemSystem system;
    Setup(const scenes::Scene& scene, const PlanOptions& options)
        : bodies(prepare_bodies(scene, options.scene.data, options.out, options.scene.store)),
          world(build_world_in(options.out, options.scene.store, scene, bodies)),
          system(world, bodies, goal_rules_of(scene)) {
      system.surfaces()->require_apart(system.start(), true);
    }
  };
  const Setup& setup() {
    if (!setup_) setup_ = std::make_unique<Setup>(scene_, plan_options());
    return *setup_;
  }

  // As `limber plan --seed` searches, but no farther than where another seed has won.
  UnitDone do_search(const Unit& unit) {
    plan::Settings settings = settings_of(scene_, plan_options());
    settings.seed = unit.seed;
    const std::int64_t most = settings.max_iterations;
    const fs::path file = farm_.search_file(unit);
    std::error_code none;
    const auto told = [&](const char* how, std::int64_t iterations, bool solved) {
      UnitDone unit_done;
      unit_done.ended = how, unit_done.iterations = iterations, unit_done.solved = solved;
      return unit_done;
    };
    std::optional<plan::Plan> searched = search_to_go_on_with(unit, settings);
    while (true) {
      const std::optional<Best> best = best_search(farm_);
      settings.max_iterations = best ? std::min(most, best->iterations_to_beat(unit.seed)) : most;
      const std::int64_t done = searched ? searched->statistics.iterations : 0;
      if (settings.max_iterations < most && done >= settings.max_iterations) {
        fs::remove(file, none);
        return told("beaten", done, false);
      }
      {
        SearchWatcher watcher(farm_, unit.seed);
        Job job({.watcher = &watcher, .threads = thread_count()});
        const WorkingFor working(&job);
        searched = plan::plan(
            setup().system, settings, std::move(searched),
            [&](const plan::SearchProgress& progress) { watcher.at(progress.statistics.iterations); });
      }
      const bool at_end = searched->ending == plan::Ending::iterations && settings.max_iterations == most;
      if (!searched->solved() && !at_end && best_search(farm_)) {
        const std::optional<Best> now = best_search(farm_);
        if (searched->statistics.iterations >= now->iterations_to_beat(unit.seed)) continue;  // beaten
      }
      plan::write_plan(file, *searched, Json::object());
      if (searched->solved() || at_end) {
        UnitDone ended = told(at_end ? "iterations" : "goal", searched->statistics.iterations, !at_end);
        ended.leg = searched->leg(), ended.distance_m = searched->best_distance_m;
        return ended;
      }
      throw_if_ended();
    }
  }

  std::optional<plan::Plan> search_to_go_on_with(const Unit& unit, const plan::Settings& settings) {
    const fs::path file = farm_.search_file(unit);
    if (!fs::exists(file)) return std::nullopt;
    try {
      plan::PlanFile kept = plan::read_plan(file);
      if (kept.plan.system_hash == setup().system.hash() &&
          plan::first_difference(kept.plan.settings, settings).empty() && !kept.plan.solved())
        return std::move(kept.plan);
    } catch (const InputError&) {
    }
    log::info("{}: is of something else; searching anew", file.string());
    return std::nullopt;
  }

  // Of the search that won; where none did, of that which got farthest.
  std::optional<Unit> unit_that_won(const std::optional<Best>& best) const {
    std::optional<Unit> won;
    int leg = 0;
    double distance_m = 0;
    for (const Unit& unit : farm_.units(Stage::search)) {
      if (best && unit.seed != best->seed) continue;
      const UnitDone told = farm_.told_of(unit);
      const int its_leg = told.leg.value_or(0);
      const double its_distance_m = told.distance_m.value_or(0);
      const bool farther = its_leg > leg || (its_leg == leg && its_distance_m < distance_m);
      if (!won || farther) won = unit, leg = its_leg, distance_m = its_distance_m;
    }
    return won;
  }

  // What is told of the others depends on the winner alone, not on how far each happened to get.
  plan::PortfolioReport portfolio_report(const std::optional<Best>& best, std::int64_t most) const {
    plan::PortfolioReport report;
    for (const Unit& unit : farm_.units(Stage::search)) {
      const bool won = best && unit.seed == best->seed;
      const std::int64_t iterations = won    ? best->iterations
                                      : best ? std::max<std::int64_t>(0, best->iterations_to_beat(unit.seed))
                                             : most;
      report.searches.push_back({unit.seed, iterations, won});
      report.iterations += iterations;
      report.cpu_s += farm_.told_of(unit).cpu_s.value_or(0);
    }
    return report;
  }

  std::optional<UnitDone> do_plan() {
    const FolderLock lock(farm_.work(), FolderLock::alone, FolderLock::waits);
    const std::optional<Best> best = best_search(farm_);
    const std::optional<Unit> won = unit_that_won(best);
    LIMBER_CHECK(won.has_value());
    const plan::Settings settings = settings_of(scene_, plan_options());
    plan::Plan searched;
    try {
      searched = plan::read_plan(farm_.search_file(*won)).plan;
    } catch (const InputError&) {
      farm_.forget(*won), known_done_.erase(won->name);
      return std::nullopt;
    }
    searched.settings.max_iterations = settings.max_iterations;
    std::optional<plan::PortfolioReport> searches;
    if (plan_options().portfolio > 1) searches = portfolio_report(best, settings.max_iterations);
    const Setup& of = setup();
    Found found = make_better(scene_, of.system, plan_options(), std::move(searched), searches);
    throw_if_ended();
    const KeptPlan kept = keep_plan(farm_.work(), scene_, of.bodies, of.world, of.system, found.plan,
                                    found.extra, plan_options().keep_tree == "path");
    throw_if_ended();

    drop_film();
    const Filming& shown = filming();
    UnitDone told;
    told.frame_hashes.emplace();
    for (int f = 0; f < shown.shot->frames(); ++f) told.frame_hashes->push_back(shown.shot->hash_of(f));
    for (const Unit& unit : farm_.units(Stage::search)) {
      std::error_code none;
      fs::remove(farm_.search_file(unit), none);
    }
    const plan::Plan& plan = shown.planned.plan;
    told.solved = kept.reached, told.explanation = shown.planned.told.explanation;
    told.seed = plan.settings.seed, told.tree_hash = hex(plan::tree_hash_of(plan));
    told.trajectory_hash = hex(plan::hash_of(plan.trajectory));
    told.plan_file = hex(shown.planned.file_hash);
    told.frames_folder = shown.files.folder.filename().string();
    return told;
  }

  const Filming& filming() {
    if (!filming_) filming_ = std::make_unique<Filming>(film_options());
    return *filming_;
  }
  Shot::Painter& painter() {
    make_folder(filming().files.folder);
    if (!painter_) painter_ = std::make_unique<Shot::Painter>(*filming().shot);
    return *painter_;
  }
  void drop_film() { painter_.reset(), filming_.reset(); }

  std::optional<UnitDone> do_frames(const Unit& unit) {
    if (farm_.told_of(farm_.plan_unit()).plan_file != hex(filming().planned.file_hash)) {
      log::warn("{}: is another plan than was made for these frames; it is made again",
                (farm_.work() / "plan.npz").string());
      drop_film();
      farm_.forget(farm_.plan_unit()), known_done_.clear();
      return std::nullopt;
    }
    std::vector<int> missing = unit.frames;
    std::erase_if(missing, [&](int frame) { return filming().is_good(frame); });
    const FolderLock lock(farm_.work(), FolderLock::shared, FolderLock::waits);
    const std::vector<FailedFrame> failures =
        missing.empty() ? std::vector<FailedFrame>{} : paint_frames(filming(), missing, &painter());
    throw_if_ended();
    if (!failures.empty())
      throw FramesFailed(fmt::format("{} of {} frames failed; frame {}: {}", failures.size(), missing.size(),
                                     failures[0].frame, failures[0].why));
    UnitDone told;
    told.painted = int(missing.size());
    return told;
  }

  UnitDone do_film() {
    drop_film(), setup_.reset();
    const RenderedFilm film = render(film_options());
    if (!film.film)
      throw FramesFailed(
          fmt::format("{} frames are missing, {} failed", film.frames - film.wanted, film.failed));
    UnitDone told;
    told.film = film.film->lexically_relative(farm_.work()).string();
    told.sheet = film.sheet->lexically_relative(farm_.work()).string();
    told.frames = int(film.frames), told.painted = int(film.painted);
    return told;
  }

  const WorkOptions options_;
  const FarmFolder farm_;
  Leases leases_;
  scenes::Scene scene_;
  bool sends_again_ = options_.again;
  std::set<std::string> known_done_;
  std::unique_ptr<Setup> setup_;  // of searches and the plan
  std::unique_ptr<BenchRuns> bench_runs_;
  std::unique_ptr<Filming> filming_;  // of the frames
  std::unique_ptr<Shot::Painter> painter_;
  WorkDone result_;
};

}  // namespace

WorkDone work(const WorkOptions& options) { return Worker(options).run(); }

}  // namespace limber::detail
