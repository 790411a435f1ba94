#include "fem/detail/surface_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/world.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;
// Candidates that a list holds without costing much, and how far lists reach, in skins.
constexpr std::size_t few_candidates = 1000, many_candidates = 3000;
constexpr float nearest_reach = 0.5f, farthest_reach = 6;
// A column that holds no sample: in no box.
constexpr float nowhere = 1e30f;

template <class Real>
const SurfaceTables<Real>& surface_tables_of(const World&);
template <>
const SurfaceTables<float>& surface_tables_of(const World& world) {
  return world.surfaces;
}
template <>
const SurfaceTables<double>& surface_tables_of(const World& world) {
  return world.surfaces64;
}

template <class Real>
bool boxes_meet(const Real lower[3], const Real upper[3], const Real other_lower[3],
                const Real other_upper[3]) {
  bool meet = true;  // never of what is not finite
  for (int c = 0; c < 3; ++c) meet &= lower[c] <= other_upper[c] && other_lower[c] <= upper[c];
  return meet;
}

}  // namespace

template <class Real>
Real SurfaceTables<Real>::Field::at(const Real place[3], Real gradient[3]) const {
  int cell[3];
  Real part[3];
  bool within[3];
  for (int c = 0; c < 3; ++c) {
    const Real last = Real(nodes[c] - 1), t = (place[c] - lower[c]) * inverse_cell;
    within[c] = t >= 0 && t <= last;
    const Real held = within[c] ? t : (t > last ? last : Real(0));  // 0 of what is not a number
    cell[c] = std::min(int(held), nodes[c] - 2);
    part[c] = held - Real(cell[c]);
  }
  const std::ptrdiff_t row = nodes[0], slice = row * nodes[1];
  const std::int16_t* v = values + cell[2] * slice + cell[1] * row + cell[0];
  const auto value = [&](int i, int j, int k) { return Real(v[k * slice + j * row + i]); };
  const auto mix = [](Real a, Real b, Real t) { return a + t * (b - a); };
  Real along_x[2][2], rise_x[2][2];
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j) {
      rise_x[k][j] = value(1, j, k) - value(0, j, k);
      along_x[k][j] = value(0, j, k) + part[0] * rise_x[k][j];
    }
  const Real low = mix(along_x[0][0], along_x[0][1], part[1]),
             high = mix(along_x[1][0], along_x[1][1], part[1]);
  const Real scale = unit * inverse_cell;
  gradient[0] = within[0] ? scale * mix(mix(rise_x[0][0], rise_x[0][1], part[1]),
                                        mix(rise_x[1][0], rise_x[1][1], part[1]), part[2])
                          : Real(0);
  gradient[1] = within[1] ? scale * mix(along_x[0][1] - along_x[0][0], along_x[1][1] - along_x[1][0], part[2])
                          : Real(0);
  gradient[2] = within[2] ? scale * (high - low) : Real(0);
  return unit * mix(low, high, part[2]);
}

