#include "plan/search.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/threads.h"

namespace limber::plan {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

// What became of a rollout.
struct Outcome {
  enum Kind { node, diverged, rejected } kind = diverged;
  State state;
  Vec3 center = Vec3::Zero();
  Vec3 goal_shift = Vec3::Zero();
};

Outcome outcome_of(const System& system, Rollout& rollout) {
  Outcome o;
  if (!rollout.ok) return o;
  const std::int64_t expected_step = rollout.from->step + rollout.control.steps;
  LIMBER_CHECK(rollout.to.step == expected_step, rollout.to.step, expected_step);
  o.center = system.robot_center(rollout.to);
  LIMBER_CHECK(o.center.allFinite(), o.center.x(), o.center.y(), o.center.z());
  o.goal_shift = system.goal_shift(rollout.to);
  o.kind = system.acceptable(rollout.to) ? Outcome::node : Outcome::rejected;
  o.state = std::move(rollout.to);
  return o;
}

// One iteration of Algorithm 1, on its way: computed from the node that is nearest as far as is known.
struct Expansion {
  std::int64_t iteration;
  Draw draw;
  Vec3f point;
  int near;
  float near_distance2;  // squared
  Control control;
  enum { waiting, running, finished } status = waiting;
  bool overtaken = false;  // while it ran, a nearer node was added
  Outcome outcome;
};

// Threads take expansions from one queue and commit them in its order. When a commit adds a node that is
// nearer to the point of a later expansion than the node that one started from, the later one is aimed anew.
// So whatever is committed started where the sequential algorithm would have started it.
class Search {
 public:
  Search(const System& system, const Settings& settings, Plan& plan)
      : system_(system), settings_(settings), plan_(plan), progress_("plan", settings.max_iterations) {
    const int lanes = std::max(1, system.lanes()), threads = std::max(1, thread_count());
    // With single lanes a thread that waits to be committed needs a second expansion; a batch holds enough.
    const int automatic = threads == 1 ? lanes : threads * std::max(lanes, 2);
    window_ = settings.in_flight > 0 ? settings.in_flight : automatic;
    threads_ = std::min(threads, window_);
    share_ = std::min(lanes, (window_ + threads_ - 1) / threads_);
    next_iteration_ = plan.statistics.iterations;
    for (int node = 0; node < plan.tree.size(); ++node)
      add_shift(plan.tree.centers[node], system.goal_shift(plan.tree.states[std::size_t(node)]));
  }

  void run() {
    const double cpu_before = cpu_seconds();
    if (plan_.solved()) end(Ending::goal);
    {
      // Threads of our own: they wait for one another, which tasks of a pool must not, and ThreadSanitizer
      // sees them begin and end.
      std::vector<std::jthread> others;
      for (int t = 1; t < threads_; ++t) others.emplace_back([this] { work(); });
      work();
    }
    if (failure_) std::rethrow_exception(failure_);
    plan_.statistics.cpu_s += cpu_seconds() - cpu_before;
    plan_.statistics.wall_s += seconds_since(started_);
  }

 private:
  void work() try {
    const std::unique_ptr<Propagator> propagator = system_.make_propagator();
    std::vector<Expansion*> mine;
    std::vector<Rollout> rollouts;
    std::vector<State> starts;
    std::vector<Outcome> outcomes;
    std::unique_lock lock(mutex_);
    while (true) {
      commit_finished();
      look_at_limits();
      if (ended_) break;
      draw_ahead();
      take(mine, rollouts, starts);
      if (mine.empty()) {
        changed_.wait(lock);
        continue;
      }
      lock.unlock();
      propagator->propagate(rollouts);
      outcomes.clear();
      for (Rollout& rollout : rollouts) outcomes.push_back(outcome_of(system_, rollout));
      lock.lock();
      give_back(mine, outcomes);
      changed_.notify_all();
    }
    changed_.notify_all();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    ended_ = true;
    changed_.notify_all();
  }

  void draw_ahead() {
    while (int(queue_.size()) < window_ && next_iteration_ < settings_.max_iterations) {
      Expansion e;
      e.iteration = next_iteration_++;
      e.draw = draw(settings_, system_, e.iteration);
      e.point = e.draw.point.cast<float>();
      aim(e, nearest(e.draw.towards_goal ? centers_from_goal_ : plan_.tree.centers, e.point));
      queue_.push_back(std::move(e));
    }
  }

