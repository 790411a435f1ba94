#include "fem/detail/start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/progress.h"
#include "fem/batch.h"
#include "fem/detail/surface_contact.h"
#include "fem/observe.h"
#include "fem/parting.h"

namespace limber::fem::detail {
namespace {

using Positions = std::vector<float>;  // of all nodes that move

// How far the surfaces of two bodies are apart, up to the offset asked for; negative: how deep. And where.
struct Gap {
  double gap_m;
  std::optional<SurfaceContact<double>> nearest;        // nothing: no nearer than that offset
  std::vector<SurfaceTables<double>::Share> shares[2];  // of it: of the sample's side, of the other
};
struct Gaps {
  // Body a × bodies + body b of those that are nearer than that offset; a = b: a body and itself.
  std::map<std::size_t, Gap> of_pair;
  Gap of_others;
  // The gaps of single samples below that offset, by body, against, sample.
  std::map<std::array<int, 3>, double> of_sample;
  const Gap& operator[](std::size_t pair) const {
    const auto near = of_pair.find(pair);
    return near == of_pair.end() ? of_others : near->second;
  }
};

std::vector<double> places_of(const World& world, const Positions& positions) {
  std::vector<double> x = world.tables64.rest_positions;
  std::copy(positions.begin(), positions.end(), x.begin());
  return x;
}

// Of a world whose surfaces64 have that offset everywhere.
Gaps gaps(const World& world, double offset_m, const Positions& positions) {
  const std::size_t bodies = world.bodies.size();
  Gaps gaps{{}, {offset_m, {}, {}}, {}};
  const std::vector<double> x = places_of(world, positions), still(x.size(), 0.0), travel(bodies, 0.0);
  std::vector<double> forces(x.size(), 0.0), lower, upper;
  for (const Body& body : world.bodies) {
    const Box box = bounding_box(
        Eigen::Map<const Points>(&x[std::size_t(3 * body.first_node)], Eigen::Index(body.node_count()), 3));
    lower.insert(lower.end(), box.lower.data(), box.lower.data() + 3);
    upper.insert(upper.end(), box.upper.data(), box.upper.data() + 3);
  }
  constexpr Layout rows{3, 1};
  SurfaceContacts<double> contacts(world, kernels<double>(best_isa(), 1), 1);
  for (const auto& contact : contacts.find(0, {x.data(), still.data(), forces.data(), rows, rows, 1,
                                               lower.data(), upper.data(), travel.data(), travel.data()})) {
    if (contact.against < 0) continue;
    const std::size_t one = std::size_t(contact.body), other = std::size_t(contact.against);
    const auto one_side = contacts.shares_of(contact), other_side = contacts.shares_against(contact);
    const double gap = offset_m - contact.depth;
    gaps.of_sample[{contact.body, contact.against, contact.sample}] = gap;
    if (gap < gaps[one * bodies + other].gap_m)
      gaps.of_pair[one * bodies + other] = gaps.of_pair[other * bodies + one] = {
          gap, contact, {{one_side.begin(), one_side.end()}, {other_side.begin(), other_side.end()}}};
  }
  return gaps;
}

// Of two bodies that begin in touch, and not pressed into one another, how near: the least gap. Half of what
// begins nearer than the offset does so by less than a third of it, as where one lies on the other, or it is
// no more than twice what a ball of the smaller one's size has on a plane. By [body, against], body <
// against. Bodies that lie along each other unevenly, as organs of a scan do, are none of these.
std::map<std::array<int, 2>, double> touching_gaps(const std::map<std::array<int, 3>, double>& gaps,
                                                   double offset_m, const World& world) {
  constexpr double pressed_share = 0.05, small_share = 1.0 / 3, balls = 2;
  std::map<std::array<int, 2>, std::vector<std::pair<double, double>>> gap_and_area;
  for (const auto& [key, gap] : gaps)
    if (const auto [body, against, sample] = key; body != against)
      gap_and_area[{std::min(body, against), std::max(body, against)}].emplace_back(
          gap, 0.5 * world.surfaces64.samples[std::size_t(sample)].area);  // seen from both sides
  const auto size_m = [&](int body) {
    return bounding_box(world.bodies[std::size_t(body)].cage.positions).size().maxCoeff();
  };
  std::map<std::array<int, 2>, double> touching;
  for (auto& [pair, all] : gap_and_area) {
    std::sort(all.begin(), all.end());
    if (all.front().first < -pressed_share * offset_m) continue;
    double area = 0, of_small = 0;
    for (const auto& [gap, of_one] : all)
      area += of_one, of_small += gap <= small_share * offset_m ? of_one : 0;
    const double of_ball = EIGEN_PI * std::min(size_m(pair[0]), size_m(pair[1])) * offset_m;
    if (of_small >= 0.5 * area || area <= balls * of_ball) touching[pair] = std::max(all.front().first, 0.0);
  }
  return touching;
}

// From here on a sample that begins nearer than the offset is in contact when it is nearer than that, less
// what rounding does: so nothing pushes at the start. What begins in touch is as near wherever it goes; else
// it would begin in a hollow, the offset deep, and had to climb out of that to slide or to roll.
void set_own_offsets(const std::map<std::array<int, 3>, double>& gaps, double offset_m, World& world) {
  constexpr double rounding = 1e-3;  // of the offset
  auto& tables = world.surfaces64;
  const std::size_t bodies = world.bodies.size();
  for (const auto& [pair, gap] : touching_gaps(gaps, offset_m, world))
    for (const auto& [a, b] : {pair, std::array{pair[1], pair[0]}}) {
      const std::size_t at = std::size_t(a) * bodies + std::size_t(b);
      tables.offset[at] = gap - rounding * offset_m, world.surfaces.offset[at] = float(tables.offset[at]);
    }
  if (!gaps.empty()) tables.first_own_offset.assign(bodies * bodies, -1);
  for (const auto& [key, gap] : gaps) {
    const auto [body, against, sample] = key;
    const std::size_t pair = std::size_t(body) * bodies + std::size_t(against);
    const double own = gap - rounding * offset_m;
    if (own >= tables.offset[pair]) continue;
    int& first = tables.first_own_offset[pair];
    if (first < 0) {
      first = int(tables.own_offset.size());
      const auto& tets = tables.bodies[std::size_t(body)].sampled_tets;
      const int samples = tables.first_sample[std::size_t(tets.back()) + 1] - tables.first_sample_of(body);
      tables.own_offset.insert(tables.own_offset.end(), std::size_t(samples), tables.offset[pair]);
    }
    tables.own_offset[std::size_t(first + sample - tables.first_sample_of(body))] = own;
  }
  world.surfaces.first_own_offset = tables.first_own_offset;
  world.surfaces.own_offset.assign(tables.own_offset.begin(), tables.own_offset.end());
}

// Of the offset: how deep surfaces are pressed that are to part, at first and where that does not part them;
// how far apart they are that are parted; how far nodes move at most in a stage that ends at rest.
constexpr double gentle_push = 0.25, firm_push = 1, apart = 0.25, at_rest = 0.02;
// Stages without less overlap before more is done about it, and stages after all are apart.
constexpr int patience = 24, max_resting_stages = 60;
constexpr int min_steps = 24, max_steps = 400;  // of a stage that goes on to its end
constexpr int max_steps_in_all = 100000;
constexpr int steps_between_looks = 4;  // at speeds, and at the wish to stop

// One and a half times what a wave needs through the slowest body: then its lowest mode is where it wants to
// be.
int steps_of_stage(const World& world) {
  double longest_s = 0;
  for (const Body& body : world.bodies) {
    if (!body.moving || body.kind != BodyKind::deformable) continue;
    double slowest = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < body.density_from_tet_kg_m3.size(); ++t)
      slowest =
          std::min(slowest, std::sqrt(body.youngs_modulus_from_tet_pa[t] / body.density_from_tet_kg_m3[t]));
    longest_s = std::max(longest_s, bounding_box(body.cage.positions).size().maxCoeff() / slowest);
  }
  return int(std::clamp(1.5 * longest_s / world.dt_s, double(min_steps), double(max_steps)));
}

// Dynamic relaxation with kinetic damping (Cundall 1976; Barnes 1999): the world is stepped without gravity,
// friction and sleep, in stages that begin at rest and end where nothing gains speed any more; from stage to
// stage the offsets of bodies that overlap go up with the gaps that were reached, until they are those of all
// bodies.
class Parter {
 public:
  Parter(const World& world, double offset_m, const Gaps& before)
      : world_(world), offset_m_(offset_m), bodies_(world.bodies.size()), before_(before), now_(before) {
    world_.forces.clear(), world_.pressures.clear(), world_.ligaments.clear();
    for (Body& body : world_.bodies) {
      body.gravity_m_s2.setZero(), body.material.mass_damping_per_s = body.material.fascia_hz = 0;
      body.track = {};  // time stands still
    }
    world_.rest_speed_m_s = 0, world_.dt_s = world_.contact_dt_s;
    stage_steps_ = steps_of_stage(world_);
    std::fill(world_.tables.pair_friction.begin(), world_.tables.pair_friction.end(), 0.f);
    for (std::size_t a = 0; a < bodies_; ++a)
      for (std::size_t b = a; b < bodies_; ++b) {
        set_offset(a, b, before[a * bodies_ + b].gap_m);
        if (a != b && before[a * bodies_ + b].gap_m < 0) pairs_.emplace_back(a, b);
      }
  }