template <class Real>
void SurfaceTables<Real>::spread(const Real* rest, const int node[4], const Real weight[4], Real sign,
                                 std::vector<Real>& scratch, std::vector<Share>& out) const {
  Real at_rest[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const std::size_t first = out.size();
  for (int i = 0; i < 4; ++i) {
    Real half[3];
    for (int c = 0; c < 3; ++c) half[c] = Real(0.5) * weight[i] * (at_rest[c] - rest[3 * node[i] + c]);
    for (int k = first_slope[node[i]]; k < first_slope[node[i] + 1]; ++k) {  // the node itself among them
      Real& sum = scratch[slopes[k].node];
      if (sum == 0) out.push_back({slopes[k].node, 0});
      sum += dot(half, slopes[k].gradient) + (slopes[k].node == node[i] ? weight[i] : Real(0));
    }
  }
  std::size_t kept_shares = first;  // a sum may have been 0 in between
  for (std::size_t k = first; k < out.size(); ++k) {
    Real& sum = scratch[out[k].node];
    if (sum != 0) out[kept_shares++] = {out[k].node, sign * sum};
    sum = 0;
  }
  out.resize(kept_shares);
}

template <class Real>
SurfaceContacts<Real>::SurfaceContacts(const World& world, const Kernels<Real>& kernels, int lanes)
    : world_(world),
      topology_(world.topology),
      tables_(tables_of<Real>(world)),
      surface_(surface_tables_of<Real>(world)),
      kernels_(kernels),
      bodies_(int(world.bodies.size())),
      world_nodes_(world.nodes),
      first_sample_row_(world.nodes + 4 * int(world.topology.tets.size())),
      first_sample_stamp_(world.nodes + int(world.topology.tets.size())),
      first_slopes_stamp_(first_sample_stamp_ + int(surface_.samples.size())),
      first_bends_stamp_(first_slopes_stamp_ + (surface_.slopes.empty() ? 0 : world.nodes)),
      step_(Real(world.contact_dt_s)) {
  for (int a = 0; a < bodies_; ++a) {
    if (world.bodies[a].moving && world.bodies[a].self_contact) pairs_.emplace_back(a, a);
    for (int b = a + 1; b < bodies_; ++b)
      if (world.bodies[a].pushed() || world.bodies[b].pushed()) pairs_.emplace_back(a, b);
  }
  for (const auto& body : world.bodies)
    if (body.kind == BodyKind::rigid) effective_masses_.resize(world.bodies.size());
  const std::size_t tets = topology_.tets.size(), samples = surface_.samples.size();
  lists_.resize(std::size_t(lanes) * pairs_.size());
  places_.resize(std::size_t(first_sample_row_) + samples);
  if (!surface_.slopes.empty())
    slopes_.resize(std::size_t(world_nodes_)), spread_.resize(slopes_.size(), 0), bends_.resize(tets);
  stamps_.assign(std::size_t(first_bends_stamp_) + bends_.size(), 0);
  loads_.assign(std::size_t(world_nodes_), 0);
  for (const Real mass : tables_.node_mass) reciprocal_mass_.push_back(1 / mass);
  velocities_.resize(std::size_t(world_nodes_)), forces_.assign(std::size_t(world_nodes_), Place{});
  beside_.assign(tets, -1), sides_.assign(tets, 0);
  walls_asleep_until_.resize(std::size_t(lanes * bodies_));
  for (int k = 0; k < lanes * bodies_; ++k)
    walls_asleep_until_[k].assign(surface_.bodies[k % bodies_].wall_nodes.size() + block_size,
                                  std::numeric_limits<Real>::lowest());
}

template <class Real>
bool SurfaceContacts<Real>::is_rigid(int body) const {
  return world_.bodies[body].kind == BodyKind::rigid;
}

template <class Real>
void SurfaceContacts<Real>::forget(int lane) {
  for (std::size_t p = 0; p < pairs_.size(); ++p) lists_[lane * pairs_.size() + p].built = false;
  for (int body = 0; body < bodies_; ++body) {
    auto& walls = walls_asleep_until_[lane * bodies_ + body];
    std::fill(walls.begin(), walls.end(), std::numeric_limits<Real>::lowest());
  }
}

template <class Real>
auto SurfaceContacts<Real>::node_place(const LaneView<Real>& view, int node) -> const Place& {
  Place& place = places_[node];
  if (stamps_[node] == stamp_) return place;
  stamps_[node] = stamp_;
  const Real* x = view.x + view.state.at(node, 0);
  place.row = Row{x[0], x[view.state.component], x[2 * view.state.component], 0};
  return place;
}

template <class Real>
auto SurfaceContacts<Real>::sample_place(const LaneView<Real>& view, int index) -> const Place& {
  Place& place = places_[row_of_sample(index)];
  unsigned& stamp = stamps_[first_sample_stamp_ + index];
  if (stamp == stamp_) return place;
  stamp = stamp_;
  const typename Tables::Sample& sample = surface_.samples[index];
  Row sum = sample.weight[0] * node_place(view, sample.node[0]).row;
  for (int i = 1; i < 4; ++i) sum += sample.weight[i] * node_place(view, sample.node[i]).row;
  place.row = sum;
  return place;
}

template <class Real>
auto SurfaceContacts<Real>::slopes_at(const LaneView<Real>& view, int node) -> const Slopes& {
  Slopes& slopes = slopes_[node];
  unsigned& stamp = stamps_[first_slopes_stamp_ + node];
  if (stamp == stamp_) return slopes;
  stamp = stamp_;
  Row sum[3] = {{}, {}, {}};
  for (int k = surface_.first_slope[node]; k < surface_.first_slope[node + 1]; ++k) {
    const typename Tables::Slope& slope = surface_.slopes[k];
    const Row place = node_place(view, slope.node).row;
    for (int c = 0; c < 3; ++c) sum[c] += slope.gradient[c] * place;
  }
  for (int c = 0; c < 3; ++c) slopes.column[c].row = sum[c];
  return slopes;
}

// ½ Σ wᵢ Fᵢ (X − Xᵢ) = Σ wᵢ wⱼ ½ (Fᵢ − Fⱼ) (Xⱼ − Xᵢ) over the edges; in the middle of one ¼ of its own.
template <class Real>
auto SurfaceContacts<Real>::bends_of(const LaneView<Real>& view, int tet) -> const Bends& {
  Bends& bends = bends_[tet];
  unsigned& stamp = stamps_[first_bends_stamp_ + tet];
  if (stamp == stamp_) return bends;
  stamp = stamp_;
  const int* node = topology_.tets[tet].node;
  const Real* rest = tables_.rest_positions.data();
  Real most2 = 0;
  for (int i = 0, e = 0; i < 4; ++i) {
    const Slopes& own = slopes_at(view, node[i]);
    for (int j = i + 1; j < 4; ++j, ++e) {
      const Slopes& other = slopes_at(view, node[j]);
      Row sum = {};
      for (int c = 0; c < 3; ++c) {
        const Real way = Real(0.5) * (rest[3 * node[j] + c] - rest[3 * node[i] + c]);
        sum += way * (own.column[c].row - other.column[c].row);
      }
      bends.of_edge[e].row = sum;
      most2 = std::max(most2, dot(bends.of_edge[e].at, bends.of_edge[e].at));
    }
  }
  bends.most = Real(0.25) * std::sqrt(most2);
  return bends;
}

template <class Real>
Real SurfaceContacts<Real>::bulge_of(const LaneView<Real>& view, int body, int tet) {
  const typename Tables::Body& table = surface_.bodies[body];
  return table.phong ? std::min(bends_of(view, tet).most, table.bulge) : Real(0);
}

template <class Real>
Real SurfaceContacts<Real>::sample_bulge(const LaneView<Real>& view, int body, int index) {
  const typename Tables::Body& table = surface_.bodies[body];
  if (!table.phong) return 0;
  const typename Tables::Sample& sample = surface_.samples[index];
  const Place way = bend(bends_of(view, sample.tet), sample.weight);
  return std::min(std::sqrt(dot(way.at, way.at)), table.bulge);
}

// By how much Phong Deformation moves a place away from where linear deformation has it.
template <class Real>
auto SurfaceContacts<Real>::bend(const Bends& bends, const Real w[4]) -> Place {
  Place way;
  way.row = (w[0] * w[1]) * bends.of_edge[0].row + (w[0] * w[2]) * bends.of_edge[1].row +
            (w[0] * w[3]) * bends.of_edge[2].row + (w[1] * w[2]) * bends.of_edge[3].row +
            (w[1] * w[3]) * bends.of_edge[4].row + (w[2] * w[3]) * bends.of_edge[5].row;
  return way;
}

template <class Real>
void SurfaceContacts<Real>::find_core(const LaneView<Real>& view, int tet) {
  unsigned& stamp = stamps_[world_nodes_ + tet];
  if (stamp == stamp_) return;
  stamp = stamp_;
  const typename Tables::Core& core = surface_.cores[tet];
  const int* node = topology_.tets[tet].node;
  Row corner[4], base = core.least[0] * (corner[0] = node_place(view, node[0]).row);
  for (int i = 1; i < 4; ++i) base += core.least[i] * (corner[i] = node_place(view, node[i]).row);
  for (int i = 0; i < 4; ++i) places_[row_of_core(tet) + i].row = base + core.scale * corner[i];
}

// How far points of the two bodies can have come to one another since the lane was loaded.
template <class Real>
Real SurfaceContacts<Real>::travel_of(const LaneView<Real>& view, int a, int b) {
  const Real factor_a = surface_.bodies[a].reach_factor, factor_b = surface_.bodies[b].reach_factor;
  Real travel = a == b ? (1 + factor_a) * view.inner_travel[a * view.stride]
                       : factor_a * view.travel[a * view.stride] + factor_b * view.travel[b * view.stride];
  for (const int body : {a, b})
    if (surface_.bodies[body].phong)
      travel += surface_.bodies[body].bend_factor * view.inner_travel[body * view.stride];
  return travel;
}

template <class Real>
void SurfaceContacts<Real>::add_forces(int lane, const LaneView<Real>& view, Friction<Real>* friction) {
  find(lane, view);
  if (contacts_.empty()) return;
  share_loads(view);
  for (const SurfaceContact<Real>& contact : contacts_) respond(contact, friction);
  for (const SurfaceContact<Real>& contact : contacts_)
    for (int i = contact.first_share; i < contact.last_share; ++i) {
      const int node = shares_[i].node;
      if (loads_[node] == 0) continue;
      for (int c = 0; c < 3; ++c) view.f[view.force.at(node, c)] += forces_[node].at[c];
      loads_[node] = 0, forces_[node].row = Row{};
    }
}

template <class Real>
Real SurfaceContacts<Real>::deepest_overlap(int lane, const LaneView<Real>& view) {
  Real deepest = 0;
  for (const SurfaceContact<Real>& contact : find(lane, view))
    if (contact.against >= 0 && contact.against != contact.body)
      deepest =
          std::max(deepest, contact.depth -
                                std::max(surface_.offset[contact.body * bodies_ + contact.against], Real(0)));
  return deepest;
}

template <class Real>
const std::vector<SurfaceContact<Real>>& SurfaceContacts<Real>::find(int lane, const LaneView<Real>& view) {
  if (++stamp_ == 0) std::fill(stamps_.begin(), stamps_.end(), 0u), stamp_ = 1;
  contacts_.clear(), shares_.clear();
  for (std::size_t p = 0; p < pairs_.size(); ++p) find_pair(lane, view, p);
  for (int body = 0; body < bodies_ && world_.walls; ++body)
    if (topology_.bodies[body].pushed && !view.sleeps(body)) find_walls(lane, view, body);
  return contacts_;
}

template <class Real>
void SurfaceContacts<Real>::find_pair(int lane, const LaneView<Real>& view, std::size_t pair) {
  const auto [a, b] = pairs_[pair];
  if (view.sleeps(a) && view.sleeps(b)) return;
  const Real apart = offset(a, b);
  for (int c = 0; c < 3; ++c) {
    const int ka = (3 * a + c) * view.stride, kb = (3 * b + c) * view.stride;
    if (view.lower[ka] - apart > view.upper[kb] || view.lower[kb] - apart > view.upper[ka]) return;
  }
  List& list = lists_[lane * pairs_.size() + pair];
  const Real travel = travel_of(view, a, b);
  if (!list.built || travel - list.travel_at_build > kept * list.reach) {
    // A list that holds little may as well reach farther, and so last longer; its results are the same.
    const std::size_t held = list.near[0].candidates.size() + list.near[1].candidates.size();
    const Real skin = (tables_.skin[a] + tables_.skin[b]) / 2;
    if (list.reach == 0) list.reach = skin;
    if (list.built && held < few_candidates)
      list.reach = std::min(Real(1.5) * list.reach, farthest_reach * skin);
    if (list.built && held > many_candidates)
      list.reach = std::max(list.reach / Real(1.5), nearest_reach * skin);
    list.built = true, list.travel_at_build = travel;
    build(view, a, b, list.reach, list.near[0]);
    if (a != b) build(view, b, a, list.reach, list.near[1]);
    for (Near& near : list.near)
      for (std::size_t k = 0; k < near.candidates.size(); ++k)
        near.asleep_until[k] = travel + kept * near.asleep_until[k] - rounding * list.reach;
  }
  const Real reach = list.reach;
  find_in(view, a, b, reach, travel, list.near[0]);
  if (a != b) find_in(view, b, a, reach, travel, list.near[1]);
}

// The samples of the body that are near a box, by tet, in columns.
template <class Real>
void SurfaceContacts<Real>::collect_groups(const LaneView<Real>& view, int from, const Real lower[3],
                                           const Real upper[3], Real reach) {
  groups_.clear();
  for (auto& column : columns_) column.clear();
  Real wide_lower[3], wide_upper[3];
  for (int c = 0; c < 3; ++c) wide_lower[c] = lower[c] - reach, wide_upper[c] = upper[c] + reach;
  for (const int tet : surface_.bodies[from].sampled_tets) {
    Real least[3], most[3];
    for (int i = 0; i < 4; ++i) {
      const Real* at = node_place(view, topology_.tets[tet].node[i]).at;
      for (int c = 0; c < 3; ++c) {
        least[c] = i == 0 ? at[c] : std::min(least[c], at[c]);
        most[c] = i == 0 ? at[c] : std::max(most[c], at[c]);
      }
    }
    // Samples that no tet holds lie a little outside of theirs.
    for (int c = 0; c < 3; ++c) least[c] -= reach, most[c] += reach;
    if (!boxes_meet(least, most, lower, upper)) continue;
    const int first = surface_.first_sample[tet], count = surface_.first_sample[tet + 1] - first;
    Group group{tet, int(columns_[0].size()), first, count, {}, {}};
    const std::size_t full =
        columns_[0].size() + std::size_t((count + block_size - 1) / block_size * block_size);
    const Real *w0 = &surface_.weights[0][first], *w1 = &surface_.weights[1][first],
               *w2 = &surface_.weights[2][first], *w3 = &surface_.weights[3][first];
    const int* node = topology_.tets[tet].node;
    for (int c = 0; c < 3; ++c) {
      columns_[c].resize(full, Real(nowhere));
      Real* const at = &columns_[c][group.begin];
      const Real x0 = places_[node[0]].at[c], x1 = places_[node[1]].at[c], x2 = places_[node[2]].at[c],
                 x3 = places_[node[3]].at[c];
      for (int k = 0; k < count; ++k) at[k] = w0[k] * x0 + w1[k] * x1 + w2[k] * x2 + w3[k] * x3;
      const auto ends = std::minmax_element(at, at + count);
      group.lower[c] = *ends.first, group.upper[c] = *ends.second;
    }
    if (!boxes_meet(group.lower, group.upper, wide_lower, wide_upper)) {
      for (auto& column : columns_) column.resize(std::size_t(group.begin));
      continue;
    }
    groups_.push_back(group);
  }
}

// Into slabs by their middles, along the longest axis of their box.
template <class Real>
void SurfaceContacts<Real>::sort_groups(const Real lower[3], const Real upper[3]) {
  slab_axis_ = 0, slab_half_ = 0;
  for (int c = 1; c < 3; ++c)
    if (upper[c] - lower[c] > upper[slab_axis_] - lower[slab_axis_]) slab_axis_ = c;
  slab_lower_ = lower[slab_axis_];
  slabs_a_metre_ = Real(slabs) / std::max(upper[slab_axis_] - slab_lower_, std::numeric_limits<Real>::min());
  std::fill(std::begin(slab_begin_), std::end(slab_begin_), 0);
  const auto slab = [&](const Group& group) {
    return slab_of((group.lower[slab_axis_] + group.upper[slab_axis_]) / 2);
  };
  for (const Group& group : groups_) {
    ++slab_begin_[slab(group) + 1];
    slab_half_ = std::max(slab_half_, (group.upper[slab_axis_] - group.lower[slab_axis_]) / 2);
  }
  for (int k = 0; k < slabs; ++k) slab_begin_[k + 1] += slab_begin_[k];
  unsorted_groups_ = groups_;
  int next[slabs];
  std::copy_n(slab_begin_, slabs, next);
  for (const Group& group : unsorted_groups_) groups_[next[slab(group)]++] = group;
  for (int c = 0; c < 3; ++c) {
    group_boxes_[c].clear(), group_boxes_[3 + c].clear();
    for (const Group& group : groups_)
      group_boxes_[c].push_back(group.lower[c]), group_boxes_[3 + c].push_back(group.upper[c]);
    for (int k : {c, 3 + c}) group_boxes_[k].resize(groups_.size() + block_size, 0);
  }
  meeting_.resize(groups_.size() + block_size);
}

// Candidates, with their distances in the place of what they sleep until.
template <class Real>
void SurfaceContacts<Real>::build(const LaneView<Real>& view, int from, int into, Real reach, Near& near) {
  Real lower[3], upper[3];
  for (int c = 0; c < 3; ++c) {
    const int k = (3 * into + c) * view.stride;
    lower[c] = view.lower[k] - offset(from, into);
    upper[c] = view.upper[k] + offset(from, into);
  }
  collect_groups(view, from, lower, upper, reach);
  found_.clear(), found_distance_.clear(), near_tets_.clear();
  if (!groups_.empty()) {
    for (int c = 0; c < 3; ++c) {
      lower[c] = groups_[0].lower[c], upper[c] = groups_[0].upper[c];
      for (const Group& group : groups_)
        lower[c] = std::min(lower[c], group.lower[c]), upper[c] = std::max(upper[c], group.upper[c]);
      const Real margin = reach + surface_.bodies[from].bulge + surface_.bodies[into].bulge;
      lower[c] -= margin, upper[c] += margin;
    }
    for (const int tet : surface_.bodies[into].cored_tets) {
      find_core(view, tet);
      const int row = row_of_core(tet);
      bool meet = true;
      for (int c = 0; c < 3; ++c) {
        const Real *p = places_[row].at, *q = places_[row + 1].at, *r = places_[row + 2].at,
                   *s = places_[row + 3].at;
        meet &= std::min(std::min(p[c], q[c]), std::min(r[c], s[c])) <= upper[c] &&
                std::max(std::max(p[c], q[c]), std::max(r[c], s[c])) >= lower[c];
      }
      if (meet) near_tets_.push_back({{row, row + 1, row + 2, row + 3}, -1, -1, tet, -1});
    }
  }
  Real from_bulge = 0, into_bulge = 0;  // the largest that are near
  for (const Group& group : groups_) from_bulge = std::max(from_bulge, bulge_of(view, from, group.tet));
  for (const TetAndEdge& tet : near_tets_) into_bulge = std::max(into_bulge, bulge_of(view, into, tet.tet));
  const Real margin = reach + from_bulge + into_bulge;
  const int first = groups_.empty() ? 0 : surface_.first_sample[groups_.front().tet],
            last = groups_.empty() ? 0 : surface_.first_sample[groups_.back().tet + 1];
  sort_groups(lower, upper);
  planes_.resize((near_tets_.size() + block_size - 1) / block_size);
  kernels_.find_planes(near_tets_.data(), int(near_tets_.size()), &places_[0].at[0], margin, planes_.data());
  // beside_[tet] is k of the last near tet that it shares a node with.
  const auto mark_beside = [&](int tet, int k) {
    for (const int node : topology_.tets[tet].node)
      for (const int other : surface_.tets_round_node[node]) beside_[other] = k;
  };
  if (from == into) std::fill(beside_.begin(), beside_.end(), -1);
  for (std::size_t k = 0; k < near_tets_.size(); ++k) {
    const TetPlanes<Real>& planes = planes_[k / block_size];
    const int column = int(k % block_size);
    const Real tet_lower = planes.lower[slab_axis_][column], tet_upper = planes.upper[slab_axis_][column];
    const int begin = slab_begin_[slab_of(tet_lower - slab_half_)],
              end = slab_begin_[slab_of(tet_upper + slab_half_) + 1];
    const Real *const lowers[3] = {&group_boxes_[0][begin], &group_boxes_[1][begin], &group_boxes_[2][begin]},
                      *const uppers[3] = {&group_boxes_[3][begin], &group_boxes_[4][begin],
                                          &group_boxes_[5][begin]};
    const int meeting =
        kernels_.meeting_boxes(planes, column, lowers, uppers, end - begin, margin, meeting_.data());
    if (from == into && meeting > 0) mark_beside(near_tets_[k].tet, int(k));
    const Real tet_bulge = meeting > 0 ? bulge_of(view, into, near_tets_[k].tet) : Real(0);
    for (int m = 0; m < meeting; ++m) {
      const Group& group = groups_[begin + meeting_[m]];
      if (from == into && beside_[group.tet] == int(k)) continue;
      const Real* const at[3] = {&columns_[0][group.begin], &columns_[1][group.begin],
                                 &columns_[2][group.begin]};
      near_tet_.resize(std::size_t(group.count));
      const int count = kernels_.near_points(planes, column, at, at, group.count, margin, near_tet_.data());
      for (int i = 0; i < count; ++i) {
        const int sample = group.first_sample + near_tet_[i].item;
        const Real distance = near_tet_[i].distance - tet_bulge - sample_bulge(view, from, sample);
        if (distance > reach) continue;
        TetAndEdge& found = found_.emplace_back(near_tets_[k]);
        found.from = found.to = row_of_sample(sample), found.point = sample;
        found_distance_.push_back(distance);
      }
    }
  }
  // Counting sort by sample, which keeps the tets of each ascending.
  counts_.assign(std::size_t(last - first + 1), 0);
  for (const TetAndEdge& found : found_) ++counts_[found.point - first + 1];
  for (std::size_t k = 1; k < counts_.size(); ++k) counts_[k] += counts_[k - 1];
  near.candidates.resize(found_.size());
  near.asleep_until.resize(found_.size() + block_size);
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const int k = counts_[found_[i].point - first]++;
    near.candidates[k] = found_[i], near.asleep_until[k] = found_distance_[i];
  }
}

