#include "meshing/detail/cut_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/random.h"
#include "core/threads.h"
#include "meshing/detail/sketch.h"

namespace limber::meshing::detail {

namespace {

// What all cuts of one part need. k parallel cuts cost two sweeps: one hull grows from below and one from
// above, and each tells its volume at every offset.
class Sweep {
 public:
  // Volumes are those of hulls that may lack `tolerance` of the part's extent.
  Sweep(const Sketch&, const Part&, InsideTest&, double tolerance);
  // For cuts that leave each point where `side` says below (−1) or above (1): their hulls are grown once, and
  // only the points between (0) are still to be sorted. A segment between two points on one side must stay
  // there.
  template <class Side>
  Sweep narrowed(Side side) const;
  // `offsets` ascending. Keeps the best cut so far in `best`; true when it became better.
  bool try_offsets(const Vec3& direction, const std::vector<double>& offsets, Cut& best);
  std::pair<double, double> extent(const Vec3& direction) const;
  // The nearest points' offsets on both sides of `offset`: a cut through a vertex is often the exact one.
  std::vector<double> snapped(const Plane&) const;
  Vec3 middle_of_section(const Plane&) const;

 private:
  void find_sections(const Vec3& direction, const std::vector<double>& offsets);
  struct Corner {
    Vec3 point;
    enum { unknown, inside, outside } where = unknown;
  };

  InsideTest& inside_;
  std::vector<Vec3> candidates_;           // those whose hull is the part's, far first
  std::vector<Vec3> points_;               // all ends of edges
  std::vector<std::array<int, 2>> edges_;  // of the polygons, each once
  std::vector<std::array<Vec3, 2>> cell_edges_;
  GrowingHull below_, above_;  // of the points whose side is known
  GrowingHull hull_;
  double volume_;  // of the hull of all
  // Scratch of try_offsets, an entry an offset (a slab for the points).
  std::vector<std::vector<Vec3>> slabs_, sections_;
  std::vector<std::vector<Corner>> corners_;
  std::vector<double> heights_;
};

Sweep::Sweep(const Sketch& sketch, const Part& part, InsideTest& inside, double tolerance)
    : inside_(inside), candidates_(part.corners_inside), points_(sketch.points), edges_(sketch.edges) {
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (!sketch.buried[i]) candidates_.push_back(points_[i]);
  sort_far_first(candidates_);
  hull_ = rough_hull(candidates_, tolerance);
  volume_ = hull_.volume();
  below_ = above_ = GrowingHull(hull_.tolerance());
  for (const Cell& cell : part.cells)
    for (const auto& face : cell.faces)
      for (std::size_t k = 0; k < face.size(); ++k) {
        const int a = face[k], b = face[(k + 1) % face.size()];
        if (a < b) cell_edges_.push_back({cell.corners[std::size_t(a)], cell.corners[std::size_t(b)]});
      }
}

template <class Side>
Sweep Sweep::narrowed(Side side) const {
  Sweep band(*this);
  band.candidates_.clear(), band.edges_.clear(), band.cell_edges_.clear();
  std::vector<Vec3> below, above;
  for (const Vec3& p : candidates_) {
    const int s = side(p);
    (s < 0 ? below : s > 0 ? above : band.candidates_).push_back(p);
  }
  band.below_.add(below), band.above_.add(above);
  std::vector<int> sides;
  for (const Vec3& p : points_) sides.push_back(side(p));
  for (const auto& [a, b] : edges_)
    if (sides[std::size_t(a)] * sides[std::size_t(b)] <= 0) band.edges_.push_back({a, b});
  for (const auto& [a, b] : cell_edges_)
    if (side(a) * side(b) <= 0) band.cell_edges_.push_back({a, b});
  return band;
}

// The corners of the convex hull of points in the plane across `direction` (Andrew's monotone chain).
void keep_planar_hull(const Vec3& direction, std::vector<Vec3>& points) {
  if (points.size() < 4) return;
  const Vec3 u = direction.unitOrthogonal(), v = direction.cross(u);
  struct Flat {
    double x, y;
    std::size_t row;
  };
  std::vector<Flat> flat(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) flat[i] = {u.dot(points[i]), v.dot(points[i]), i};
  std::sort(flat.begin(), flat.end(), [](const Flat& a, const Flat& b) {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.row < b.row)));
  });
  std::vector<Flat> chain;
  const auto walk = [&](auto begin, auto end) {
    const std::size_t base = chain.size();
    for (auto it = begin; it != end; ++it) {
      while (chain.size() >= base + 2) {
        const Flat &a = chain[chain.size() - 2], &b = chain.back();
        if ((b.x - a.x) * (it->y - a.y) - (b.y - a.y) * (it->x - a.x) > 0) break;
        chain.pop_back();
      }
      chain.push_back(*it);
    }
    chain.pop_back();
  };
  walk(flat.begin(), flat.end());
  walk(flat.rbegin(), flat.rend());
  // Every eighth first: of the others few are then far enough outside to matter.
  std::vector<Vec3> kept;
  for (std::size_t i = 0; i < chain.size(); i += 8) kept.push_back(points[chain[i].row]);
  for (std::size_t stride = 4; stride > 0; stride /= 2)
    for (std::size_t i = stride; i < chain.size(); i += 2 * stride) kept.push_back(points[chain[i].row]);
  points.swap(kept);
}