  void run(World& world) {
    const double cpu_before_s = cpu_seconds();
    refuse_what_is_too_deep();
    Progress progress("parting bodies that overlap", 0);
    state_ = rest_state(world_);
    double push = gentle_push, min_lack = std::numeric_limits<double>::infinity();
    int waited = 0, resting = 0;
    bool calm = false;  // the last stage moved nothing
    while (true) {
      bool whole = true;  // all offsets are what they shall be
      for (const auto& [a, b] : pairs_) {
        const double offset = std::min(offset_m_, gap(a, b) + push * offset_m_);
        whole = whole && offset == offset_m_;
        set_offset(a, b, offset);
      }
      const bool to_its_end = calm;
      calm = take_stage(to_its_end) < at_rest * offset_m_ && whole;
      double lack = 0, min_gap = offset_m_;
      for (const auto& [a, b] : pairs_) lack += offset_m_ - gap(a, b), min_gap = std::min(min_gap, gap(a, b));
      progress.update(steps_, fmt::format("{:.2g} m deep", std::max(0.0, -min_gap)));
      if (calm && to_its_end && min_gap >= 0) break;
      const bool spent = steps_ >= max_steps_in_all;
      if (whole && min_gap >= apart * offset_m_ && (++resting == max_resting_stages || spent)) break;
      waited = lack < min_lack - at_rest * offset_m_ ? 0 : waited + 1;
      min_lack = std::min(min_lack, lack);
      if (waited >= patience && push < firm_push)
        push = firm_push, waited = 0;
      else if ((waited >= patience && min_gap < apart * offset_m_) || spent)
        refuse_what_stays();
    }
    if (!is_sound(world_, state_))
      refuse("a body would be inverted, stretched or squeezed by more than it may be");
    world.start_positions = state_.positions;
    world.parting.steps = steps_, world.parting.cpu_s = cpu_seconds() - cpu_before_s;
  }