// Of the tets whose cores hold a sample, that one has it in which its least barycentric coordinate is
// largest: the one that holds it, or, just outside of the cage, the nearest.
template <class Real>
void SurfaceContacts<Real>::find_in(const LaneView<Real>& view, int from, int into, Real reach, Real travel,
                                    Near& near) {
  const std::size_t count = near.candidates.size();
  if (awake_.size() < count + block_size) awake_.resize(count + block_size), distance_.resize(awake_.size());
  const int awake = kernels_.find_at_most(near.asleep_until.data(), int(count), travel, awake_.data());
  for (int i = 0; i < awake; ++i) {
    find_core(view, near.candidates[awake_[i]].tet);
    sample_place(view, near.candidates[awake_[i]].point);
  }
  kernels_.middle_distances(near.candidates.data(), awake_.data(), awake, &places_[0].at[0],
                            distance_.data());
  for (int i = 0; i < awake;) {
    const int sample = near.candidates[awake_[i]].point;
    const Real* place = places_[row_of_sample(sample)].at;
    const Real own_bulge = sample_bulge(view, from, sample);
    int best = -1;
    Real best_weight[4], best_least = -std::numeric_limits<Real>::max();
    for (; i < awake && near.candidates[awake_[i]].point == sample; ++i) {
      const int tet = near.candidates[awake_[i]].tet;
      const Real bulge = own_bulge + bulge_of(view, into, tet);
      near.asleep_until[awake_[i]] = travel + kept * (distance_[i] - bulge) - rounding * reach;
      if (distance_[i] > bulge + certain * reach) continue;
      Real weight[4];
      if (!barycentric(view, tet, place, weight) || !near_core(view, tet, place, weight, bulge)) continue;
      const Real least = std::min(std::min(weight[0], weight[1]), std::min(weight[2], weight[3]));
      if (!(least > best_least)) continue;
      best = tet, best_least = least;
      std::copy_n(weight, 4, best_weight);
    }
    if (best >= 0) measure(view, from, into, sample, best, best_weight);
  }
}