void Sweep::find_sections(const Vec3& direction, const std::vector<double>& offsets) {
  const std::size_t count = offsets.size();
  slabs_.resize(std::max(slabs_.size(), count + 1));
  sections_.resize(std::max(sections_.size(), count));
  corners_.resize(std::max(corners_.size(), count));
  for (auto& slab : slabs_) slab.clear();
  for (auto& section : sections_) section.clear();
  for (auto& corners : corners_) corners.clear();

  const auto first_above = [&](double height) {
    return std::size_t(std::lower_bound(offsets.begin(), offsets.end(), height) - offsets.begin());
  };
  for (const Vec3& p : candidates_) {
    const double height = direction.dot(p);
    const std::size_t slab = first_above(height - on_plane);
    slabs_[slab].push_back(p);
    if (slab < count && std::abs(height - offsets[slab]) <= on_plane) sections_[slab].push_back(p);
  }
  heights_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) heights_[i] = direction.dot(points_[i]);
  for (const auto& [a, b] : edges_) {
    const double ha = heights_[std::size_t(a)], hb = heights_[std::size_t(b)];
    const double low = std::min(ha, hb), high = std::max(ha, hb);
    // Ends on the plane are a vertex's affair, but only a vertex that is not left out: so they count here.
    for (std::size_t i = first_above(low - on_plane); i < count && offsets[i] <= high + on_plane; ++i) {
      const double t = high > low ? std::clamp((offsets[i] - ha) / (hb - ha), 0.0, 1.0) : 0.0;
      sections_[i].push_back(points_[std::size_t(a)] +
                             t * (points_[std::size_t(b)] - points_[std::size_t(a)]));
    }
  }
  for (std::size_t i = 0; i < count; ++i) keep_planar_hull(direction, sections_[i]);
  for (const auto& [a, b] : cell_edges_) {
    const double ha = direction.dot(a), hb = direction.dot(b);
    for (std::size_t i = first_above(std::min(ha, hb)); i < count && offsets[i] < std::max(ha, hb); ++i)
      corners_[i].push_back({a + (offsets[i] - ha) / (hb - ha) * (b - a)});
  }
}

bool Sweep::try_offsets(const Vec3& direction, const std::vector<double>& offsets, Cut& best) {
  find_sections(direction, offsets);
  const auto add_section = [&](std::size_t i) {
    hull_.add(sections_[i]);
    for (Corner& corner : corners_[i]) {
      if (corner.where == Corner::outside || hull_.holds(corner.point)) continue;
      if (corner.where == Corner::unknown)
        corner.where = inside_(corner.point) ? Corner::inside : Corner::outside;
      if (corner.where == Corner::inside) hull_.add(corner.point);
    }
  };
  std::vector<double> below(offsets.size());
  hull_ = below_;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    hull_.add(slabs_[i]);
    add_section(i);
    below[i] = hull_.volume();
  }
  hull_ = above_;
  bool better = false;
  for (std::size_t i = offsets.size(); i-- > 0;) {
    hull_.add(slabs_[i + 1]);
    add_section(i);
    const double gain = volume_ - below[i] - hull_.volume();
    if (gain > best.gain) {
      best = {{direction, offsets[i]}, gain};
      better = true;
    }
  }
  return better;
}