 private:
  double gap(std::size_t a, std::size_t b) const { return now_[a * bodies_ + b].gap_m; }
  void set_offset(std::size_t a, std::size_t b, double offset_m) {
    world_.surfaces.offset[a * bodies_ + b] = world_.surfaces.offset[b * bodies_ + a] = float(offset_m);
  }

  // From rest to rest, `to_its_end` or until nothing gains speed any more; how far a node went at most. A
  // batch of its own, whose lists go by the offsets as they are now.
  double take_stage(bool to_its_end) {
    Batch batch(world_, 1);
    Control coast;
    coast.steps = stage_steps_;
    batch.load(0, state_, coast);
    State now;
    for (double energy_j = 0; const int taken = batch.advance(steps_between_looks);) {
      throw_if_stopped();
      steps_ += taken;
      if (to_its_end || batch.steps_left(0) == 0) continue;
      batch.peek(0, now);
      const double before_j = std::exchange(energy_j, kinetic_energy_j(world_, now));
      if (!(energy_j > before_j)) batch.stop(0);
    }
    if (batch.outcome(0).status != RunStatus::ok) refuse("the dynamics diverged: " + batch.outcome(0).reason);
    const Positions begun = std::move(state_.positions);
    batch.store(0, state_);
    std::fill(state_.velocities.begin(), state_.velocities.end(), 0.f);
    now_ = gaps(world_, offset_m_, state_.positions);
    double most2 = 0;
    for (std::size_t k = 0; k < begun.size(); k += 3) {
      const Vec3f way = Eigen::Map<const Vec3f>(&state_.positions[k]) - Eigen::Map<const Vec3f>(&begun[k]);
      most2 = std::max(most2, way.cast<double>().squaredNorm());
    }
    return std::sqrt(most2);
  }

