#include "limber/detail/world/fem_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/threads.h"
#include "fem/batch.h"
#include "fem/observe.h"
#include "limber/detail/world/workspace.h"
#include "scenes/models.h"

namespace limber::detail {

namespace {

constexpr int preferred_lanes = 16;
// Goes up where the laws of motion or of what a search refuses change: plans made before are of another
// world.
constexpr int edition = 4;
// The same of contact on fine surfaces alone, and of contact between cages alone.
constexpr int surface_edition = 2, cage_edition = 1;
constexpr int widths[] = {1, 4, 8, 16};

// Nothing where nothing happens by itself.
void add_script(const fem::World& world, Hasher& hasher) {
  for (const fem::Force& force : world.forces) {
    hasher.text("force").value(force.body).value(force.first_step).value(force.end_step);
    hasher.matrix(force.force_n).value(force.mass_kg);
    for (const int n : force.nodes) hasher.value(n);
  }
  for (const fem::Pressure& pressure : world.pressures)
    hasher.text("pressure")
        .value(pressure.body)
        .value(pressure.first_step)
        .value(pressure.end_step)
        .value(pressure.pressure_pa);
  for (const fem::Ligament& ligament : world.ligaments) {
    hasher.text("ligament").value(ligament.stiffness_n_m).value(ligament.damping_n_s_m);
    hasher.value(ligament.rest_length_m).value(int(ligament.pushes));
    for (const fem::Ligament::End& end : ligament.ends) {
      hasher.value(end.body);
      if (end.body < 0) hasher.matrix(end.point_m);
      for (const int node : end.nodes) hasher.value(node);
      for (const double weight : end.weights) hasher.value(weight);
    }
  }
  for (const fem::Body& body : world.bodies) {
    if (!body.velocity_m_s.isZero(0) || !body.angular_velocity_rad_s.isZero(0))
      hasher.text("velocity").text(body.name).matrix(body.velocity_m_s).matrix(body.angular_velocity_rad_s);
    if (body.track.keyframes.empty()) continue;
    hasher.text("track").text(body.name).matrix(body.track.pivot_m);
    for (const fem::Keyframe& k : body.track.keyframes)
      hasher.value(k.at_s).matrix(k.position_m).matrix(k.turn_rad);
  }
}

std::uint64_t hash_of_world(const fem::World& world) {
  Hasher hasher;
  hasher.text("edition").value(edition);
  hasher.value(world.robot).matrix(world.bounds_m.lower).matrix(world.bounds_m.upper).value(int(world.walls));
  hasher.matrix(world.goal_shape_m);
  const Vec3 gravity_m_s2 = world.bodies[std::size_t(world.robot)].gravity_m_s2;
  hasher.matrix(gravity_m_s2).value(world.dt_s).value(world.contact_dt_s).value(world.rest_speed_m_s);
  if (world.substeps > 1) hasher.text("substeps").value(world.substeps);
  if (world.touches_on_surfaces())
    hasher.text("surfaces").value(surface_edition);
  else
    hasher.text("cages").value(cage_edition);
  for (const double offset : world.surfaces64.offset) hasher.value(offset);
  for (const double offset : world.surfaces64.own_offset) hasher.value(offset);
  if (!world.part_overlaps) hasher.text("overlaps are refused");
  if (std::isfinite(world.max_overlap_m)) hasher.value(world.max_overlap_m);
  if (!world.parting.pairs.empty())
    for (const float x : world.start_positions) hasher.value(x);
  for (const fem::Body& body : world.bodies) {
    const fem::Material& m = body.material;
    hasher.value(limber::hash_of(body.cage))
        .value(int(m.model))
        .value(int(body.moving))
        .value(int(body.kind))
        .value(int(body.self_contact))
        .value(int(body.phong));
    for (const double v : {m.youngs_modulus_pa, m.poisson_ratio, m.density_kg_m3, m.damping_ratio, m.friction,
                           body.stiffness_share, body.max_volume_change, body.max_stretch})
      hasher.value(v);
    for (const auto* of_tets : {&body.youngs_modulus_from_tet_pa, &body.density_from_tet_kg_m3})
      for (const double v : *of_tets) hasher.value(v);
    if (std::isfinite(body.max_contact_load_n)) hasher.text("contact load").value(body.max_contact_load_n);
    if (m.mass_damping_per_s != 0) hasher.text("mass damping").value(m.mass_damping_per_s);
    if (m.fascia_hz > 0) hasher.text("fascia").value(m.fascia_hz).value(m.fascia_damping_ratio);
    if (body.gravity_m_s2 != gravity_m_s2) hasher.text("gravity").matrix(body.gravity_m_s2);
    for (const bool fixed : body.fixed) hasher.value(int(fixed));
    if (body.shape) hasher.value(limber::hash_of(*body.shape));
  }
  add_script(world, hasher);
  return hasher.digest();
}

// The shortest way along edges, at rest, to `end` from the node that is farthest from it.
std::vector<int> strand_to(const TetMesh& cage, int end) {
  std::vector<std::vector<int>> neighbours(std::size_t(cage.positions.rows()));
  for (Eigen::Index t = 0; t < cage.tets.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        if (i != j) neighbours[std::size_t(cage.tets(t, i))].push_back(cage.tets(t, j));
  std::vector<double> way(neighbours.size(), std::numeric_limits<double>::infinity());
  std::vector<int> next(neighbours.size(), end);
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> open;
  way[std::size_t(end)] = 0;
  open.emplace(0, end);
  int last = end;
  while (!open.empty()) {
    const auto [length, node] = open.top();
    open.pop();
    if (length > way[std::size_t(node)]) continue;
    last = node;
    for (const int other : neighbours[std::size_t(node)]) {
      const double longer = length + (cage.positions.row(other) - cage.positions.row(node)).norm();
      if (longer >= way[std::size_t(other)]) continue;
      way[std::size_t(other)] = longer, next[std::size_t(other)] = node;
      open.emplace(longer, other);
    }
  }
  std::vector<int> strand;
  for (; last != end; last = next[std::size_t(last)]) strand.push_back(last);
  strand.push_back(end);
  return strand;
}

}  // namespace

// A hundredth of a second to some tenths, in the largest worlds.
constexpr std::int64_t steps_between_questions = 8;

class FemSystem::Propagator final : public plan::Propagator {
 public:
  explicit Propagator(const FemSystem& system) : system_(system) {}
  ~Propagator() override {
    const std::lock_guard lock(system_.mutex_);
    for (const auto& batch : batches_)
      if (batch) system_.cost_ += batch->cost();
  }