std::pair<double, double> Sweep::extent(const Vec3& direction) const {
  double low = 1e300, high = -1e300;
  for (const Vec3& p : candidates_) {
    low = std::min(low, direction.dot(p));
    high = std::max(high, direction.dot(p));
  }
  return {low, high};
}

std::vector<double> Sweep::snapped(const Plane& plane) const {
  double under = -1e300, over = 1e300;
  for (const Vec3& p : points_) {
    const double height = plane.normal.dot(p);
    if (height <= plane.offset) under = std::max(under, height);
    if (height >= plane.offset) over = std::min(over, height);
  }
  if (under < -1e299 || over > 1e299) return {};
  if (under == over) return {under};
  return {under, over};
}

Vec3 Sweep::middle_of_section(const Plane& plane) const {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (const auto& [a, b] : edges_) {
    const Vec3 &pa = points_[std::size_t(a)], &pb = points_[std::size_t(b)];
    const double ha = plane.normal.dot(pa) - plane.offset, hb = plane.normal.dot(pb) - plane.offset;
    if ((ha < 0) == (hb < 0)) continue;
    sum += pa + ha / (ha - hb) * (pb - pa);
    ++count;
  }
  return count > 0 ? Vec3(sum / count) : Vec3(plane.offset * plane.normal);
}

std::vector<double> evenly(double low, double high, int count) {
  std::vector<double> offsets;
  for (int i = 0; i < count; ++i) offsets.push_back(low + (high - low) * (i + 1) / (count + 1));
  return offsets;
}

// Offsets about the best one, each time a third as far apart; at the end the vertices next to it.
void refine_offset(const Sweep& sweep, double step, int rounds, Cut& best) {
  const Vec3 normal = best.plane.normal;
  const double middle = best.plane.offset, reach = step + on_plane;
  Sweep band = sweep.narrowed([&](const Vec3& p) {
    const double height = normal.dot(p) - middle;
    return height > reach ? 1 : height < -reach ? -1 : 0;
  });
  for (int round = 0; round < rounds; ++round, step /= 3) {
    const double t = best.plane.offset;
    band.try_offsets(normal, {t - 2 * step / 3, t - step / 3, t, t + step / 3, t + 2 * step / 3}, best);
  }
  std::vector<double> snapped = sweep.snapped(best.plane);
  std::erase_if(snapped, [&](double offset) { return std::abs(offset - middle) > reach; });
  if (!snapped.empty()) band.try_offsets(normal, snapped, best);
}

// Where the model has large flat faces (a machine, a piece of furniture) its concave edges lie in their
// planes.
std::vector<Vec3> normals_of_large_faces(const Model& model, const Part& part) {
  constexpr double large = 0.04;  // of the part's surface, all parallel faces together
  constexpr double same = 1e-4;
  constexpr std::size_t most = 4;
  std::map<std::array<long, 3>, Vec3> by_normal;  // sums of area vectors, each turned to one side
  double total = 0;
  for (int i = 0; i < part.surface.count(); ++i) {
    const Vec3 face = area_vector(model, part.surface, i);
    const double size = face.norm();
    if (!(size > 0)) continue;
    total += size;
    std::array<long, 3> key;
    int axis = 0;
    face.cwiseAbs().maxCoeff(&axis);
    const Vec3 turned = face[axis] < 0 ? Vec3(-face) : face;
    for (int k = 0; k < 3; ++k) key[std::size_t(k)] = std::lround(turned[k] / size / same);
    by_normal.try_emplace(key, Vec3::Zero()).first->second += turned;
  }
  std::vector<std::pair<double, Vec3>> found;
  for (const auto& [key, sum] : by_normal)
    if (sum.norm() > large * total) found.emplace_back(-sum.norm(), sum.normalized());
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Vec3> normals;
  for (const auto& [size, normal] : found)
    if (normals.size() < most) normals.push_back(normal);
  return normals;
}

