// Boundary labeling (Bekos, Kaufmann, Symvonis and Wolff, Computational Geometry 36, 2007) with straight
// lines and ends that move. Two columns of equal slots; a label takes one. The cost of an assignment is the
// length of all lines, over the moments, and a fine for each two that collide. From each label in the free
// slot nearest to its end on, the change that saves most is made, a label to a free slot or two that change
// places, until none saves. With ends that stand still, lines of one column that cross could be shorter.
#include "render/label_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace limber::render {

namespace {

using Vec2 = Eigen::Vector2d;

constexpr double pitch = 2.3, between = 1.2,
                 gap = 0.7;      // letters: of slots; subject and words; words and line
constexpr double fine = 2;       // heights of the picture
constexpr double outside = 0.7;  // the same, of a line that runs out of the picture's middle
constexpr int max_changes = 400;

double side_of(const Vec2& a, const Vec2& b, const Vec2& p) {
  return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

bool cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  return (side_of(a, b, c) > 0) != (side_of(a, b, d) > 0) && (side_of(c, d, a) > 0) != (side_of(c, d, b) > 0);
}

// Liang and Barsky.
bool passes(const Vec2& from, const Vec2& to, const Eigen::Vector4d& box) {
  double first = 0, last = 1;
  for (int i = 0; i < 2; ++i) {
    const double way = to[i] - from[i];
    double enters = (box[i] - from[i]) / way, leaves = (box[i + 2] - from[i]) / way;
    if (way == 0) {
      if (from[i] <= box[i] || from[i] >= box[i + 2]) return false;
      continue;
    }
    if (enters > leaves) std::swap(enters, leaves);
    first = std::max(first, enters), last = std::min(last, leaves);
  }
  return first < last;
}

struct Slot {
  double y;
  bool right;
};

}  // namespace

