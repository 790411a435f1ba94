// The search: Algorithm 1 of Rodriguez, Lien and Amato (ICRA 2006), a kinodynamic RRT (LaValle and Kuffner,
// IJRR 2001) over full states of robot and obstacles, computed ahead of itself. Method and measurements:
// docs/planning.md.
//
// An expansion is one iteration: a random point x, the node nearest to it, a control from there, a rollout.
// Only the choice of the node depends on the iterations before; what is drawn is a function of (seed,
// iteration). So expansions are drawn ahead, rolled out side by side in threads and lanes, and committed in
// order. There are two ways to do so:
//   without a lag, on speculation: a commit that adds a node nearer to a later x aims that expansion anew;
//   with a lag, by rule: expansion i knows the nodes of all before i − lag and no others, so none is in vain.
//
// What always holds: the tree, the counts of the algorithm and the trajectory are functions of system and
// settings, for any number of threads, lanes and expansions in flight. A search that was cut short has a
// prefix of the whole one's commits, and goes on from there to the same bytes.
#include "plan/detail/leg_search.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/job.h"
#include "core/progress.h"
#include "core/threads.h"
#include "plan/control_rollout.h"
#include "plan/frame_times.h"
#include "plan/node_selector.h"

namespace limber::plan::detail {

namespace {

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

constexpr int steps_between_looks = 64;  // where no law looks; only so that an end is soon noticed
constexpr double seconds_untold = 0.5;   // at most, of what goes on
constexpr double leads_away = 3;         // robot radii of free way that a guided rollout may lose

// What became of a rollout. Of a state that may be a node: the robot's centre of mass, and how far the goal
// has moved.
struct Outcome {
  enum Kind { node, diverged, rejected } kind = diverged;
  State state;
  Vec3 center = Vec3::Zero();
  Vec3 goal_shift = Vec3::Zero();
};

// Rejected: a state that is not acceptable (inverted tets, too large a change of volume, the goal lost …), or
// in which surfaces are too deep in one another. It counts as an iteration all the same.
Outcome outcome_of(const System& system, Rollout& rollout) {
  Outcome o;
  if (!rollout.ok) return o;
  const std::int64_t expected_step = rollout.from->step + rollout.control.steps;
  LIMBER_CHECK(rollout.to.step == expected_step, rollout.to.step, expected_step);
  o.center = system.robot_center(rollout.to);
  LIMBER_CHECK(o.center.allFinite(), o.center.x(), o.center.y(), o.center.z());
  o.goal_shift = system.goal_shift(rollout.to);
  o.kind = rollout.clear && system.acceptable(rollout.to) ? Outcome::node : Outcome::rejected;
  o.state = std::move(rollout.to);
  return o;
}

// One iteration of Algorithm 1, on its way: computed from the node that is nearest as far as is known. It
// waits, runs and is finished; one that is aimed anew waits again, or, where it runs, once it is given back.
struct Expansion : Rollout {
  std::int64_t iteration = 0;
  Sample sample;
  Selection aimed;  // where the next rollout starts; one that runs may have been aimed before
  State start;
  enum { waiting, running, finished } status = waiting;
  bool overtaken = false;  // while it ran, a nearer node was added
  Outcome outcome;
  // What was seen of it on its way.
  double min_to_go = 0;
  Vec3 seen_center = Vec3::Zero();
  int looks_at_rest = 0;
};

// The cost-to-go over a grid, where a share of the expansions is led by it (plan/guidance.h).
std::optional<Guidance> guidance_of(const System& system, const Settings& settings, const State& root) {
  if (settings.search_options.guidance == 0) return std::nullopt;
  return Guidance(system.workspace(), settings.goal.center_of_mass_m, settings.search_options.soft_price,
                  system.windings(root));
}

// Threads take expansions from one queue and commit them in its order. With a lag, an expansion is drawn when
// those that it knows are committed, and never changes. Without, expansions are drawn ahead on speculation:
// when a commit adds a node that is nearer to the point of a later expansion than the node that one started
// from, the later one is aimed anew. So, by induction over the commits, whatever is committed started where
// the sequential algorithm would have started it.
class Search {
 public:
  // `system` and `settings` are those of the plan's last leg; time counts from `started`.
  Search(const System& system, const Settings& settings, Plan& plan, const ProgressCallback& on_progress,
         Clock::time_point started)
      : system_(system),
        settings_(settings),
        search_options_(settings.search_options),
        plan_(plan),
        on_progress_(on_progress),
        progress_("plan", settings.max_iterations),
        started_(started),
        frames_(system, settings.frames_per_second),
        guidance_(guidance_of(system, settings, plan.tree.states[std::size_t(plan.legs.back().root)])),
        selector_(system, settings, guidance_ ? &*guidance_ : nullptr, plan.legs.back().root),
        next_iteration_(plan.legs.back().first_iteration),
        committed_(next_iteration_) {
    const int lanes = std::max(1, system.lanes()), threads = std::max(1, thread_count());
    // With single lanes a thread that waits to be committed needs a second expansion; a batch holds enough.
    const int automatic = threads == 1 ? lanes : threads * std::max(lanes, 2);
    window_ = settings.in_flight > 0 ? settings.in_flight : automatic;
    if (search_options_.lag > 0) window_ = search_options_.lag + 1;
    threads_ = std::min(threads, window_);
    share_ = std::min(lanes, (window_ + threads_ - 1) / threads_);
    look_every_ = search_options_.look_s > 0 ? steps_of(search_options_.look_s, system.dt_s()) : 0;
    restore();
  }

