#include "meshing/detail/cut_search.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace limber::meshing::detail {

namespace {

// What all cuts of one part need. k parallel cuts cost two sweeps: one hull grows from below and one from
// above, and each tells its volume at every offset.
class Sweep {
 public:
  Sweep(const Model&, const Part&, InsideTest&);
  // `offsets` ascending. Keeps the best cut so far in `best`; true when it became better.
  bool try_offsets(const Vec3& direction, const std::vector<double>& offsets, Cut& best);
  std::pair<double, double> extent(const Vec3& direction) const;
  // The nearest points' offsets on both sides of `offset`: a cut through a vertex is often the exact one.
  std::vector<double> snapped(const Plane&) const;
  Vec3 middle_of_section(const Plane&) const;
  Eigen::Matrix3d principal_axes() const;

 private:
  void find_sections(const Vec3& direction, const std::vector<double>& offsets);
  struct Corner {
    Vec3 point;
    enum { unknown, inside, outside } where = unknown;
  };

  InsideTest& inside_;
  double volume_;
  std::vector<Vec3> candidates_;           // far first
  std::vector<Vec3> points_;               // all ends of edges
  std::vector<std::array<int, 2>> edges_;  // of the polygons, each once
  std::vector<std::array<Vec3, 2>> cell_edges_;
  GrowingHull hull_;
  // Scratch of try_offsets, an entry an offset (a slab for the points).
  std::vector<std::vector<Vec3>> slabs_, sections_;
  std::vector<std::vector<Corner>> corners_;
  std::vector<double> heights_;
};

Sweep::Sweep(const Model& model, const Part& part, InsideTest& inside)
    : inside_(inside), volume_(part.hull_volume), candidates_(hull_candidates(model, part)) {
  const std::vector<int> rows = points_of(part);
  for (int r : rows) points_.push_back(model.points[std::size_t(r)]);
  const auto local = [&](int r) { return int(std::lower_bound(rows.begin(), rows.end(), r) - rows.begin()); };
  for (int i = 0; i < part.surface.count(); ++i) {
    const int begin = part.surface.first[std::size_t(i)], end = part.surface.first[std::size_t(i) + 1];
    for (int k = begin; k < end; ++k) {
      const int a = part.surface.corners[std::size_t(k)];
      const int b = part.surface.corners[std::size_t(k + 1 < end ? k + 1 : begin)];
      edges_.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  for (auto& [a, b] : edges_) a = local(a), b = local(b);
  for (const Cell& cell : part.cells)
    for (const auto& face : cell.faces)
      for (std::size_t k = 0; k < face.size(); ++k) {
        const int a = face[k], b = face[(k + 1) % face.size()];
        if (a < b) cell_edges_.push_back({cell.corners[std::size_t(a)], cell.corners[std::size_t(b)]});
      }
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
  std::vector<Vec3> kept;
  for (const Flat& f : chain) kept.push_back(points[f.row]);
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
  hull_.clear();
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    hull_.add(slabs_[i]);
    add_section(i);
    below[i] = hull_.volume();
  }
  hull_.clear();
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

Eigen::Matrix3d Sweep::principal_axes() const {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points_) mean += p / double(points_.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points_) spread += (p - mean) * (p - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

std::vector<double> evenly(double low, double high, int count) {
  std::vector<double> offsets;
  for (int i = 0; i < count; ++i) offsets.push_back(low + (high - low) * (i + 1) / (count + 1));
  return offsets;
}

// Offsets about the best one, each time a third as far apart; at the end the vertices next to it.
void refine_offset(Sweep& sweep, double step, int rounds, Cut& best) {
  for (int round = 0; round < rounds; ++round, step /= 3) {
    const double t = best.plane.offset;
    sweep.try_offsets(best.plane.normal, {t - 2 * step / 3, t - step / 3, t + step / 3, t + 2 * step / 3},
                      best);
  }
  const std::vector<double> snapped = sweep.snapped(best.plane);
  if (!snapped.empty()) sweep.try_offsets(best.plane.normal, snapped, best);
}

std::vector<Vec3> first_directions(const Eigen::Matrix3d& principal_axes, bool diagonals) {
  std::vector<Vec3> directions;
  for (int i = 14; i < 27; ++i) {
    const Vec3 d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (diagonals || d.squaredNorm() == 1) directions.push_back(d.normalized());
  }
  for (int k = 0; k < 3; ++k) directions.push_back(principal_axes.col(k));
  return directions;
}

// The share of the hull that is solid, from a few hundred places.
double solid_share(const Part& part, InsideTest& inside) {
  GrowingHull hull;
  hull.add(part.hull);
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

}  // namespace

Cut best_cut(const Model& model, const Part& part, InsideTest& inside, const CutSearch& search) {
  Cut best;
  if (part.hull_volume <= 0) return best;
  Sweep sweep(model, part, inside);
  const std::vector<Vec3> directions = first_directions(sweep.principal_axes(), search.diagonals);
  double step = 0;
  for (const Vec3& direction : directions) {
    const auto [low, high] = sweep.extent(direction);
    if (sweep.try_offsets(direction, evenly(low, high, search.offsets), best))
      step = (high - low) / (search.offsets + 1);
  }
  if (best.gain <= 0) return best;
  refine_offset(sweep, step, search.refinements, best);

  double tilt = 0.2;  // radians
  for (int round = 0; round < search.tilt_rounds; ++round, tilt /= 2) {
    const Plane start = best.plane;
    const Vec3 pivot = sweep.middle_of_section(start);
    const Vec3 u = start.normal.unitOrthogonal(), v = start.normal.cross(u);
    bool better = false;
    for (const Vec3& towards : {u, Vec3(-u), v, Vec3(-v)}) {
      const Vec3 direction = (start.normal + std::tan(tilt) * towards).normalized();
      const double t = direction.dot(pivot);
      better = sweep.try_offsets(direction, {t - step / 2, t - step / 6, t + step / 6, t + step / 2}, best) ||
               better;
    }
    if (better) refine_offset(sweep, step / 3, 2, best);
  }
  return best;
}

Cut best_cut_ahead(const Model& model, const Part& part, InsideTest& inside, const CutSearch& search) {
  constexpr double little_gain = 0.12, much_empty = 0.3;
  Cut best = best_cut(model, part, inside, search);
  if (part.hull_volume <= 0 || best.gain > little_gain * part.hull_volume ||
      solid_share(part, inside) > 1 - much_empty)
    return best;
  const Sweep sweep(model, part, inside);
  std::vector<Plane> planes;
  if (best.gain > 0) planes.push_back(best.plane);
  for (const Vec3& direction : first_directions(sweep.principal_axes(), true)) {
    const auto [low, high] = sweep.extent(direction);
    planes.push_back({direction, 0.5 * (low + high)});
  }
  double largest = 0;
  Cut ahead = best;
  for (const Plane& plane : planes) {
    Model scratch = model;
    const auto [below, above] = cut(scratch, part, plane, inside);
    const CutSearch quick{.diagonals = false, .offsets = 5, .refinements = 0, .tilt_rounds = 0};
    const double gain = part.hull_volume - below.hull_volume - above.hull_volume +
                        best_cut(scratch, below, inside, quick).gain +
                        best_cut(scratch, above, inside, quick).gain;
    if (gain > largest) largest = gain, ahead = {plane, 0.5 * gain};
  }
  return ahead.gain > best.gain ? ahead : best;
}

Cut best_offset(const Model& model, const Part& part, InsideTest& inside, const Plane& plane, double range) {
  Cut best{plane, -1e300};
  Sweep sweep(model, part, inside);
  sweep.try_offsets(plane.normal, evenly(plane.offset - range, plane.offset + range, 5), best);
  return best;
}

}  // namespace limber::meshing::detail