  void propagate(std::span<plan::Rollout> rollouts) override {
    work_.resize(rollouts.size());
    for (std::size_t i = 0; i < rollouts.size(); ++i)
      work_[i].start = rollouts[i].from, work_[i].control = rollouts[i].control;
    fem::propagate(batch_for(int(rollouts.size())), work_);
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      rollouts[i].ok = work_[i].outcome.status == fem::RunStatus::ok;
      rollouts[i].clear = work_[i].clear;
      rollouts[i].to = std::move(work_[i].end);
    }
  }

  void run(plan::RolloutSource& supply, int look_every) override {
    while (true) {
      std::vector<plan::Rollout*> first;
      const int lanes = std::min(supply.at_once(), preferred_lanes);
      while (int(first.size()) < lanes)
        if (plan::Rollout* rollout = supply.next())
          first.push_back(rollout);
        else
          break;
      if (first.empty()) return;
      run(batch_for(first.size() == 1 ? 1 : lanes), std::move(first), supply, look_every);
    }
  }

 private:
  void run(fem::Batch& batch, std::vector<plan::Rollout*> in_lane, plan::RolloutSource& supply,
           int look_every) {
    const auto load = [&](std::size_t lane) {
      batch.load(int(lane), *in_lane[lane]->from, in_lane[lane]->control);
    };
    in_lane.resize(std::size_t(batch.lanes()), nullptr);
    for (std::size_t lane = 0; lane < in_lane.size(); ++lane)
      if (in_lane[lane]) load(lane);
    const auto now = [&](std::size_t lane) {
      return in_lane[lane]->from->step + taken(batch, *in_lane[lane], lane);
    };
    std::vector<std::int64_t> shown(in_lane.size());  // the step at which the lane's state is, next
    for (bool any = true; any;) {
      std::int64_t steps = look_every;
      for (std::size_t lane = 0; lane < in_lane.size(); ++lane)
        if (in_lane[lane]) {
          shown[lane] = supply.next_shown(now(lane));
          steps = std::min({steps, look_every - taken(batch, *in_lane[lane], lane) % std::int64_t(look_every),
                            shown[lane] - now(lane), std::int64_t(batch.steps_left(int(lane)))});
        }
      for (std::int64_t done = 0; done < steps;) {
        done += batch.advance(int(std::min(steps - done, steps_between_questions)));
        if (!supply.wanted()) return give_back(batch, in_lane, supply);
      }
      for (std::size_t lane = 0; lane < in_lane.size(); ++lane) {
        if (!in_lane[lane]) continue;
        plan::Rollout& rollout = *in_lane[lane];
        const int steps_taken = taken(batch, rollout, lane);
        if (batch.steps_left(int(lane)) > 0) {
          if (goes_on(batch, int(lane), rollout, supply, steps_taken % look_every == 0,
                      now(lane) == shown[lane]))
            continue;
          batch.stop(int(lane));
          rollout.control.steps = steps_taken;
        }
        batch.store(int(lane), rollout.to);
        rollout.ok = batch.outcome(int(lane)).status == fem::RunStatus::ok;
        rollout.clear = !rollout.ok || batch.is_clear(int(lane));
        in_lane[lane] = nullptr;
        supply.done(rollout);
      }
      any = false;
      for (std::size_t lane = 0; lane < in_lane.size(); ++lane) {
        if (!in_lane[lane] && (in_lane[lane] = supply.next())) load(lane);
        any = any || in_lane[lane];
      }
    }
  }