  double size_of(std::size_t body) const {
    return bounding_box(world_.bodies[body].shape->samples.positions_m).size().maxCoeff();
  }
  void refuse_what_is_too_deep() const {
    for (const auto& [a, b] : pairs_) {
      const std::size_t smaller = size_of(a) < size_of(b) ? a : b;
      if (-gap(a, b) > deepest_parted_share * size_of(smaller))
        refuse(a, b,
               fmt::format("that is more than a quarter of {}'s size, {:.3g} m", world_.bodies[smaller].name,
                           size_of(smaller)),
               "move them apart");
    }
  }
  void refuse_what_stays() const {
    const auto [a, b] = deepest(now_);
    refuse(a, b,
           gap(a, b) < 0 ? fmt::format("after {} steps they still are, {:.3g} m", steps_, -gap(a, b))
                         : fmt::format("after {} steps they still press one another", steps_));
  }
  std::pair<std::size_t, std::size_t> deepest(const Gaps& gaps) const {
    return *std::min_element(pairs_.begin(), pairs_.end(), [&](const auto& one, const auto& other) {
      return gaps[one.first * bodies_ + one.second].gap_m < gaps[other.first * bodies_ + other.second].gap_m;
    });
  }
  [[noreturn]] void refuse(const std::string& why) const {
    const auto [a, b] = deepest(before_);
    refuse(a, b, why);
  }
  [[noreturn]] void refuse(
      std::size_t a, std::size_t b, const std::string& why,
      const char* advice = "move them apart, hold less of them fixed, or make one softer") const {
    throw InputError(fmt::format(
        "bodies {} and {} overlap at the start, {:.3g} m deep, and cannot be parted: {}; {}",
        world_.bodies[a].name, world_.bodies[b].name, -before_[a * bodies_ + b].gap_m, why, advice));
  }

