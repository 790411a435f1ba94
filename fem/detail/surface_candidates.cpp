// Contact on fine surfaces, first part: lists of what is near. A candidate is a sample of one body and the
// core of a tet of the other, which were within the reach r of one another when the list of their pair was
// made. With s a bound of how far points of the two bodies can have come to one another since,
//
//     a list that was made at s₀ is used while     s − s₀ ≤ 0.9 r;
//     a candidate at distance d sleeps until       s = s₀ + 0.9 d − 0.02 r.
//
// What always holds: what touches now is in the list. Distances are lower bounds, less the bends of both
// sides. Lists are in the order of samples, and of one sample's tets, whatever the order in which they were
// found.
//
// Half to two thirds of the time that contact takes is spent here, since a list lives 5 to 50 steps. Tried
// without gain (docs/contact.md, "Falls short"): pairs of tets in place of a sample and a tet (boxes and
// planes let three times as many through), lists that lanes with one start share, longer and shorter reach,
// one bound for all bends in place of each tet's own (lists live longer and hold three times as much).
#include <algorithm>
#include <limits>

#include "fem/detail/list_margins.h"
#include "fem/detail/surface_contact.h"
#include "fem/detail/surface_places.h"

namespace limber::fem::detail {
namespace {

using namespace list_margins;

// Candidates that a list holds without costing much, and how far lists reach, in skins.
constexpr std::size_t few_candidates = 1000, many_candidates = 3000;
constexpr float nearest_reach = 0.5f, farthest_reach = 6;
// A column that holds no sample: in no box.
constexpr float nowhere = 1e30f;

// Whether two boxes meet. What is not finite meets none.
template <class Real>
bool boxes_meet(const Real lower[3], const Real upper[3], const Real other_lower[3],
                const Real other_upper[3]) {
  bool meet = true;
  for (int c = 0; c < 3; ++c) meet &= lower[c] <= other_upper[c] && other_lower[c] <= upper[c];
  return meet;
}

// Appends the touches from `first` on, with `shift` added to their indices of shares.
template <class Contact>
void append(const std::vector<Contact>& from, std::size_t first, int shift, std::vector<Contact>& to) {
  for (std::size_t k = first; k < from.size(); ++k) {
    Contact& contact = to.emplace_back(from[k]);
    contact.first_against += shift, contact.last_against += shift;
  }
}

}  // namespace

// A bound of how far points of the two bodies can have come to one another since the lane was loaded,
// metres. No corner of a core and no sample goes farther than the body's reach_factor times its fastest
// node, and no bend grows by more than bend_factor times what nodes move against their mean. Within one
// body only movement against the mean brings anything nearer, so flight wears no list.
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

// A list that no pair had before, or another pair, reaches as far as a new one.
template <class Real>
auto SurfaceContacts<Real>::list_of(NearPair& pair) -> List& {
  if (pair.list < 0) {
    pair.list = near_pairs_.free_list();
    if (pair.list == int(lists_.size())) lists_.emplace_back();
    List& list = lists_[pair.list];
    list.built = list.kept = false, list.reach = 0;
  }
  return lists_[pair.list];
}

// The touches of one pair. Passes by bodies that both sleep and boxes that are farther apart than surfaces
// can touch. Of two bodies that stay as they are touches are found once more and then kept: among thirty
// organs side by side one moves, and its neighbours, which do not, touch their own.
template <class Real>
void SurfaceContacts<Real>::find_pair(const LaneView<Real>& view, NearPair& pair) {
  const auto [a, b, number] = pair;
  if (view.sleeps(a) && view.sleeps(b)) return;
  const Real apart = offset(a, b);
  for (int c = 0; c < 3; ++c) {
    const int ka = (3 * a + c) * view.stride, kb = (3 * b + c) * view.stride;
    if (view.lower[ka] - apart > view.upper[kb] || view.lower[kb] - apart > view.upper[ka]) return;
  }
  List& list = list_of(pair);
  if (!view.changes) return find_moved_pair(view, a, b, list);
  const std::uint32_t changes[2] = {view.changes[a * view.stride], view.changes[b * view.stride]};
  const bool same = list.built && changes[0] == list.changes[0] && changes[1] == list.changes[1];
  if (same && list.kept) {
    append(list.contacts, 0, int(shares_.size()), contacts_);
    shares_.insert(shares_.end(), list.shares.begin(), list.shares.end());
    return;
  }
  const std::size_t first = contacts_.size(), first_share = shares_.size();
  find_moved_pair(view, a, b, list);
  std::copy_n(changes, 2, list.changes);
  list.kept = same;
  if (!same) return;
  list.contacts.clear();
  append(contacts_, first, -int(first_share), list.contacts);
  list.shares.assign(shares_.begin() + std::ptrdiff_t(first_share), shares_.end());
}

// Those of samples of a in b, then of b in a. Makes the list anew where it is worn. A list that holds few
// candidates reaches farther when it is made again and so lasts longer; one that holds many reaches less far.
// What touches is the same for any reach.
template <class Real>
void SurfaceContacts<Real>::find_moved_pair(const LaneView<Real>& view, int a, int b, List& list) {
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

// The samples of a body that are near a box, in groups by tet. A group is in columns x, y and z that begin
// with a block of their own and are filled up with what is nowhere, so that kernels can take sixteen at a
// time. First the box of the tet decides, without looking at its samples, then the box of these.
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

// Sorts the groups into 32 slabs by their middles, along the longest axis of the box given: a counting
// sort. Half the largest group, slab_half_, is how much farther one has to look than where one is.
// group_boxes_ has the boxes of the groups in columns.
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

// The candidates of one direction, samples of `from` in cores of `into`, with their distances in the place
// of what they sleep until. The steps:
//
// - groups of samples near the box of `into`; cores near the box of these groups;
// - the largest bends among them, which widen all that follows by so much;
// - for each core: the groups whose boxes meet it (those of its slabs are asked), of these the samples,
//   each by the four planes of the core; its distance is what is left after the bends of its own tet and of
//   the core's;
// - a counting sort by sample, which keeps the tets of each ascending.
//
// Of a body with itself samples of tets that share a node with the core's tet do not count.
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
      need_core(view, tet);
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

// What other files call.
template void SurfaceContacts<float>::find_pair(const LaneView<float>&, NearPair&);
template void SurfaceContacts<double>::find_pair(const LaneView<double>&, NearPair&);

}  // namespace limber::fem::detail