// Whether a place and its weights are beyond no face of the tet's core, nor of its box, by more than `out`.
template <class Real>
bool SurfaceContacts<Real>::near_core(const LaneView<Real>& view, int tet, const Real place[3],
                                      const Real weight[4], Real out) {
  const typename Tables::Core& core = surface_.cores[tet];
  bool inside = true;
  for (int i = 0; i < 4; ++i) inside &= weight[i] >= core.least[i];
  if (inside || out == 0) return inside;
  const Place* at = &places_[row_of_core(tet)];
  for (int c = 0; c < 3; ++c)
    if (place[c] < std::min(std::min(at[0].at[c], at[1].at[c]), std::min(at[2].at[c], at[3].at[c])) - out ||
        place[c] > std::max(std::max(at[0].at[c], at[1].at[c]), std::max(at[2].at[c], at[3].at[c])) + out)
      return false;
  const int* node = topology_.tets[tet].node;
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[4][3];
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) edge[i][c] = corner[i + 1][c] - corner[0][c];
  for (int i = 0; i < 3; ++i) cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal[i + 1]);
  for (int c = 0; c < 3; ++c) normal[0][c] = normal[1][c] + normal[2][c] + normal[3][c];
  const Real volume6 = dot(normal[1], edge[0]);
  for (int i = 0; i < 4; ++i)
    if ((core.least[i] - weight[i]) * volume6 > out * std::sqrt(dot(normal[i], normal[i]))) return false;
  return true;
}