  // Runs until the goal, a limit, a stop signal or an exception in a thread ends the search. The exception is
  // thrown again here.
  void run() {
    if (plan_.solved()) end(Ending::goal);
    {
      // Threads of our own: they wait for one another, which tasks of a pool must not, and ThreadSanitizer
      // sees them begin and end.
      std::vector<std::jthread> others;
      for (int t = 1; t < threads_; ++t)
        others.emplace_back([this, job = current_job()] {
          const WorkingFor working(job);
          work();
        });
      work();
    }
    if (failure_) std::rethrow_exception(failure_);
    plan_.statistics = statistics_now();
  }

  // From the root of the leg to the node that ended this search in the goal, and its settle.
  std::optional<Trajectory> way() && { return std::move(way_); }

 private:
  // What one thread has in its lanes. Where the queue or the plan is touched, the mutex is held; questions
  // about a rollout on its way are answered without it, from the rollout and from what never changes.
  class Lanes final : public RolloutSource {
   public:
    explicit Lanes(Search& search) : search_(search) {}
    int at_once() const override { return search_.share_; }
    Rollout* next() override {
      const std::lock_guard lock(search_.mutex_);
      if (taken_ == search_.share_) return nullptr;
      Expansion* e = search_.take();
      taken_ += e != nullptr;
      took_any_ = took_any_ || e;
      return e;
    }
    bool goes_on(const Rollout& rollout, const Observation& look) override {
      // No lane but this thread's touches the rollout.
      return search_.goes_on(const_cast<Expansion&>(static_cast<const Expansion&>(rollout)), look);
    }
    std::int64_t next_shown(std::int64_t step) const override { return search_.frames_.next_step(step); }
    bool goes_on(const Rollout& rollout, const State& state) override {
      return rollout.clear && search_.system_.acceptable(state);
    }
    void done(Rollout& rollout) override {
      Outcome outcome = outcome_of(search_.system_, rollout);
      const std::lock_guard lock(search_.mutex_);
      --taken_;
      search_.give_back(static_cast<Expansion&>(rollout), std::move(outcome));
    }
    bool wanted() override {
      if (stop_signal() != 0 || search_.is_long_untold()) {
        const std::lock_guard lock(search_.mutex_);
        search_.look_at_limits();
        search_.tell_progress();
      }
      return !search_.ended_;
    }
    bool took_any() { return std::exchange(took_any_, false); }

   private:
    Search& search_;
    int taken_ = 0;
    bool took_any_ = false;
  };

