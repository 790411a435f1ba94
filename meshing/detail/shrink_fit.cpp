#include "meshing/detail/shrink_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "meshing/detail/tet_faces.h"

namespace limber::meshing::detail {
namespace {

// In the approach all vertices keep to a distance that falls from pass to pass, so that neighbours arrive
// together: one that rushed ahead would rest its faces on a bump and bar the way of the others. More passes
// gained under 1 % of volume.
constexpr int approach_passes = 8;
constexpr int final_passes = 6;
constexpr int tries_a_vertex = 2;  // passes without success after which a vertex rests

// Cosines of the sharpest and the widest dihedral of a tet, and its smallest height; {1, −1, 0} when its
// volume is not positive.
struct Shape {
  double sharpest, widest, height;
};

Shape shape_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  std::array<Vec3, 4> normal{bc.cross(bd), ad.cross(ac), ab.cross(ad), ac.cross(ab)};
  const double six_volumes = -normal[3].dot(ad);
  if (!(six_volumes > 0)) return {1, -1, 0};
  double twice_largest_area = 0;
  for (Vec3& n : normal) {
    const double twice_area = n.norm();
    twice_largest_area = std::max(twice_largest_area, twice_area);
    n /= twice_area;
  }
  Shape shape{-1, 1, six_volumes / twice_largest_area};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      const double cosine = -normal[i].dot(normal[j]);
      shape.sharpest = std::max(shape.sharpest, cosine);
      shape.widest = std::min(shape.widest, cosine);
    }
  return shape;
}

class Fitter {
 public:
  Fitter(const SurfaceTree& surface, const FitLimits& limits, TetMesh& mesh)
      : surface_(surface),
        mesh_(mesh),
        gap_(limits.gap_m),
        height_(limits.tets.min_height_m),
        // A hair inside the limits, so that whoever measures anew finds them kept whatever the rounding.
        sharpest_(std::cos(limits.tets.dihedrals.min_deg * radians) - 1e-9),
        widest_(std::cos(limits.tets.dihedrals.max_deg * radians) + 1e-9),
        boundary_(boundary_triangles(mesh.tets)),
        tets_(stars(mesh.tets, int(mesh.positions.rows()))),
        triangles_(stars(boundary_, int(mesh.positions.rows()))),
        failures_(std::size_t(mesh.positions.rows()), 0) {}

  int run() {
    double farthest = 0;
    for (int v = 0; v < mesh_.positions.rows(); ++v)
      if (on_boundary(v)) farthest = std::max(farthest, (at(v) - surface_.closest_point(at(v))).norm());
    int passes = 0;
    for (; passes < approach_passes; ++passes)
      make_pass(std::max(gap_, farthest * (1 - (passes + 1.0) / approach_passes)), false);
    std::fill(failures_.begin(), failures_.end(), 0);
    for (bool moved = true; moved && passes < approach_passes + final_passes; ++passes)
      moved = make_pass(gap_, true);
    return passes;
  }

 private:
  static constexpr double radians = std::numbers::pi / 180;

  Vec3 at(int v) const { return mesh_.positions.row(v); }
  std::span<const int> round(const Stars& s, int v) const {
    return {s.things.data() + s.first[v], s.things.data() + s.first[v + 1]};
  }
  bool on_boundary(int v) const { return !round(triangles_, v).empty(); }

  // A tet that is too low already must not get lower.
  bool keeps_limits(const Shape& shape, int t) const {
    if (shape.sharpest > sharpest_ || shape.widest < widest_) return false;
    return shape.height >= height_ || shape.height >= shape_now(t).height;
  }
  Shape shape_now(int t) const {
    return shape_of(at(mesh_.tets(t, 0)), at(mesh_.tets(t, 1)), at(mesh_.tets(t, 2)), at(mesh_.tets(t, 3)));
  }
  Shape shape_with(int t, int v, const Vec3& p) const {
    std::array<Vec3, 4> q;
    for (int k = 0; k < 4; ++k) q[k] = mesh_.tets(t, k) == v ? p : at(mesh_.tets(t, k));
    return shape_of(q[0], q[1], q[2], q[3]);
  }
  bool star_keeps_limits(int v, const Vec3& p) const {
    for (int t : round(tets_, v))
      if (!keeps_limits(shape_with(t, v, p), t)) return false;
    return true;
  }