// False in a tet that is inverted.
template <class Real>
bool SurfaceContacts<Real>::barycentric(const LaneView<Real>& view, int tet, const Real place[3],
                                        Real weight[4]) {
  const int* node = topology_.tets[tet].node;
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[3], p[3];
  for (int c = 0; c < 3; ++c) {
    p[c] = place[c] - corner[0][c];
    for (int i = 0; i < 3; ++i) edge[i][c] = corner[i + 1][c] - corner[0][c];
  }
  Real volume6 = 0;
  weight[0] = 1;
  for (int i = 0; i < 3; ++i) {
    cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal);
    if (i == 0) volume6 = dot(normal, edge[0]);
    if (!(volume6 > 0)) return false;
    weight[i + 1] = dot(normal, p) / volume6;
    weight[0] -= weight[i + 1];
  }
  return true;
}

// Reads the field at rest, and turns its gradient into that of the distance where the tet is now.
template <class Real>
bool SurfaceContacts<Real>::find_surface(const LaneView<Real>& view, int body, int tet, const Real weight[4],
                                         Surface& found) {
  const int* node = topology_.tets[tet].node;
  const Real* rest = tables_.rest_positions.data();
  Real at_rest[3] = {0, 0, 0}, gradient[3];
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const Real distance = surface_.bodies[body].field.at(at_rest, gradient);
  const Real* corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = node_place(view, node[i]).at;
  Real edge[3][3], normal[3], now[3] = {0, 0, 0}, volume6 = 0;
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) edge[i][c] = corner[i + 1][c] - corner[0][c];
  for (int i = 0; i < 3; ++i) {
    cross(edge[(i + 1) % 3], edge[(i + 2) % 3], normal);
    if (i == 0) volume6 = dot(normal, edge[0]);
    Real rise = 0;
    for (int c = 0; c < 3; ++c) rise += gradient[c] * (rest[3 * node[i + 1] + c] - rest[3 * node[0] + c]);
    for (int c = 0; c < 3; ++c) now[c] += rise / volume6 * normal[c];
  }
  return found.set(distance, now);
}