  // One thread's work: its lanes are filled as long as there is something to take. What it throws ends the
  // search.
  void work() try {
    const std::unique_ptr<Propagator> propagator = system_.make_propagator();
    Lanes lanes(*this);
    while (!ended_) {
      propagator->run(lanes, look_every_ > 0 ? look_every_ : steps_between_looks);
      std::unique_lock lock(mutex_);
      if (ended_ || lanes.took_any()) continue;
      // Nothing to take: others are at work on what must be committed first.
      changed_.wait(lock, [this] { return ended_ || any_waiting(); });
    }
    changed_.notify_all();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    ended_ = true;
    changed_.notify_all();
  }

  // With the mutex, as all below save goes_on().
  bool any_waiting() const {
    return std::any_of(queue_.begin(), queue_.end(),
                       [](const Expansion& e) { return e.status == Expansion::waiting; });
  }

  // The first that waits, in order of iteration, for it is committed first. The state that it starts from is
  // put together here, and its own: the rollout then needs neither mutex nor tree.
  Expansion* take() {
    look_at_limits();
    if (ended_) return nullptr;
    for (Expansion& e : queue_) {
      if (e.status != Expansion::waiting) continue;
      e.status = Expansion::running;
      e.start = plan_.tree.states[std::size_t(e.aimed.node)];
      e.from = &e.start;
      e.control = e.aimed.control;
      e.looks_at_rest = 0;
      e.seen_center = plan_.tree.centers[e.aimed.node].cast<double>();
      e.min_to_go = std::numeric_limits<double>::infinity();
      return &e;
    }
    return nullptr;
  }

  // A rollout that was overtaken while it ran was in vain. All that is finished at the head of the queue is
  // committed.
  void give_back(Expansion& e, Outcome outcome) {
    ++plan_.statistics.rollouts;
    e.outcome = std::move(outcome);
    e.status = Expansion::finished;
    if (e.overtaken) compute_again(e);
    commit_finished();
    look_at_limits();
    changed_.notify_all();
  }

  // Whether a rollout goes on after a look (docs/planning.md, "Looks"). It ends where the goal is lost; with
  // stop_in_goal, in the goal; with end_hopeless, where the robot stood still in two looks on end, or where a
  // guided one is farther from the goal than it was at its nearest, by more than `leads_away` radii of free
  // way. The state in which it ends becomes a node. A function of the rollout and of what was seen of it,
  // save when nobody wants the result any more.
  bool goes_on(Expansion& e, const Observation& look) const {
    if (ended_ || look.lost) return false;
    if (look_every_ == 0) return true;
    const Vec3 place = look.center - look.goal_shift;
    if (search_options_.stop_in_goal && holds(settings_.goal, place)) return false;
    if (!search_options_.end_hopeless) return true;
    // It should move (slow in one look alone, it turns round) and, where it is guided, come nearer.
    const double moved = (look.center - e.seen_center).norm();
    e.seen_center = look.center;
    e.looks_at_rest =
        moved < settings_.settle.mean_speed_m_s * search_options_.look_s ? e.looks_at_rest + 1 : 0;
    if (e.looks_at_rest == 2) return false;
    if (!e.sample.guided) return true;
    const double to_go = guidance_->to_go(place, look.windings);
    e.min_to_go = std::min(e.min_to_go, to_go);
    return to_go <= e.min_to_go + leads_away * guidance_->workspace().robot_radius_m;
  }

  // Expansions are drawn in order. With a lag each is drawn when all that it may know is committed, and no
  // more, so that it never changes; without, as many as the window holds, against the tree as it is.
  void draw_ahead() {
    while (next_iteration_ < settings_.max_iterations &&
           (search_options_.lag > 0 ? next_iteration_ <= committed_ + search_options_.lag
                                    : int(queue_.size()) < window_)) {
      const std::int64_t iteration = next_iteration_++;
      if (iteration < plan_.statistics.iterations) continue;  // of the earlier plan
      Expansion& e = queue_.emplace_back();
      e.iteration = iteration;
      e.sample = draw_sample(settings_, system_, iteration);
      e.aimed = selector_.choose(e.sample);
    }
  }