bool overlap(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

bool runs_through(const LabelPlace& label, const Vec2& end, const Eigen::Vector4d& box) {
  return passes(label.foot, end, box);
}

bool collide(const LabelPlace& one, const Vec2& end, const LabelPlace& other, const Vec2& other_end) {
  return cross(one.foot, end, other.foot, other_end) || passes(one.foot, end, other.box) ||
         passes(other.foot, other_end, one.box);
}

std::vector<std::optional<LabelPlace>> place_labels(const std::vector<WantedLabel>& labels,
                                                    const LabelRoom& room) {
  const double letter = room.letter_px, margin = room.width / 40.0, step = pitch * letter;
  double widest = 0;
  std::vector<double> moments_shown;
  for (const WantedLabel& label : labels) {
    const auto shown =
        std::count_if(label.ends.begin(), label.ends.end(), [](const auto& e) { return e.has_value(); });
    moments_shown.push_back(double(shown));
    if (shown > 0) widest = std::max(widest, label.width_px);
  }
  // Inner edges of the columns.
  const double left_edge = std::clamp(room.subject[0] - between * letter, margin + widest,
                                      std::max(margin + widest, 0.48 * room.width)),
               right_edge = std::clamp(room.subject[2] + between * letter,
                                       std::min(0.52 * room.width, room.width - margin - widest),
                                       room.width - margin - widest);
  const auto place_in = [&](const Slot& slot, double width_px) {
    LabelPlace place;
    place.left_px = slot.right ? right_edge : left_edge - width_px;
    place.baseline_px = slot.y + 0.5 * letter;
    place.foot = {slot.right ? right_edge - gap * letter : left_edge + gap * letter, slot.y};
    place.box = {place.left_px, slot.y - letter, place.left_px + width_px, slot.y + letter};
    return place;
  };
  std::vector<Slot> slots;
  for (double y = margin + letter; y + letter <= room.height - margin; y += step)
    for (const bool right : {false, true}) {
      const Eigen::Vector4d box = place_in({y, right}, widest).box;
      if (box[0] >= 0 && box[2] <= room.width &&
          std::none_of(room.taken.begin(), room.taken.end(), [&](const auto& b) { return overlap(box, b); }))
        slots.push_back({y, right});
    }

  // Those that get a slot: the ones shown most, of equals the first.
  std::vector<std::size_t> order(labels.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return moments_shown[a] > moments_shown[b]; });
  std::erase_if(order, [&](std::size_t l) { return moments_shown[l] == 0; });
  if (order.size() > slots.size()) order.resize(slots.size());
  std::sort(order.begin(), order.end());

  const int count = int(order.size());
  std::vector<int> slot_of(std::size_t(count), -1), label_in(slots.size(), -1);
  const auto place_of = [&](int l, int slot) {
    return place_in(slots[std::size_t(slot)], labels[order[std::size_t(l)]].width_px);
  };
  const auto ends_of = [&](int l) -> const auto& { return labels[order[std::size_t(l)]].ends; };
  // Of its line; through other words, or its own, it is as bad as through another label's.
  const auto length_at = [&](int l, int slot) {
    const LabelPlace place = place_of(l, slot);
    double sum = 0;
    for (const auto& end : ends_of(l)) {
      if (!end) continue;
      sum += (*end - place.foot).norm();
      if (slots[std::size_t(slot)].right ? end->x() > place.foot.x() : end->x() < place.foot.x())
        sum += outside * room.height;
      const auto passed = std::count_if(room.taken.begin(), room.taken.end(),
                                        [&](const auto& box) { return passes(place.foot, *end, box); });
      sum += fine * room.height * double(passed + int(passes(place.foot, *end, place.box)));
    }
    return sum;
  };
  const std::size_t pairs = std::size_t(count) * slots.size();
  std::vector<float> known(pairs * pairs, -1);
  const auto fines_of = [&](int l, int slot, int other, int other_slot) -> double {
    if (l > other) std::swap(l, other), std::swap(slot, other_slot);
    float& fines = known[(std::size_t(l) * slots.size() + std::size_t(slot)) * pairs +
                         std::size_t(other) * slots.size() + std::size_t(other_slot)];
    if (fines >= 0) return fines;
    const LabelPlace one = place_of(l, slot), two = place_of(other, other_slot);
    const auto &ends = ends_of(l), &other_ends = ends_of(other);
    int collisions = 0;
    for (std::size_t m = 0; m < ends.size(); ++m)
      collisions += int(ends[m] && other_ends[m] && collide(one, *ends[m], two, *other_ends[m]));
    return fines = float(fine * room.height * collisions);
  };
  for (int l = 0; l < count; ++l) {
    double best = std::numeric_limits<double>::infinity();
    for (int s = 0; s < int(slots.size()); ++s)
      if (label_in[std::size_t(s)] < 0)
        if (const double length = length_at(l, s); length < best) best = length, slot_of[std::size_t(l)] = s;
    label_in[std::size_t(slot_of[std::size_t(l)])] = l;
  }
  // What a label costs in a slot beside all others, but for one.
  const auto cost_at = [&](int l, int slot, int but) {
    double cost = length_at(l, slot);
    for (int other = 0; other < count; ++other)
      if (other != l && other != but) cost += fines_of(l, slot, other, slot_of[std::size_t(other)]);
    return cost;
  };
  for (int change = 0; change < max_changes; ++change) {
    double most = 1e-6 * room.height;
    int mover = -1, to = -1;
    for (int l = 0; l < count; ++l) {
      const int here = slot_of[std::size_t(l)];
      const double now = cost_at(l, here, -1);
      for (int s = 0; s < int(slots.size()); ++s) {
        const int other = label_in[std::size_t(s)];
        if (s == here || (other >= 0 && other < l)) continue;
        double saved = 0;
        if (other < 0) {
          saved = now - cost_at(l, s, -1);
        } else {
          saved = cost_at(l, here, other) + cost_at(other, s, l) + fines_of(l, here, other, s) -
                  cost_at(l, s, other) - cost_at(other, here, l) - fines_of(l, s, other, here);
        }
        if (saved > most) most = saved, mover = l, to = s;
      }
    }
    if (mover < 0) break;
    const int from = slot_of[std::size_t(mover)], other = label_in[std::size_t(to)];
    label_in[std::size_t(from)] = other, label_in[std::size_t(to)] = mover;
    slot_of[std::size_t(mover)] = to;
    if (other >= 0) slot_of[std::size_t(other)] = from;
  }
  std::vector<std::optional<LabelPlace>> places(labels.size());
  for (int l = 0; l < count; ++l) places[order[std::size_t(l)]] = place_of(l, slot_of[std::size_t(l)]);
  return places;
}

}  // namespace limber::render