  World world_;
  double offset_m_;
  std::size_t bodies_;
  Gaps before_, now_;
  std::vector<std::pair<std::size_t, std::size_t>> pairs_;  // that overlap at rest
  State state_;
  int stage_steps_, steps_ = 0;
};

// What a body did at a touch of two, along its normal: how far its side of it went out of the other's way.
double way_of(const World& world, const std::vector<double>& x, const Gap& gap, int side) {
  double way = 0;
  for (const auto& [node, weight] : gap.shares[side])
    for (int c = 0; c < 3; ++c) {
      const std::size_t k = std::size_t(3 * node + c);
      way += weight * gap.nearest->normal[c] * (x[k] - world.tables64.rest_positions[k]);
    }
  return way;
}

void record_to(const Gaps& before, const Gaps& now, World& world) {
  const std::size_t bodies = world.bodies.size();
  const std::vector<double> x = places_of(world, world.start_positions);
  for (std::size_t a = 0; a < bodies; ++a) {
    for (std::size_t b = a + 1; b < bodies; ++b) {
      const Gap& gap = before[a * bodies + b];
      if (gap.gap_m >= 0) continue;
      const int side_of_a = gap.nearest->body == int(a) ? 0 : 1;
      world.parting.pairs.push_back(
          {int(a),
           int(b),
           -gap.gap_m,
           now[a * bodies + b].gap_m,
           {way_of(world, x, gap, side_of_a), way_of(world, x, gap, 1 - side_of_a)}});
    }
    const Body& body = world.bodies[a];
    double most2 = 0;
    for (int n = body.first_node; n < body.first_node + body.node_count(); ++n) {
      const Eigen::Map<const Vec3> there(&x[std::size_t(3 * n)]),
          rest(&world.tables64.rest_positions[std::size_t(3 * n)]);
      most2 = std::max(most2, (there - rest).squaredNorm());
    }
    world.parting.largest_move_m.push_back(std::sqrt(most2));
  }
}

// Whether two bodies are deeper in one another than the offset.
bool must_part(const Gaps& gaps, double offset_m, const WorldSpec& spec) {
  const std::size_t bodies = spec.bodies.size();
  bool must = false;
  for (std::size_t a = 0; a < bodies; ++a)
    for (std::size_t b = a; b < bodies; ++b) {
      const double gap = gaps[a * bodies + b].gap_m;
      if (gap >= -offset_m) continue;
      if (a == b)
        throw InputError(
            fmt::format("body {} overlaps itself at the start, {:.3g} m deep; mend the model, or "
                        "switch its self_contact off",
                        spec.bodies[a].name, -gap));
      if (!spec.part_overlaps)
        throw InputError(
            fmt::format("bodies {} and {} overlap at the start, {:.3g} m deep; move them apart, or leave "
                        "part_overlaps on",
                        spec.bodies[a].name, spec.bodies[b].name, -gap));
      must = true;
    }
  return must;
}

}  // namespace

void set_start(const WorldSpec& spec, World& world) {
  world.start_positions = rest_state(world).positions;
  if (!world.touches_on_surfaces()) return;
  const double offset_m = spec.contact_offset_m;
  const Gaps before = gaps(world, offset_m, world.start_positions);
  if (!must_part(before, offset_m, spec)) return set_own_offsets(before.of_sample, offset_m, world);
  if (spec.start_positions.empty()) {
    Parter(world, offset_m, before).run(world);
  } else if (spec.start_positions.size() == world.start_positions.size()) {
    world.start_positions = spec.start_positions;
  } else {
    throw InputError(fmt::format("start_positions hold {} numbers, and the bodies that move have {}",
                                 spec.start_positions.size(), world.start_positions.size()));
  }
  const Gaps now = gaps(world, offset_m, world.start_positions);
  record_to(before, now, world);
  // Bodies that are still pressed lie as they were left: the push that holds them there stays.
  const std::size_t bodies = world.bodies.size();
  std::map<std::array<int, 3>, double> own;
  for (const auto& [key, gap] : before.of_sample) {
    const bool itself = key[0] == key[1];
    if (!itself && before[std::size_t(key[0]) * bodies + std::size_t(key[1])].gap_m < 0) continue;
    const auto after = now.of_sample.find(key);
    if (itself)
      own[key] = gap;
    else if (after != now.of_sample.end())
      own[key] = std::max(gap, after->second);
  }
  set_own_offsets(own, offset_m, world);
}

}  // namespace limber::fem::detail