  // Goes through the earlier plan's commits again, so that each expansion that was on its way is drawn as it
  // was. An iteration without a node in the tree grew none. Which ways were refused is not stored, so each is
  // asked again; the answers are the same.
  void restore() try {
    int node = plan_.legs.back().root;
    for (selector_.add(plan_.tree, node++);; ++committed_) {
      if (search_options_.lag > 0) draw_ahead();
      if (committed_ == plan_.statistics.iterations) break;
      if (node == plan_.tree.size() || plan_.tree.iterations[std::size_t(node)] != committed_) continue;
      selector_.add(plan_.tree, node);
      if (!plan_.solved()) {
        const State state = plan_.tree.states[std::size_t(node)];
        const Arrival arrival = arrival_of(state, place_of(state), plan_.tree.parents[std::size_t(node)],
                                           plan_.tree.controls[std::size_t(node)]);
        if (arrival.kind == Arrival::refused) refuse(arrival, node);
      }
      ++node;
    }
    next_iteration_ = std::max(next_iteration_, committed_);
    draw_ahead();
  } catch (const Interrupted&) {
    end(Ending::stopped);  // and the plan is as it was
  }

  // What was computed is thrown away; the expansion waits for a rollout from the node at which it is aimed
  // now.
  void compute_again(Expansion& e) {
    ++plan_.statistics.rollouts_wrong;
    e.overtaken = false;
    e.status = Expansion::waiting;
  }

  void commit_finished() {
    while (!ended_ && !queue_.empty() && queue_.front().status == Expansion::finished) {
      const Expansion e = std::move(queue_.front());
      queue_.pop_front();
      commit(e);
      if (!ended_) draw_ahead();
    }
  }

  // One iteration of the sequential algorithm: it is counted, and its state becomes a node, unless it was
  // rejected or the node that it grew from was refused meanwhile. Whether the new node solves is found first:
  // that may be interrupted, and then the iteration counts as not done.
  void commit(const Expansion& e) {
    const bool grows = e.outcome.kind == Outcome::node && !selector_.refused(e.aimed.node);
    const Vec3 place = e.outcome.center - e.outcome.goal_shift;
    Arrival arrival;
    try {
      if (grows) arrival = arrival_of(e.outcome.state, place, e.aimed.node, e.control);
    } catch (const Interrupted&) {
      return end(Ending::stopped);  // who resumes computes it again
    }
    Statistics& statistics = plan_.statistics;
    ++committed_;
    ++statistics.iterations;
    statistics.rollout_steps += e.control.steps;
    statistics.diverged += e.outcome.kind == Outcome::diverged;
    statistics.rejected += e.outcome.kind != Outcome::diverged && !grows;
    if (grows) {
      const int node = plan_.tree.add(e.outcome.state, e.aimed.node, e.control, e.iteration,
                                      e.outcome.center.cast<float>());
      selector_.add(plan_.tree, node);
      if (arrival.kind == Arrival::refused) {
        ++statistics.refused, statistics.last_refusal = arrival.why;
        refuse(arrival, node);
        choose_again();
      } else {
        consider(node, distance_at(place), arrival.kind == Arrival::rests);
        if (arrival.kind == Arrival::rests) way_ = std::move(arrival.way);
      }
      if (search_options_.lag == 0) aim_overtaken(node);
    }
    tell_progress();
    if (on_progress_) on_progress_({statistics_now(), plan_.leg(), plan_.tree.size(), plan_.best_distance_m});
  }

  // Rollouts among thirty organs take minutes, and the first are done all at once: until then the line says
  // that they are on their way. Asked without the mutex.
  bool is_long_untold() const { return seconds_since(started_) - told_at_s_ > seconds_untold; }
  void tell_progress() {
    told_at_s_ = seconds_since(started_);
    const std::int64_t done = plan_.statistics.iterations - iterations_before_;
    const double seconds = seconds_since(leg_started_), a_second = double(done) / seconds;
    const auto running = std::count_if(queue_.begin(), queue_.end(),
                                       [](const Expansion& e) { return e.status == Expansion::running; });
    progress_.update(
        plan_.statistics.iterations,
        fmt::format("{} nodes, {:.3g} m from the goal, {}", plan_.tree.size(), plan_.best_distance_m,
                    a_second >= 1 ? fmt::format("{:.0f} a second", a_second)
                                  : fmt::format("{} on their way, {:.0f} s", running, seconds)));
  }