  static void give_back(fem::Batch& batch, const std::vector<plan::Rollout*>& in_lane,
                        plan::RolloutSource& supply) {
    for (std::size_t lane = 0; lane < in_lane.size(); ++lane) {
      if (!in_lane[lane]) continue;
      batch.stop(int(lane));
      in_lane[lane]->ok = false;
      supply.done(*in_lane[lane]);
    }
  }

  bool goes_on(fem::Batch& batch, int lane, plan::Rollout& rollout, plan::RolloutSource& supply,
               bool look_due, bool state_due) {
    if (look_due) {
      const plan::Observation seen = look(batch, lane, rollout.control.steps - batch.steps_left(lane));
      // Numbers that are none stay so: it has diverged, and nobody need look.
      const bool finite = seen.center.allFinite() && seen.velocity.allFinite() && seen.goal_shift.allFinite();
      if (!finite || !supply.goes_on(rollout, seen)) return false;
    }
    if (!state_due) return true;
    batch.peek(lane, peeked_);
    rollout.clear = batch.is_clear(lane);
    return supply.goes_on(rollout, peeked_);
  }

  // The smallest that has so many lanes, if any: idle lanes cost as much as busy ones.
  fem::Batch& batch_for(int lanes) {
    const auto width = std::lower_bound(std::begin(widths), std::end(widths) - 1, lanes);
    auto& batch = batches_[std::size_t(width - std::begin(widths))];
    if (!batch) batch.emplace(system_.world_, *width);
    return *batch;
  }

  static int taken(const fem::Batch& batch, const plan::Rollout& rollout, std::size_t lane) {
    return rollout.control.steps - batch.steps_left(int(lane));
  }

  plan::Observation look(const fem::Batch& batch, int lane, int steps) {
    const fem::Batch::Motion robot = batch.motion(lane, system_.world_.robot);
    plan::Observation look{steps, robot.center_m, robot.velocity_m_s};
    if (!system_.lead_nodes_.empty()) {
      batch.peek(lane, peeked_);
      look.center = system_.robot_center(peeked_), look.velocity = system_.robot_velocity(peeked_);
      look.windings = system_.windings(peeked_);
    }
    if (system_.goal_.body >= 0)
      look.goal_shift = batch.motion(lane, system_.goal_.body).center_m - system_.goal_body_start_m_;
    if (const GoalRules& last = system_.last_->goal_; last.lost_below_m)
      look.lost = batch.motion(lane, last.body).lowest_m < *last.lost_below_m;
    return look;
  }