// The same of a surface that Phong Deformation moves. The place at rest is found by Newton's method, from
// that of linear deformation, whose weights are given, with the gradients of nodes as the Jacobian; `weight`
// becomes that of the place found.
template <class Real>
bool SurfaceContacts<Real>::find_bent_surface(const LaneView<Real>& view, int body, int tet,
                                              const Place& place, Real weight[4], Surface& found) {
  constexpr int usual_steps = 2, max_steps = 6;
  constexpr Real thin = Real(1e-2);
  const int* node = topology_.tets[tet].node;
  const Real* weight_gradient = &surface_.weight_gradients[9 * std::size_t(tet)];
  const Bends& bends = bends_of(view, tet);
  const Real exact = surface_.wall_slack + Real(1e-3) * tables_.skin[body];
  Place row[3];  // of the inverse of the deformation gradient
  for (int step = 0;; ++step) {
    Place column[3], off;
    for (Place& c : column) c.row = Row{};
    off.row = place.row - bend(bends, weight).row;
    for (int i = 0; i < 4; ++i) {
      const Slopes& slopes = slopes_at(view, node[i]);
      for (int c = 0; c < 3; ++c) column[c].row += weight[i] * slopes.column[c].row;
      off.row -= weight[i] * node_place(view, node[i]).row;
    }
    for (int c = 0; c < 3; ++c)
      cross(column[(c + 1) % 3].at, column[(c + 2) % 3].at, row[c].at), row[c].at[3] = 0;
    const Real volume = dot(row[0].at, column[0].at);
    if (!(volume > thin)) return false;
    for (int c = 0; c < 3; ++c) row[c].row *= 1 / volume;
    if (step >= usual_steps && dot(off.at, off.at) <= exact * exact) break;
    if (step == max_steps) return false;
    Real way[3];
    for (int c = 0; c < 3; ++c) way[c] = dot(row[c].at, off.at);
    for (int i = 0; i < 3; ++i) {
      const Real more = dot(weight_gradient + 3 * i, way);
      weight[i + 1] += more, weight[0] -= more;
    }
  }
  const Real* rest = tables_.rest_positions.data();
  Real at_rest[3] = {0, 0, 0}, gradient[3], now[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) at_rest[c] += weight[i] * rest[3 * node[i] + c];
  const Real distance = surface_.bodies[body].field.at(at_rest, gradient);
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) now[c] += gradient[i] * row[i].at[c];
  return found.set(distance, now);
}

// Whether a place at rest lies in the box of a tet, or no farther out than `slack`. Cores have long corners:
// where tets fold away from one another these reach through air.
template <class Real>
bool SurfaceContacts<Real>::is_beside(int tet, const Real weight[4], Real slack) const {
  const int* node = topology_.tets[tet].node;
  const Real* rest = tables_.rest_positions.data();
  for (int c = 0; c < 3; ++c) {
    Real at = 0, lower = rest[3 * node[0] + c], upper = lower;
    for (int i = 0; i < 4; ++i) {
      const Real x = rest[3 * node[i] + c];
      at += weight[i] * x, lower = std::min(lower, x), upper = std::max(upper, x);
    }
    if (!(at >= lower - slack && at <= upper + slack)) return false;
  }
  return true;
}