  void aim(Expansion& e, int node) const {
    e.near = node;
    e.near_distance2 = distance2(e, node);
    e.control = control_of(e.draw, settings_, plan_.tree.centers[node].cast<double>(),
                           goal_shifts_[std::size_t(node)]);
  }

  // A goal that moves is where it is at that node's time.
  float distance2(const Expansion& e, int node) const {
    return squared_distance(e.draw.towards_goal ? centers_from_goal_[node] : plan_.tree.centers[node],
                            e.point);
  }

  void add_shift(const Vec3f& center, const Vec3& goal_shift) {
    goal_shifts_.push_back(goal_shift);
    centers_from_goal_.push_back(center - goal_shift.cast<float>());
  }

  void take(std::vector<Expansion*>& mine, std::vector<Rollout>& rollouts, std::vector<State>& starts) {
    mine.clear();
    for (Expansion& e : queue_) {
      if (int(mine.size()) == share_) break;
      if (e.status == Expansion::waiting) mine.push_back(&e);
    }
    rollouts.resize(mine.size()), starts.resize(mine.size());
    for (std::size_t i = 0; i < mine.size(); ++i) {
      mine[i]->status = Expansion::running;
      starts[i] = plan_.tree.states[std::size_t(mine[i]->near)];
      rollouts[i].from = &starts[i];
      rollouts[i].control = mine[i]->control;
    }
  }

  void give_back(const std::vector<Expansion*>& mine, std::vector<Outcome>& outcomes) {
    plan_.statistics.rollouts += std::int64_t(mine.size());
    for (std::size_t i = 0; i < mine.size(); ++i) {
      Expansion& e = *mine[i];
      e.outcome = std::move(outcomes[i]);
      e.status = Expansion::finished;
      if (e.overtaken) compute_again(e);
    }
  }

  void compute_again(Expansion& e) {
    ++plan_.statistics.rollouts_wrong;
    e.overtaken = false;
    e.status = Expansion::waiting;
  }

  void commit_finished() {
    while (!ended_ && !queue_.empty() && queue_.front().status == Expansion::finished) {
      Expansion e = std::move(queue_.front());
      queue_.pop_front();
      commit(e);
    }
  }

  void commit(Expansion& e) {
    Statistics& statistics = plan_.statistics;
    ++statistics.iterations;
    statistics.rollout_steps += e.control.steps;
    statistics.diverged += e.outcome.kind == Outcome::diverged;
    statistics.rejected += e.outcome.kind == Outcome::rejected;
    if (e.outcome.kind == Outcome::node) {
      const int node = plan_.tree.add(std::move(e.outcome.state), e.near, e.control, e.iteration,
                                      e.outcome.center.cast<float>());
      add_shift(plan_.tree.centers[node], e.outcome.goal_shift);
      consider_for_goal(node, e.outcome.center - e.outcome.goal_shift);
      aim_overtaken(node);
    }
    progress_.update(statistics.iterations, fmt::format("{} nodes, {:.3g} m from the goal", plan_.tree.size(),
                                                        plan_.best_distance_m));
  }

  void consider_for_goal(int node, const Vec3& center) {  // as seen from the goal's start
    const double distance = (center - settings_.goal.center_of_mass_m).norm();
    const bool solves = distance <= settings_.goal.radius_m &&
                        comes_to_rest(system_, settings_, plan_.tree.states[std::size_t(node)]);
    if (!solves && distance >= plan_.best_distance_m) return;
    plan_.best_distance_m = distance;
    plan_.best_node = node;
    if (!solves) return;
    plan_.goal_node = node;
    end(Ending::goal);
  }

  void aim_overtaken(int node) {
    for (Expansion& e : queue_) {
      if (!(distance2(e, node) < e.near_distance2)) continue;  // the first of equals stays
      aim(e, node);
      if (e.status == Expansion::running) e.overtaken = true;
      if (e.status == Expansion::finished) compute_again(e);
    }
  }