  Statistics statistics_now() const {
    Statistics now = plan_.statistics;
    now.cpu_s += cpu_seconds() - cpu_before_;
    now.wall_s += seconds_since(leg_started_);
    return now;
  }

  // What a new node would be to the goal.
  struct Arrival {
    enum { elsewhere, rests, refused } kind = elsewhere;
    int edges_before = 0;  // refused: from the root of the leg to the edge that leads into the refused frame
    std::string why = {};
    Trajectory way = {};  // rests: from the root of the leg, and the settle
  };

  Vec3 place_of(const State& state) const {  // as seen from the goal's start
    return system_.robot_center(state) - system_.goal_shift(state);
  }
  double distance_at(const Vec3& place) const { return (place - settings_.goal.center_of_mass_m).norm(); }

  // Of the state to which `control` leads from `parent`, at `place`. Throws Interrupted.
  // A node solves the leg where three things hold: it lies in the goal, the robot comes to rest there, and
  // every frame of the way from the leg's root, rest included, may be shown (System::first_refused, too dear
  // to ask of every state). The way's edges are run again, now with their frames; each must end in the tree's
  // next state to the bit.
  Arrival arrival_of(const State& state, const Vec3& place, int parent, const Control& control) const {
    if (!holds(settings_.goal, place)) return {};
    ControlRollout settle;
    settle.from = state;
    plan::run(system_, settings_, {&settle, 1}, {.keep_frames = true, .stoppable = true});
    if (settle.result != ControlRollout::rests_in_goal) return {};
    const Tree& tree = plan_.tree;
    const int root = plan_.legs.back().root;
    std::vector<int> path;  // from the root to the parent
    for (int node = parent; node != root; node = tree.parents[std::size_t(node)]) path.push_back(node);
    path.push_back(root);
    std::reverse(path.begin(), path.end());
    // Edges begin in states that are known, so all are run side by side.
    std::vector<ControlRollout> edges(path.size());
    for (std::size_t i = 0; i < path.size(); ++i) {
      edges[i].from = tree.states[std::size_t(path[i])];
      edges[i].controls = {i + 1 < path.size() ? tree.controls[std::size_t(path[i + 1])] : control};
    }
    plan::run(system_, settings_, edges,
              {.settle = ControlRolloutOptions::never,
               .keep_frames = true,
               .ask_acceptable = false,
               .stoppable = true});
    Trajectory whole{{}, settle.settle_steps, settings_.frames_per_second, {}, std::move(settle.end)};
    const auto append = [&](std::vector<State>& frames, std::int64_t after_step) {
      for (State& frame : frames)
        if (frame.step > after_step) whole.frames.push_back(std::move(frame));
    };
    whole.frames = std::move(edges[0].frames);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      LIMBER_CHECK(edges[i].end == (i + 1 < path.size() ? edges[i + 1].from : state), i, edges[i].end.step);
      whole.controls.push_back(edges[i].controls[0]);
      if (i > 0) append(edges[i].frames, edges[i].from.step);
    }
    if (settle.settle_steps > 0) whole.controls.push_back(settle_control(settings_, settle.settle_steps));
    append(settle.frames, state.step);
    // The root's own frame is of the leg before.
    const auto own = std::find_if(whole.frames.begin(), whole.frames.end(),
                                  [&](const State& frame) { return frame.step > edges[0].from.step; });
    const std::span<const State> frames(own, whole.frames.end());
    const std::size_t first = system_.first_refused(frames);
    if (first == frames.size()) return {Arrival::rests, 0, {}, std::move(whole)};
    const auto there = std::find_if(edges.begin(), edges.end() - 1, [&](const ControlRollout& edge) {
      return edge.end.step >= frames[first].step;
    });
    return {Arrival::refused, int(there - edges.begin()), system_.why_refused(frames[first]), {}};
  }