// Those to the faces, edges and corners of a cube, the principal axes, and the normals of large flat faces.
std::vector<Vec3> first_directions(const Model& model, const Part& part, const Sketch& sketch,
                                   bool diagonals) {
  std::vector<Vec3> directions;
  for (int i = 14; i < 27; ++i) {
    const Vec3 d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (diagonals || d.squaredNorm() == 1) directions.push_back(d.normalized());
  }
  const Eigen::Matrix3d axes = principal_axes(sketch.points);
  for (int k = 0; k < 3; ++k) directions.push_back(axes.col(k));
  const std::size_t others = directions.size();
  for (const Vec3& normal : normals_of_large_faces(model, part))
    if (std::none_of(directions.begin(), directions.begin() + std::ptrdiff_t(others),
                     [&](const Vec3& d) { return d.cross(normal).norm() < 1e-9; }))
      directions.push_back(normal);
  return directions;
}

// The share of the hull that is solid, from a few hundred places.
double solid_share(const Part& part, InsideTest& inside) {
  const GrowingHull hull = rough_hull(part.hull, search_tolerance);
  Box box;
  for (const Vec3& p : part.hull) box.include(p);
  Rng rng(1, 0);
  int in_hull = 0, in_solid = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = box.lower + box.size().cwiseProduct(Vec3(rng.uniform(), rng.uniform(), rng.uniform()));
    if (!hull.holds(p)) continue;
    ++in_hull;
    in_solid += inside(p);
  }
  return in_hull > 0 ? double(in_solid) / in_hull : 1.0;
}

// The search is on a coarse sketch for all directions, then on a fine one for the best. 8,000 fine points
// cost an eighth more and gained nothing that could be told from chance.
constexpr int coarse_points = 500, fine_points = 3000;
// Of hulls, as a share of the part's thickness.
constexpr double coarse_tolerance = 2e-3, fine_tolerance = 6e-4;
// So few points cost little, and offsets through vertices that are right or wrong (a machine) must be told
// apart.
constexpr double small_tolerance = 1e-6;

// The best even offset for each direction, best first, on a coarse sketch.
struct Start {
  Cut cut;
  double step = 0;  // between the offsets
};
std::vector<Start> first_cuts(Sweep& sweep, const std::vector<Vec3>& directions, int offsets) {
  std::vector<Start> starts;
  for (const Vec3& direction : directions) {
    const auto [low, high] = sweep.extent(direction);
    Start start{{}, (high - low) / (offsets + 1)};
    if (sweep.try_offsets(direction, evenly(low, high, offsets), start.cut)) starts.push_back(start);
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Start& a, const Start& b) { return a.cut.gain > b.cut.gain; });
  return starts;
}

// Turns the best cut about the middle of its section, four ways, each time half as far.
void tilt(const Sweep& sweep, double step, int rounds, Cut& best) {
  double slope = 0.2;
  for (int round = 0; round < rounds; ++round, slope /= 2) {
    const Vec3 normal = best.plane.normal, u = normal.unitOrthogonal(), v = normal.cross(u);
    const Vec3 pivot = sweep.middle_of_section(best.plane);
    // Of the turned planes about the pivot none is steeper than `slope`, and none moved by more than step
    // / 2.
    Sweep band = sweep.narrowed([&](const Vec3& p) {
      const double height = normal.dot(p - pivot);
      const double reach = slope * (p - pivot - height * normal).norm() + step * std::hypot(1.0, slope) / 2;
      return height > reach + on_plane ? 1 : height < -reach - on_plane ? -1 : 0;
    });
    bool better = false;
    for (const Vec3& towards : {u, Vec3(-u), v, Vec3(-v)}) {
      const Vec3 direction = (normal + slope * towards).normalized();
      const double t = direction.dot(pivot);
      better = band.try_offsets(direction, {t - step / 2, t - step / 6, t + step / 6, t + step / 2}, best) ||
               better;
    }
    if (better) refine_offset(sweep, step / 3, 2, best);
  }
}

// Good enough to tell how much the next cut will gain.
double quick_gain(const Model& model, const Part& part, InsideTest& inside) {
  if (part.hull_volume <= 0) return 0;
  const Sketch sketch = sketch_of(model, part, coarse_points);
  Sweep sweep(sketch, part, inside, coarse_tolerance);
  const std::vector<Start> starts = first_cuts(sweep, first_directions(model, part, sketch, false), 5);
  return starts.empty() ? 0.0 : starts[0].cut.gain;
}