// Appends a touch where the surface is nearer than the offset, or above.
template <class Real>
bool SurfaceContacts<Real>::measure(const LaneView<Real>& view, int from, int into, int sample, int tet,
                                    const Real weight[4]) {
  const Real near = offset(from, into), apart = surface_.offset[from * bodies_ + into];
  for (int c = 0; c < 3; ++c) {  // what is farther off is not in every list
    const int k = (3 * into + c) * view.stride;
    const Real at = places_[row_of_sample(sample)].at[c];
    if (at < view.lower[k] - near || at > view.upper[k] + near) return false;
  }
  const bool from_bends = surface_.bodies[from].phong, into_bends = surface_.bodies[into].phong;
  const typename Tables::Sample& own = surface_.samples[sample];
  const int* node = topology_.tets[tet].node;
  Surface surface;
  if (!find_surface(view, into, tet, weight, surface)) return false;
  Place place = places_[row_of_sample(sample)];
  Real against[4];
  std::copy_n(weight, 4, against);
  if (from_bends || into_bends) {
    // To first order the bends shift the distance by their parts along the normal; a third more for the rest.
    Place bent, against_bent;
    bent.row = against_bent.row = Row{};
    if (from_bends) bent = bend(bends_of(view, own.tet), own.weight);
    if (into_bends) against_bent = bend(bends_of(view, tet), weight);
    const Real slack =
        (std::sqrt(dot(bent.at, bent.at)) + std::sqrt(dot(against_bent.at, against_bent.at))) / 3;
    if (surface.distance + dot(surface.normal, bent.at) - dot(surface.normal, against_bent.at) >
        apart + slack)
      return false;
    if (from_bends) {
      place.row += bent.row;
      if (!barycentric(view, tet, place.at, against)) return false;
    }
    if (!(into_bends ? find_bent_surface(view, into, tet, place, against, surface)
                     : find_surface(view, into, tet, against, surface)))
      return false;
  }
  SurfaceContact<Real> contact;
  contact.depth = apart - surface.distance;
  if (!(contact.depth > 0)) return false;
  Real slack = surface_.core_reach;
  if (into_bends) {
    const Place way = bend(bends_of(view, tet), against);
    slack += std::sqrt(dot(way.at, way.at));
  }
  if (!is_beside(tet, against, slack)) return false;
  contact.body = from, contact.against = into, contact.sample = sample, contact.tet = tet;
  share_sample(from, sample, contact);
  if (into_bends)
    surface_.spread(tables_.rest_positions.data(), node, against, -1, spread_, shares_);
  else
    for (int i = 0; i < 4; ++i) shares_.push_back({node[i], -against[i]});
  contact.last_share = int(shares_.size());
  std::copy_n(place.at, 3, contact.place);
  std::copy_n(surface.normal, 3, contact.normal);
  contacts_.push_back(contact);
  return true;
}

// A node sleeps until it can have come to a wall. Sides 0 … 2 are the lower walls, 3 … 5 the upper ones.
template <class Real>
void SurfaceContacts<Real>::find_walls(int lane, const LaneView<Real>& view, int body) {
  const typename Tables::Body& table = surface_.bodies[body];
  const Real slack = surface_.wall_slack, bulge = table.bulge;
  Real least[3], most[3];  // where no surface is beyond a wall
  bool any = false;
  for (int c = 0; c < 3; ++c) {
    least[c] = Real(world_.bounds_m.lower[c]) - slack + bulge;
    most[c] = Real(world_.bounds_m.upper[c]) + slack - bulge;
    const int k = (3 * body + c) * view.stride;
    any |= view.lower[k] < least[c] || view.upper[k] > most[c];
  }
  if (!any) return;
  std::vector<Real>& asleep_until = walls_asleep_until_[lane * bodies_ + body];
  const Real travel = view.travel[body * view.stride], rounding_m = Real(1e-3) * slack;
  if (awake_.size() < asleep_until.size())
    awake_.resize(asleep_until.size()), distance_.resize(awake_.size());
  const int awake =
      kernels_.find_at_most(asleep_until.data(), int(table.wall_nodes.size()), travel, awake_.data());
  beyond_tets_.clear();
  for (int i = 0; i < awake; ++i) {
    const int k = awake_[i];
    const Real* at = node_place(view, table.wall_nodes[k]).at;
    unsigned sides = 0;
    Real nearest = std::numeric_limits<Real>::max();
    for (int c = 0; c < 3; ++c) {
      nearest = std::min(nearest, std::min(at[c] - least[c], most[c] - at[c]));
      sides |= unsigned(at[c] < least[c]) << c | unsigned(at[c] > most[c]) << (3 + c);
    }
    if (sides == 0) {
      asleep_until[k] = travel + kept * nearest - rounding_m;
      continue;
    }
    for (int t = table.first_tet_of_wall_node[k]; t < table.first_tet_of_wall_node[k + 1]; ++t) {
      const int tet = table.tets_of_wall_nodes[t];
      if (sides_[tet] == 0) beyond_tets_.push_back(tet);
      sides_[tet] |= static_cast<unsigned char>(sides);
    }
  }
  std::sort(beyond_tets_.begin(), beyond_tets_.end());
  for (const int tet : beyond_tets_) {
    const Real* corner[4];
    for (int i = 0; i < 4; ++i) corner[i] = node_place(view, topology_.tets[tet].node[i]).at;
    const int first = surface_.first_sample[tet], count = surface_.first_held_sample[tet] - first;
    const Bends* bends = table.phong ? &bends_of(view, tet) : nullptr;
    const std::size_t max_found = std::size_t(count + block_size);
    if (within_.size() < max_found) within_.resize(max_found);
    if (awake_.size() < max_found) awake_.resize(max_found), distance_.resize(max_found);
    for (int side = 0; side < 6; ++side) {
      if ((sides_[tet] >> side & 1) == 0) continue;
      const int axis = side % 3;
      const Real inward = side < 3 ? Real(1) : Real(-1),
                 wall = side < 3 ? least[axis] - bulge : most[axis] + bulge;
      Real in[4];
      for (int i = 0; i < 4; ++i) in[i] = inward * (corner[i][axis] - wall);
      Real* const within = within_.data();
      const Real *w0 = &surface_.weights[0][first], *w1 = &surface_.weights[1][first],
                 *w2 = &surface_.weights[2][first], *w3 = &surface_.weights[3][first];
#pragma GCC ivdep
      for (int k = 0; k < count; ++k)
        within[k] = w0[k] * in[0] + w1[k] * in[1] + w2[k] * in[2] + w3[k] * in[3];
      if (bends) {
        Real h[6];
        for (int e = 0; e < 6; ++e) h[e] = inward * bends->of_edge[e].at[axis];
#pragma GCC ivdep
        for (int k = 0; k < count; ++k)
          within[k] += w0[k] * (w1[k] * h[0] + w2[k] * h[1] + w3[k] * h[2]) +
                       w1[k] * (w2[k] * h[3] + w3[k] * h[4]) + w2[k] * w3[k] * h[5];
      }
      const int found = kernels_.find_at_most(within, count, Real(0), awake_.data());
      for (int i = 0; i < found; ++i) {
        const int k = awake_[i];
        if (!(within[k] < 0)) continue;
        SurfaceContact<Real>& contact = contacts_.emplace_back();
        contact.body = body, contact.against = -1, contact.sample = first + k, contact.tet = -1;
        contact.depth = -within[k];
        share_sample(body, first + k, contact);
        Place place = sample_place(view, first + k);
        if (bends) place.row += bend(*bends, surface_.samples[first + k].weight).row;
        std::copy_n(place.at, 3, contact.place);
        for (Real& c : contact.normal) c = 0;
        contact.normal[axis] = inward;
      }
    }
    sides_[tet] = 0;
  }
}