  // Nothing grows any more from the way to `node` after so many edges: neither from the node behind the edge
  // that leads into the refused frame nor from any below it, whose numbers are higher than their parents'.
  // The good part of the way is kept, and the search cannot stay in what is spoiled.
  void refuse(const Arrival& arrival, int node) {
    const std::vector<int> path = path_to(plan_.tree, node);
    const auto root = std::find(path.begin(), path.end(), plan_.legs.back().root);
    const int first = root[arrival.edges_before + 1];
    for (int n = first; n <= node; ++n)
      if (!selector_.refused(n) && (n == first || selector_.refused(plan_.tree.parents[std::size_t(n)])))
        selector_.refuse(n);
  }

  // What was aimed at, or the best, may have been refused. With a lag, what was drawn stays as it was drawn,
  // and is rejected when it is committed.
  void choose_again() {
    if (selector_.refused(plan_.best_node)) {
      plan_.best_distance_m = std::numeric_limits<double>::infinity();
      for (int n = plan_.legs.back().root; n < plan_.tree.size(); ++n)
        if (!selector_.refused(n))
          consider(n, distance_at(place_of(plan_.tree.states[std::size_t(n)])), false);
    }
    for (Expansion& e : queue_) {
      if (search_options_.lag > 0 || !selector_.refused(e.aimed.node)) continue;
      e.aimed = selector_.choose(e.sample);
      aimed_anew(e);
    }
  }

  // The nearest to the goal is the best, the first of equals; one that solves is the best whatever its
  // distance.
  void consider(int node, double distance, bool solves) {
    if (!solves && distance >= plan_.best_distance_m) return;
    plan_.best_distance_m = distance;
    plan_.best_node = node;
    if (!solves) return;
    plan_.goal_node = node;
    end(Ending::goal);
  }

  // Each expansion on its way to whose point the new node is strictly nearer starts from that node instead.
  void aim_overtaken(int node) {
    for (Expansion& e : queue_) {
      if (!(selector_.cost(e.sample, node) < e.aimed.cost)) continue;  // the first of equals stays
      e.aimed = selector_.aim(e.sample, node);
      aimed_anew(e);
    }
  }

  // One that still waits needs nothing more: its rollout has not begun.
  void aimed_anew(Expansion& e) {
    if (e.status == Expansion::running) e.overtaken = true;
    if (e.status == Expansion::finished) compute_again(e);
  }

  // Iterations first: a search that has done all of them is not told to have been stopped.
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
  const SearchOptions& search_options_;
  Plan& plan_;
  const ProgressCallback& on_progress_;
  Progress progress_;
  int window_, threads_, share_;  // expansions in flight, threads, expansions a thread has in its lanes
  int look_every_;                // steps; 0: laws do not look
  const Clock::time_point started_, leg_started_ = Clock::now();
  const double cpu_before_ = cpu_seconds();
  const std::int64_t iterations_before_ = plan_.statistics.iterations;

  const FrameTimes frames_;
  const std::optional<Guidance> guidance_;  // as the search begins; prices are learnt in the selector's copy

  std::atomic<bool> ended_ = false;
  std::atomic<double> told_at_s_ = 0;  // since started_
  std::mutex mutex_;  // guards all below, and plan_ (states already in the tree are read without it)
  std::condition_variable changed_;
  NodeSelector selector_;
  std::deque<Expansion>
      queue_;  // in order of iteration; a deque, so that pointers to the taken ones stay good
  std::int64_t next_iteration_, committed_;
  std::exception_ptr failure_;  // the first
  std::optional<Trajectory> way_;
};

}  // namespace

std::optional<Trajectory> search_leg(const System& system, const Settings& settings, Plan& plan,
                                     const ProgressCallback& on_progress, Clock::time_point started) {
  Search search(system, settings, plan, on_progress, started);
  search.run();
  return std::move(search).way();
}

}  // namespace limber::plan::detail