  const FemSystem& system_;
  std::array<std::optional<fem::Batch>, std::size(widths)> batches_;
  std::vector<fem::Rollout> work_;
  State peeked_;
};

FemSystem::FemSystem(const fem::World& world, const GoalRules& goal, std::optional<State> start)
    : FemSystem(world, goal, std::move(start), hash_of_world(world)) {}

FemSystem::FemSystem(const fem::World& world, const GoalRules& goal, std::optional<State> start,
                     std::uint64_t hash_of_world)
    : world_(world),
      given_start_(std::move(start)),
      goal_(goal),
      goal_body_start_m_(Vec3::Zero()),
      limits_contact_(
          std::any_of(world.bodies.begin(), world.bodies.end(),
                      [](const fem::Body& body) { return std::isfinite(body.max_contact_load_n); })),
      hash_(hash_of_world) {
  if (goal.body >= 0) goal_body_start_m_ = fem::center_of_mass_m(world, fem::start_state(world), goal.body);
  Hasher hasher;
  hasher.value(hash_);
  for (const int body : {goal.body, goal.above, goal.below, goal.clear_of}) hasher.value(body);
  for (const auto& rule : {goal.lost_below_m, goal.turn_tolerance_deg, goal.shape_tolerance_m})
    hasher.value(int(rule.has_value())).value(rule.value_or(0));
  if (goal.half_turn) hasher.text("half turn").matrix(*goal.half_turn);
  for (const auto& [ring, pieces] : goal.through) hasher.text("through").value(ring).value(pieces);
  if (goal.volume > 0) hasher.text("volume").value(goal.volume);
  if (!goal.patches_m.empty()) find_patches(), hasher.text("patches").value(int(goal.lead));
  if (goal.carry) hasher.text("carry");
  // A search of before these were known grew another tree.
  if (robot_drag_per_s() > 0) hasher.text("steered by drag");
  if (!holes_.empty()) hasher.text("guided by windings");
  for (const Box& patch : goal.patches_m) hasher.matrix(patch.lower).matrix(patch.upper);
  for (GoalRules rules : goal.via) {
    rules.patches_m = goal.patches_m, rules.lead = goal.lead, rules.carry = goal.carry;
    via_.push_back(std::unique_ptr<FemSystem>(new FemSystem(world, rules, given_start_, hash_of_world)));
    via_.back()->last_ = this;
    hasher.value(via_.back()->hash());
  }
  if (given_start_) hasher.value(limber::hash_of(*given_start_));
  hash_ = hasher.digest();
}

FemSystem::FemSystem(const fem::World& world, const std::vector<PreparedBody>& bodies, const GoalRules& goal,
                     std::optional<State> start)
    : FemSystem(world, goal, std::move(start)) {
  surfaces_ = std::make_shared<const Surfaces>(world, bodies);
  surface_size_m_ = bounding_box(bodies[std::size_t(world.robot)].surface.positions).size().maxCoeff();
  for (const auto& via : via_) via->surfaces_ = surfaces_, via->surface_size_m_ = surface_size_m_;
}

State FemSystem::start() const { return given_start_ ? *given_start_ : fem::start_state(world_); }
void FemSystem::find_patches() {
  const fem::Body& robot = world_.bodies[std::size_t(world_.robot)];
  const auto free_in = [&](const Box& patch) {
    std::vector<int> nodes = scenes::nodes_in(patch, world_.bounds_m, robot.cage.positions);
    std::erase_if(nodes, [&](int n) { return robot.fixed[std::size_t(n)]; });
    LIMBER_CHECK(!nodes.empty(), robot.name);  // build_world has looked
    return nodes;
  };
  for (const Box& patch : goal_.patches_m) {
    const auto to_middle = [&](int n) {
      return (robot.cage.positions.row(n).transpose() - patch.center()).squaredNorm();
    };
    const std::vector<int> nodes = free_in(patch);
    patch_nodes_.push_back(*std::min_element(nodes.begin(), nodes.end(),
                                             [&](int a, int b) { return to_middle(a) < to_middle(b); }));
  }
  if (goal_.carry) {
    carriers_.emplace();
    carriers_->weight_n = robot.mass_kg * robot.gravity_m_s2;
    for (std::size_t i = 0; i < 2; ++i) {
      carriers_->nodes[i] = patch_nodes_[i];
      carriers_->goals[i] = world_.goal_shape_m.row(patch_nodes_[i]).transpose();
    }
  }
  if (!goal_.lead) return;
  lead_nodes_ = free_in(goal_.patches_m[0]);
  for (const int n : lead_nodes_) lead_mass_kg_ += robot.node_mass_kg[std::size_t(n)];
  if (goal_.through.empty()) return;
  strand_ = strand_to(robot.cage, patch_nodes_[0]);
  const State begins = fem::start_state(world_);
  for (const auto& [ring, pieces] : goal_.through) {
    const fem::Hole hole = fem::hole_of(world_, begins, ring);
    holes_.push_back({hole.middle_m, hole.normal, hole.radius_m, pieces});
  }
}
// A ring that moves takes its hole along, but a guidance that knows the holes of the start only would go
// wrong: those are looked at where they were.
plan::Windings FemSystem::windings(const State& state) const {
  plan::Windings windings;
  if (strand_.empty()) return windings;
  Vec3 last = node_place(state, strand_[0]).place;
  const auto on_to = [&](const Vec3& next) { plan::wind(windings, holes_, last, next), last = next; };
  for (const int node : strand_) on_to(node_place(state, node).place);
  on_to(robot_center(state));
  return windings;
}
// Of the nodes that lead, the mean of what the state has of each, by their masses.
Vec3 FemSystem::mean_of_lead(const std::vector<float>& of_nodes) const {
  const fem::Body& robot = world_.bodies[std::size_t(world_.robot)];
  Vec3 sum = Vec3::Zero();
  for (const int n : lead_nodes_)
    sum += robot.node_mass_kg[std::size_t(n)] *
           Eigen::Map<const Vec3f>(&of_nodes[3 * std::size_t(robot.first_node + n)]).cast<double>();
  return sum / lead_mass_kg_;
}
Vec3 FemSystem::robot_center(const State& state) const {
  if (!lead_nodes_.empty()) return mean_of_lead(state.positions);
  return fem::center_of_mass_m(world_, state, world_.robot);
}
Vec3 FemSystem::robot_velocity(const State& state) const {
  if (!lead_nodes_.empty()) return mean_of_lead(state.velocities);
  return fem::center_velocity_m_s(world_, state, world_.robot);
}
double FemSystem::robot_mass_kg() const { return world_.bodies[std::size_t(world_.robot)].mass_kg; }
double FemSystem::robot_drag_per_s() const {
  return world_.bodies[std::size_t(world_.robot)].material.mass_damping_per_s;
}
double FemSystem::mean_speed(const State& state) const {
  return fem::mean_speed_m_s(world_, state, world_.robot);
}
int FemSystem::robot_nodes() const { return world_.bodies[std::size_t(world_.robot)].node_count(); }
int FemSystem::control_node(int drawn) const {
  return patch_nodes_.empty() ? drawn : patch_nodes_[std::size_t(drawn) % patch_nodes_.size()];
}
plan::NodePlace FemSystem::node_place(const State& state, int robot_node) const {
  const std::size_t at = 3 * std::size_t(world_.bodies[std::size_t(world_.robot)].first_node + robot_node);
  return {Eigen::Map<const Vec3f>(&state.positions[at]).cast<double>(),
          Eigen::Map<const Vec3f>(&state.velocities[at]).cast<double>()};
}
Box FemSystem::sample_bounds() const { return world_.bounds_m; }
double FemSystem::dt_s() const { return world_.dt_s; }
std::uint64_t FemSystem::hash() const { return hash_; }
bool FemSystem::acceptable(const State& state) const {
  return !loses_goal(state) && fem::is_sound(world_, state) && bears_contact(state);
}
bool FemSystem::loses_goal(const State& state) const {
  const GoalRules& last = last_->goal_;
  if (!last.lost_below_m) return false;
  const fem::Body& body = world_.bodies[std::size_t(last.body)];
  for (int n = body.first_node; body.moving && n < body.first_node + body.node_count(); ++n)
    if (double(state.positions[std::size_t(3 * n + 2)]) < *last.lost_below_m) return true;
  return false;
}
std::string FemSystem::why_not_acceptable(const State& state) const {
  if (loses_goal(state)) return "the goal is lost (goal.lost_below_m)";
  const fem::Fault fault = fem::fault_of(world_, state);
  const auto name = [&] { return world_.bodies[std::size_t(fault.body)].name; };
  switch (fault.kind) {
    case fem::Fault::inverted:
      return fmt::format("a tet of {} is inverted", name());
    case fem::Fault::stretched:
      return fmt::format("a tet of {} is stretched beyond its max_stretch", name());
    case fem::Fault::volume:
      return fmt::format("the volume of {} has changed by more than its max_volume_change", name());
    case fem::Fault::none:
      break;
  }
  return bears_contact(state) ? "" : "a body is pressed by more than its max_contact_load_n";
}
// Probes are dear to make and belong to one thread at a time, so they are lent.
bool FemSystem::bears_contact(const State& state) const {
  const FemSystem& owner = *last_;
  if (!owner.limits_contact_) return true;
  std::unique_ptr<fem::ContactProbe> probe;
  {
    const std::lock_guard lock(owner.mutex_);
    if (!owner.probes_.empty()) probe = std::move(owner.probes_.back()), owner.probes_.pop_back();
  }
  if (!probe) probe = std::make_unique<fem::ContactProbe>(world_);
  const bool bears = fem::within_contact_loads(world_, probe->forces(state));
  const std::lock_guard lock(owner.mutex_);
  owner.probes_.push_back(std::move(probe));
  return bears;
}
std::size_t FemSystem::first_refused(std::span<const State> frames) const {
  if (!surfaces_) return frames.size();
  const SeenLimits limits;
  const bool on_surfaces = world_.touches_on_surfaces();
  const double deepest_m = largest_cage_penetration_m(world_);
  const std::size_t at_once = 8 * std::size_t(thread_count());
  std::vector<SeenFrame> seen(on_surfaces ? frames.size() : 0);
  std::vector<char> overlaps(frames.size());
  const auto look_at = [&](std::size_t f) {
    if (!on_surfaces) {
      overlaps[f] = fem::deepest_penetration(world_, frames[f]).depth_m > deepest_m;
      return;
    }
    seen[f] = surfaces_->at(frames[f]);
    overlaps[f] = seen[f].overlap_m > limits.overlap * surface_size_m_ ||
                  seen[f].self_overlap_m > limits.self_overlap * surface_size_m_;
  };
  for (std::size_t from = 0; from < frames.size(); from += at_once) {
    const std::size_t to = std::min(from + at_once, frames.size());
    parallel_for(int(to - from), [&](int i) {
      throw_if_stopped();
      look_at(from + std::size_t(i));
    });
    for (std::size_t f = from; f < to; ++f)
      if (overlaps[f]) return f;
  }
  if (!on_surfaces) return frames.size();
  // Of one leg alone: what presses in a motion of several does so in its own leg, too.
  keep_what_presses(seen);
  const auto gapes = [&](const SeenFrame& frame) {
    return std::any_of(frame.gaps.begin(), frame.gaps.end(), [&](const SeenFrame::Gap& gap) {
      return gap.at_contact_m >= limits.worst_gap * surface_size_m_;
    });
  };
  return std::size_t(std::find_if(seen.begin(), seen.end(), gapes) - seen.begin());
}
std::string FemSystem::why_refused(const State& state) const {
  const SeenLimits limits;
  const auto name = [&](int body) { return world_.bodies[std::size_t(body)].name; };
  if (!world_.touches_on_surfaces()) {
    const fem::Penetration deepest = fem::deepest_penetration(world_, state);
    const double share = largest_cage_penetration * deepest.depth_m / largest_cage_penetration_m(world_);
    return fmt::format("the cage of {} goes {:.2f} % of the robot's size into {}, beyond {:g} %",
                       name(deepest.body), 100 * share,
                       deepest.other < 0 ? "a wall" : "that of " + name(deepest.other),
                       100 * largest_cage_penetration);
  }
  const SeenFrame seen = surfaces_->at(state);
  const auto percent = [&](double m) { return 100 * m / surface_size_m_; };
  if (seen.overlap_m > limits.overlap * surface_size_m_)
    return fmt::format("{} and {} overlap by {:.2f} % of the robot's size, beyond {:g} %",
                       name(seen.overlap_body), name(seen.overlap_other), percent(seen.overlap_m),
                       100 * limits.overlap);
  if (seen.self_overlap_m > limits.self_overlap * surface_size_m_)
    return fmt::format("{} overlaps itself by {:.2f} % of the robot's size, beyond {:g} %",
                       name(seen.self_overlap_body), percent(seen.self_overlap_m), 100 * limits.self_overlap);
  // Light touches do not count (keep_what_presses), and the strongest is none.
  const SeenFrame::Gap* strongest = nullptr;
  for (const SeenFrame::Gap& gap : seen.gaps)
    if (gap.at_contact_m >= limits.worst_gap * surface_size_m_ &&
        (!strongest || gap.force_n > strongest->force_n))
      strongest = &gap;
  if (!strongest) return {};
  return fmt::format("{} and {} press one another through {:.2f} % of the robot's size of air, beyond {:g} %",
                     name(strongest->body), strongest->other < 0 ? "a wall" : name(strongest->other),
                     percent(strongest->at_contact_m), 100 * limits.worst_gap);
}
const plan::System& FemSystem::on_leg(int leg) const {
  return leg < int(via_.size()) ? static_cast<const plan::System&>(*via_[std::size_t(leg)]) : *this;
}
bool FemSystem::goal_holds(const State& state) const {
  if (goal_.turn_tolerance_deg &&
      fem::turn_from_goal_shape_deg(world_, state, goal_.half_turn) > *goal_.turn_tolerance_deg)
    return false;
  if (goal_.shape_tolerance_m &&
      fem::distance_from_goal_shape_m(world_, state, goal_.half_turn) > *goal_.shape_tolerance_m)
    return false;
  const auto height = [&](int body, bool top) {
    const Points places = fem::body_positions(world_, state, body);
    return top ? places.col(2).maxCoeff() : places.col(2).minCoeff();
  };
  if (goal_.above >= 0 && height(world_.robot, false) <= height(goal_.above, true)) return false;
  if (goal_.below >= 0 && height(world_.robot, true) >= height(goal_.below, false)) return false;
  if (goal_.volume > 0 && fem::volume_m3(world_, state, world_.robot) <
                              goal_.volume * world_.bodies[std::size_t(world_.robot)].rest_volume_m3)
    return false;
  for (const auto& [ring, pieces] : goal_.through)
    if (fem::pieces_through(world_, state, ring) != pieces) return false;
  if (goal_.clear_of < 0) return true;
  for (const fem::ContactForce& c : fem::contact_forces(world_, state))
    if ((c.body == goal_.clear_of && c.other == world_.robot) ||
        (c.other == goal_.clear_of && c.body == world_.robot))
      return false;
  return true;
}
Vec3 FemSystem::goal_shift(const State& state) const {
  if (goal_.body < 0) return Vec3::Zero();
  return fem::center_of_mass_m(world_, state, goal_.body) - goal_body_start_m_;
}
plan::Measures FemSystem::measures(const State& state) const {
  return {fem::elastic_energy_j(world_, state), fem::largest_volume_change(world_, state)};
}
Vec3 FemSystem::goal_velocity(const State& state) const {
  return goal_.body < 0 ? Vec3::Zero() : fem::center_velocity_m_s(world_, state, goal_.body);
}
plan::Workspace FemSystem::workspace() const { return workspace_of(world_, given_start_, holes_); }
int FemSystem::lanes() const { return preferred_lanes; }
std::unique_ptr<plan::Propagator> FemSystem::make_propagator() const {
  return std::make_unique<Propagator>(*this);
}
fem::Cost FemSystem::cost() const {
  fem::Cost sum;
  for (const auto& via : via_) sum += via->cost();
  const std::lock_guard lock(mutex_);
  sum += cost_;
  return sum;
}

}  // namespace limber::detail