template <class Real>
void SurfaceContacts<Real>::share_sample(int body, int index, SurfaceContact<Real>& contact) {
  contact.first_share = int(shares_.size());
  if (surface_.bodies[body].phong) {
    const Share* shares = surface_.shares.data();
    shares_.insert(shares_.end(), shares + surface_.first_share[index],
                   shares + surface_.first_share[index + 1]);
  } else {
    const typename Tables::Sample& sample = surface_.samples[index];
    for (int i = 0; i < 4; ++i) shares_.push_back({sample.node[i], sample.weight[i]});
  }
  contact.first_against = contact.last_share = int(shares_.size());
}

template <class Real>
Real SurfaceContacts<Real>::load_of(const SurfaceContact<Real>& contact) const {
  return surface_.samples[contact.sample].area * contact.depth;
}

// What each node bears over its mass, and each rigid body, of all touches: their shares of it are shares of
// mass.
template <class Real>
void SurfaceContacts<Real>::share_loads(const LaneView<Real>& view) {
  for (EffectiveMass& effective_mass : effective_masses_) effective_mass.depths = 0;
  for (const SurfaceContact<Real>& contact : contacts_) {
    const Real load = load_of(contact);
    for (int i = contact.first_share; i < contact.last_share; ++i) {
      const auto [node, weight] = shares_[i];
      if (loads_[node] == 0) {
        const Real* v = view.v + view.state.at(node, 0);
        velocities_[node].row = Row{v[0], v[view.state.component], v[2 * view.state.component], 0};
      }
      loads_[node] += load * std::abs(weight) * reciprocal_mass_[node];
    }
    if (effective_masses_.empty()) continue;
    effective_masses_[contact.body].depths += double(load);
    if (contact.against >= 0) effective_masses_[contact.against].depths += double(load);
  }
  for (std::size_t body = 0; body < effective_masses_.size(); ++body)
    if (is_rigid(int(body)) && effective_masses_[body].depths > 0)
      effective_masses_[body].measure(view, topology_.bodies[body], tables_.node_mass);
}

template <class Real>
void SurfaceContacts<Real>::respond(const SurfaceContact<Real>& contact, Friction<Real>* friction) {
  const Real load = load_of(contact);
  const int side[2] = {contact.body, contact.against};
  Place relative;
  relative.row = Row{};
  Real loads = 0;                           // of what is not rigid
  Real borne[2] = {0, 0}, all[2] = {0, 0};  // of the force: by nodes that move
  for (const int k : {0, 1}) {
    const int begin = k == 0 ? contact.first_share : contact.first_against,
              end = k == 0 ? contact.first_against : contact.last_share;
    Real loads_of_side = 0;
    for (int i = begin; i < end; ++i) {
      const auto [node, weight] = shares_[i];
      const Real size = std::abs(weight);
      all[k] += size;
      if (tables_.inverse_mass[node] > 0) borne[k] += size;
      relative.row += weight * velocities_[node].row;
      // A held node counts with its mass: without, one that moves would be thrown by what they do not bear.
      loads_of_side += size * loads_[node];
    }
    if (begin < end && !is_rigid(side[k]) && topology_.bodies[side[k]].pushed) loads += loads_of_side;
  }
  bool any_rigid = false;
  for (const int body : side) any_rigid |= body >= 0 && is_rigid(body);
  if (!any_rigid && !(borne[0] + borne[1] > 0)) return;
  Real inverse_mass = loads / load;
  for (const int body : side)
    if (body >= 0 && is_rigid(body))
      inverse_mass += Real(effective_masses_[body].inverse_mass(contact.place, contact.normal, load));
  const Real push = penalty_push(Real(surface_beta), contact.depth, dot(relative.at, contact.normal),
                                 1 / inverse_mass, step_);
  if (!(push > 0)) return;
  const Real force[3] = {push * contact.normal[0], push * contact.normal[1], push * contact.normal[2]};
  for (int i = contact.first_share; i < contact.last_share; ++i) {
    const auto [node, weight] = shares_[i];
    if (tables_.inverse_mass[node] > 0) forces_[node].row += weight * Row{force[0], force[1], force[2], 0};
  }
  // What is set against nodes that never move on both sides, or against a wall, is borne by none.
  const Real share = contact.against < 0 ? borne[0] / all[0] : std::max(borne[0] / all[0], borne[1] / all[1]);
  if (records_)
    records_->push_back({contact.body,
                         contact.against,
                         {contact.place[0], contact.place[1], contact.place[2]},
                         contact.depth,
                         {share * force[0], share * force[1], share * force[2]}});
  if (!friction) return;
  const int other = contact.against < 0 ? contact.body : contact.against;
  const Share* shares = shares_.data();
  friction->add(contact.body, contact.against, contact.place, contact.normal,
                tables_.pair_friction[contact.body * bodies_ + other] * push, shares + contact.first_share,
                shares + contact.first_against, shares + contact.last_share,
                records_ ? int(records_->size()) - 1 : -1, share);
}

template struct SurfaceTables<float>;
template struct SurfaceTables<double>;
template class SurfaceContacts<float>;
template class SurfaceContacts<double>;

}  // namespace limber::fem::detail