  void look_at_limits() {
    if (ended_) return;
    if (plan_.statistics.iterations >= settings_.max_iterations) return end(Ending::iterations);
    if (stop_signal() != 0) return end(Ending::stopped);
    if (seconds_since(started_) >= settings_.time_limit_s) end(Ending::time);
  }

  void end(Ending ending) {
    plan_.ending = ending;
    ended_ = true;
  }

  const System& system_;
  const Settings& settings_;
  Plan& plan_;
  Progress progress_;
  int window_, threads_, share_;  // expansions in flight, threads, expansions a thread takes at once
  const Clock::time_point started_ = Clock::now();

  std::mutex mutex_;  // guards all below, and plan_ (states already in the tree are read without it)
  std::condition_variable changed_;
  Centers centers_from_goal_;      // of the tree's nodes, less the goal's shift there
  std::vector<Vec3> goal_shifts_;  // of the tree's nodes
  std::deque<Expansion>
      queue_;  // in order of iteration; a deque, so that pointers to the taken ones stay good
  std::int64_t next_iteration_ = 0;
  bool ended_ = false;
  std::exception_ptr failure_;  // the first
};

Plan begin(const System& system, const Settings& settings) {
  Plan plan;
  plan.system_hash = system.hash();
  const State start = system.start();
  const Vec3 center = system.robot_center(start);
  LIMBER_CHECK(center.allFinite(), center.x(), center.y(), center.z());
  plan.tree.add(start, -1, Control{}, -1, center.cast<float>());
  plan.best_distance_m = (center - settings.goal.center_of_mass_m).norm();
  if (plan.best_distance_m <= settings.goal.radius_m && comes_to_rest(system, settings, start))
    plan.goal_node = 0;
  return plan;
}

void require_same_search(const System& system, const Settings& settings, const Plan& earlier) {
  if (earlier.system_hash != system.hash())
    throw InputError(
        fmt::format("the earlier plan is of another world (hash {}, now {}); plan anew, without resuming it",
                    hex(earlier.system_hash), hex(system.hash())));
  if (const std::string name = first_difference(earlier.settings, settings); !name.empty())
    throw InputError(fmt::format(
        "the earlier plan was made with another {}; plan anew, without resuming it, or set {} back", name,
        name));
}

}  // namespace

Plan plan(const System& system, const Settings& settings, std::optional<Plan> earlier) {
  validate(settings, system);
  if (earlier) require_same_search(system, settings, *earlier);
  Plan plan = earlier ? std::move(*earlier) : begin(system, settings);
  plan.settings = settings;
  Search(system, plan.settings, plan).run();
  plan.trajectory = trajectory_to(system, settings, plan.tree, plan.best_node, plan.solved());
  return plan;
}

std::string explain(const Plan& plan) {
  const Settings& s = plan.settings;
  const Statistics& statistics = plan.statistics;
  const std::string where =
      fmt::format("node {} of {}, {:.3g} m from the goal (radius {:.3g} m)", plan.best_node, plan.tree.size(),
                  plan.best_distance_m, s.goal.radius_m);
  if (plan.solved())
    return fmt::format("reached the goal after {} iterations: {}", statistics.iterations, where);
  std::string text =
      plan.best_distance_m <= s.goal.radius_m
          ? fmt::format("the robot got into the goal, but did not come to rest there within {:g} s: ",
                        s.settle.max_duration_s) +
                where + ". "
          : "no node reached the goal; the nearest is " + where + ". ";
  switch (plan.ending) {
    case Ending::goal:
      break;
    case Ending::iterations:
      text += fmt::format(
          "The limit of {} iterations ended the search; try a larger max_iterations, max_force_n or "
          "goal_bias.",
          s.max_iterations);
      break;
    case Ending::time:
      text += fmt::format(
          "The time limit of {:g} s ended the search after {} of {} iterations; resume it with a larger one.",
          s.time_limit_s, statistics.iterations, s.max_iterations);
      break;
    case Ending::stopped:
      text += fmt::format("A signal ended the search after {} of {} iterations; resume it to go on.",
                          statistics.iterations, s.max_iterations);
      break;
  }
  if (statistics.diverged + statistics.rejected > 0)
    text += fmt::format(" {} rollouts diverged and {} ended in states that are not acceptable.",
                        statistics.diverged, statistics.rejected);
  return text;
}

}  // namespace limber::plan