// What a cut gains with the next ones on either side.
double gain_with_next(const Model& model, const Part& part, const Plane& plane, InsideTest& inside) {
  Model scratch = model;
  const auto [below, above] = cut(scratch, part, plane, inside);
  return part.hull_volume - below.hull_volume - above.hull_volume + quick_gain(scratch, below, inside) +
         quick_gain(scratch, above, inside);
}

}  // namespace

Cut best_cut(const Model& model, const Part& part, InsideTest& inside) {
  constexpr int offsets = 12, refinements = 3, tilt_rounds = 3;
  constexpr std::size_t directions_to_refine = 3;
  if (part.hull_volume <= 0) return {};
  const Sketch fine = sketch_of(model, part, fine_points), coarse = thinned(fine, coarse_points);
  Sweep coarse_sweep(coarse, part, inside, coarse_tolerance);
  std::vector<Start> starts = first_cuts(coarse_sweep, first_directions(model, part, fine, true), offsets);
  starts.resize(std::min(starts.size(), directions_to_refine));
  const bool small = int(fine.points.size()) <= coarse_points;
  const Sweep sweep(fine, part, inside, small ? small_tolerance : fine_tolerance);
  std::vector<Cut> refined(starts.size());
  parallel_for(int(starts.size()), [&](int i) {
    Cut& cut = refined[std::size_t(i)];
    cut = {starts[std::size_t(i)].cut.plane, 0};  // the gain on the coarse sketch is another
    refine_offset(sweep, starts[std::size_t(i)].step, refinements, cut);
  });
  Cut best;
  double step = 0;
  for (std::size_t i = 0; i < starts.size(); ++i)
    if (refined[i].gain > best.gain) best = refined[i], step = starts[i].step;
  if (best.gain > 0) tilt(sweep, step, tilt_rounds, best);
  return best;
}

Cut best_cut_ahead(const Model& model, const Part& part, InsideTest& inside) {
  constexpr double little_gain = 0.12, much_empty = 0.3;
  const Cut best = best_cut(model, part, inside);
  if (part.hull_volume <= 0 || best.gain > little_gain * part.hull_volume ||
      solid_share(part, inside) > 1 - much_empty)
    return best;
  const Sketch sketch = sketch_of(model, part, coarse_points);
  const Sweep sweep(sketch, part, inside, coarse_tolerance);
  std::vector<Plane> planes;
  if (best.gain > 0) planes.push_back(best.plane);
  for (const Vec3& direction : first_directions(model, part, sketch, true)) {
    const auto [low, high] = sweep.extent(direction);
    planes.push_back({direction, 0.5 * (low + high)});
  }
  std::vector<double> gains(planes.size());
  parallel_for(int(planes.size()), [&](int i) {
    gains[std::size_t(i)] = gain_with_next(model, part, planes[std::size_t(i)], inside);
  });
  Cut ahead = best;
  for (std::size_t i = 0; i < planes.size(); ++i)
    if (0.5 * gains[i] > ahead.gain) ahead = {planes[i], 0.5 * gains[i], true};
  return ahead;
}

Plane cut_through(const Model& model, const Part& part, const Vec3& point, const Vec3& outwards,
                  InsideTest& inside) {
  constexpr int turns = 6;
  constexpr double same_gain = 1e-3;  // of the hull's volume
  struct Tried {
    double gain, length;
    Plane plane;
  };
  std::vector<Tried> tried(turns);
  const Vec3 u = outwards.unitOrthogonal(), v = outwards.cross(u);
  parallel_for(turns, [&](int turn) {
    const double angle = std::numbers::pi * turn / turns;
    const Vec3 normal = std::cos(angle) * u + std::sin(angle) * v;
    double low = 1e300, high = -1e300;
    for (const Vec3& p : part.hull) low = std::min(low, normal.dot(p)), high = std::max(high, normal.dot(p));
    const Plane plane{normal, normal.dot(point)};
    tried[std::size_t(turn)] = {gain_with_next(model, part, plane, inside), high - low, plane};
  });
  double most = 0;
  for (const Tried& one : tried) most = std::max(most, one.gain);
  std::erase_if(tried, [&](const Tried& one) { return one.gain < most - same_gain * part.hull_volume; });
  return std::max_element(tried.begin(), tried.end(),
                          [](const Tried& a, const Tried& b) { return a.length < b.length; })
      ->plane;
}

}  // namespace limber::meshing::detail