  // A vertex moves only inwards of all its boundary triangles: what they sweep belonged to the cage, so the
  // cage cannot come to overlap itself. (Outward sweeps gained nothing, and made limbs overlap.)
  bool may_move(int v, const Vec3& to) const {
    if (!star_keeps_limits(v, to)) return false;
    const Vec3 from = at(v);
    for (int f : round(triangles_, v)) {
      const int k = boundary_(f, 0) == v ? 0 : boundary_(f, 1) == v ? 1 : 2;
      const Vec3 a = at(boundary_(f, (k + 1) % 3)), b = at(boundary_(f, (k + 2) % 3));
      if (orientation(from, a, b, to) > 0) return false;
      if (surface_.meets_tet(from, a, b, to)) return false;
    }
    return true;
  }

  bool make_pass(double aim, bool also_along_normal) {
    bool moved = false;
    for (int v = 0; v < mesh_.positions.rows(); ++v) {
      if (on_boundary(v))
        moved = draw_in(v, aim, also_along_normal) || moved;
      else
        relax(v);
    }
    return moved;
  }

  // Towards the surface until `aim` away from it; a vertex nearer than the gap moves off to the gap.
  bool draw_in(int v, double aim, bool also_along_normal) {
    if (failures_[v] >= tries_a_vertex) return false;
    const Vec3 from = at(v), nearest = surface_.closest_point(from);
    const double distance = (from - nearest).norm();
    if (!(distance > 0) || (distance > gap_ && distance < aim)) return false;
    const Vec3 step = (aim / distance - 1) * (from - nearest);
    if (step.norm() < 0.05 * gap_) return false;
    bool moved = move(v, step);
    if (!moved && also_along_normal) moved = move(v, -0.5 * step.norm() * normal(v));
    failures_[v] = moved ? 0 : failures_[v] + 1;
    return moved;
  }

  // The largest share of the step that is allowed.
  bool move(int v, const Vec3& step) {
    const Vec3 from = at(v);
    for (double share : {1.0, 0.5, 0.25, 0.1})
      if (may_move(v, from + share * step)) {
        mesh_.positions.row(v) = from + share * step;
        return true;
      }
    return false;
  }

  // Of length 1, outwards: against the way in which the volume falls fastest.
  Vec3 normal(int v) const {
    Vec3 sum = Vec3::Zero();
    for (int f : round(triangles_, v)) {
      const Vec3 a = at(boundary_(f, 0));
      sum += (at(boundary_(f, 1)) - a).cross(at(boundary_(f, 2)) - a);
    }
    return sum.normalized();
  }

  // To the middle of its neighbours, unless that makes its worst tet worse.
  void relax(int v) {
    Vec3 sum = Vec3::Zero();
    for (int t : round(tets_, v))
      for (int k = 0; k < 4; ++k)
        if (mesh_.tets(t, k) != v) sum += at(mesh_.tets(t, k));
    const Vec3 middle = sum / (3 * double(round(tets_, v).size()));
    if (worst_cosine(v, middle) <= worst_cosine(v, at(v)) && star_keeps_limits(v, middle))
      mesh_.positions.row(v) = middle;
  }

  double worst_cosine(int v, const Vec3& p) const {
    double worst = -1;
    for (int t : round(tets_, v)) {
      const Shape shape = shape_with(t, v, p);
      worst = std::max({worst, shape.sharpest, -shape.widest});
    }
    return worst;
  }

  const SurfaceTree& surface_;
  TetMesh& mesh_;
  double gap_, height_, sharpest_, widest_;
  Triangles boundary_;
  Stars tets_, triangles_;
  std::vector<int> failures_;
};

}  // namespace

int shrink_fit(const SurfaceTree& surface, const FitLimits& limits, TetMesh& mesh) {
  return Fitter(surface, limits, mesh).run();
}

}  // namespace limber::meshing::detail
