// Tubes and rods along a curve: surface and cage by sweeping circles.
//
// The curve is the centripetal Catmull-Rom spline through the given points (Yuksel, Schaefer, Keyser 2011),
// which has no loops and overshoots little. Its frames are carried along by double reflection (Wang, Jüttler,
// Zheng, Liu 2008), so that nothing twists. The cage is a grid swept likewise, with fewer sections. Between
// two of them it is ruled, and the surface bulges out of it where the curve bends; so its outer radius is
// larger, and its inner one smaller, by as much as that is at most. A curve that ends where it begins is
// closed: a ring, whose frames are turned along it until the last is the first.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "scenes/detail/five_tets.h"
#include "scenes/detail/surface_builder.h"
#include "scenes/shapes.h"

namespace limber::scenes {

namespace {

constexpr double pi = std::numbers::pi;

struct Frame {
  Vec3 place, tangent, normal, binormal;  // n × b = t
  Vec3 at(double radius, double angle) const {
    return place + radius * (std::cos(angle) * normal + std::sin(angle) * binormal);
  }
};

class Curve {
 public:
  explicit Curve(const std::vector<Vec3>& path) : closed_(is_closed(path)) {
    LIMBER_CHECK(path.size() >= 2, path.size());
    const Vec3 before_last = path[path.size() - 2];
    std::vector<Vec3> points{closed_ ? before_last : Vec3(2 * path[0] - path[1])};
    points.insert(points.end(), path.begin(), path.end());
    points.push_back(closed_ ? path[1] : Vec3(2 * path.back() - before_last));
    for (std::size_t i = 1; i + 2 < points.size(); ++i)
      for (int k = 0; k < samples_a_span; ++k) add(span(&points[i - 1], double(k) / samples_a_span));
    add(path.back());
    set_frames();
  }

  double length() const { return along_.back(); }
  bool closed() const { return closed_; }
  // Beyond its ends an open curve goes on straight.
  Frame at(double s) const {
    const auto next = std::upper_bound(along_.begin() + 1, along_.end() - 1, s);
    const std::size_t b = std::size_t(next - along_.begin()), a = b - 1;
    const double t = (s - along_[a]) / (along_[b] - along_[a]), in = std::clamp(t, 0.0, 1.0);
    Frame f;
    f.tangent = ((1 - in) * frames_[a].tangent + in * frames_[b].tangent).normalized();
    f.normal = (1 - in) * frames_[a].normal + in * frames_[b].normal;
    f.normal = (f.normal - f.normal.dot(f.tangent) * f.tangent).normalized();
    f.binormal = f.tangent.cross(f.normal);
    f.place =
        (1 - in) * frames_[a].place + in * frames_[b].place + (t - in) * (along_[b] - along_[a]) * f.tangent;
    return f;
  }
  // The least radius of the circles through three neighbouring samples.
  double min_radius() const {
    double least = std::numeric_limits<double>::infinity();
    const std::size_t last = frames_.size() - 1;
    for (std::size_t i = closed_ ? 0 : 1; i < last; ++i) {
      const Vec3 a = frames_[i].place - frames_[i == 0 ? last - 1 : i - 1].place,
                 b = frames_[i + 1].place - frames_[i].place;
      const double twice_area = a.cross(b).norm();
      if (twice_area > 0) least = std::min(least, a.norm() * b.norm() * (a + b).norm() / (2 * twice_area));
    }
    return least;
  }

 private:
  static constexpr int samples_a_span = 64;

  // Barry and Goldman's pyramid, with knots √|Pᵢ₊₁ − Pᵢ| apart.
  static Vec3 span(const Vec3* p, double share) {
    double knot[4] = {0};
    for (int i = 0; i < 3; ++i) knot[i + 1] = knot[i] + std::sqrt((p[i + 1] - p[i]).norm());
    const double t = knot[1] + share * (knot[2] - knot[1]);
    std::array<Vec3, 4> q{p[0], p[1], p[2], p[3]};
    const auto mix = [&](int i, int low, int high) {
      const double w = (t - knot[low]) / (knot[high] - knot[low]);
      return Vec3((1 - w) * q[std::size_t(i)] + w * q[std::size_t(i) + 1]);
    };
    for (int i = 0; i < 3; ++i) q[std::size_t(i)] = mix(i, i, i + 1);
    for (int i = 0; i < 2; ++i) q[std::size_t(i)] = mix(i, i, i + 2);
    return mix(0, 1, 2);
  }

  void add(const Vec3& p) {
    along_.push_back(frames_.empty() ? 0 : along_.back() + (p - frames_.back().place).norm());
    frames_.push_back({p, Vec3::Zero(), Vec3::Zero(), Vec3::Zero()});
  }

  void set_frames() {
    const std::size_t n = frames_.size();
    const std::size_t after_last = closed_ ? 1 : n - 1, before_first = closed_ ? n - 2 : 0;
    for (std::size_t i = 0; i < n; ++i)
      frames_[i].tangent =
          (frames_[i == n - 1 ? after_last : i + 1].place - frames_[i == 0 ? before_first : i - 1].place)
              .normalized();
    const Vec3 t = frames_[0].tangent;
    int least = 0;
    t.cwiseAbs().minCoeff(&least);
    frames_[0].normal = t.cross(Vec3::Unit(least)).normalized();
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Vec3 v1 = frames_[i + 1].place - frames_[i].place;
      const auto reflected = [](const Vec3& x, const Vec3& v) {
        return Vec3(x - 2 / v.dot(v) * v.dot(x) * v);
      };
      const Vec3 normal = reflected(frames_[i].normal, v1), tangent = reflected(frames_[i].tangent, v1);
      const Vec3 v2 = frames_[i + 1].tangent - tangent;
      frames_[i + 1].normal = v2.squaredNorm() > 1e-24 ? reflected(normal, v2) : normal;
    }
    if (!closed_) return;
    const Vec3 from = frames_.back().normal, to = frames_[0].normal;
    const double turn = std::atan2(from.cross(to).dot(t), from.dot(to));
    for (std::size_t i = 0; i < n; ++i)
      frames_[i].normal =
          Eigen::AngleAxisd(turn * along_[i] / length(), frames_[i].tangent) * frames_[i].normal;
  }

  bool closed_;
  std::vector<Frame> frames_;
  std::vector<double> along_;  // way from the beginning
};

struct Ring {
  double along, radius;
};

// From pole to pole, the poles left out: half a ball at each end.
std::vector<Ring> rings_of_rod(double length, double radius, double longest) {
  std::vector<Ring> rings;
  const int arc = std::max(4, pieces(pi / 2 * radius, longest)),
            straight = pieces(std::max(0.0, length - 2 * radius), longest);
  const auto cap = [&](int i, bool last) {
    const double angle = pi / 2 * i / arc, in = radius * (1 - std::cos(angle));
    rings.push_back({last ? length - in : in, radius * std::sin(angle)});
  };
  for (int i = 1; i <= arc; ++i) cap(i, false);
  for (int i = 1; i < straight; ++i) rings.push_back({radius + (length - 2 * radius) * i / straight, radius});
  for (int i = arc; i >= 1; --i) cap(i, true);
  return rings;
}

std::vector<Ring> rings_of_loop(double length, double radius, double longest) {
  std::vector<Ring> rings(std::size_t(std::max(12, pieces(length, longest))));
  for (std::size_t i = 0; i < rings.size(); ++i)
    rings[i] = {length * double(i) / double(rings.size()), radius};
  return rings;
}

// Outside, over a round rim, back inside, over the other rim.
std::vector<Ring> rings_of_tube(double length, double radius, double wall, double longest) {
  std::vector<Ring> rings;
  const double w = wall / 2;
  const int arc = std::max(6, pieces(pi * w, longest)), straight = pieces(length - 2 * w, longest);
  const auto rim = [&](double at, double sign) {
    for (int i = 0; i <= arc; ++i) {
      const double angle = pi * i / arc;
      rings.push_back({at + sign * w * std::sin(angle), radius - w + sign * w * std::cos(angle)});
    }
  };
  const auto side = [&](double from, double to, double r) {
    for (int i = 1; i < straight; ++i) rings.push_back({from + (to - from) * i / straight, r});
  };
  side(w, length - w, radius);
  rim(length - w, 1);
  side(length - w, w, radius - wall);
  rim(w, -1);
  return rings;
}

// By how much the swept circle of that radius leaves the ruled surface between two sections, at most.
double bulge(const Curve& curve, double from, double to, double radius) {
  constexpr int between = 8, round = 12;
  const Frame a = curve.at(from), b = curve.at(to);
  double most = 0;
  for (int i = 1; i < between; ++i) {
    const double t = double(i) / between;
    const Frame f = curve.at((1 - t) * from + t * to);
    for (int k = 0; k < round; ++k) {
      const double angle = 2 * pi * k / round;
      most = std::max(most,
                      (f.at(radius, angle) - (1 - t) * a.at(radius, angle) - t * b.at(radius, angle)).norm());
    }
  }
  return most;
}

// Nodes of one section, [j][i] or [ring][i], in the plane of the circle: radius and angle.
struct Section {
  int columns, rows;  // nodes
  bool round;         // the columns go round, and the last is beside the first
  std::vector<std::array<double, 2>> nodes;
};

// A square grid laid on the disc (Shirley and Chiu 1997), whose outer ring has 4 n nodes round the circle.
Section section_of_rod(int n, double radius) {
  Section section{n + 1, n + 1, false, {}};
  const double outer = radius / std::cos(pi / (4 * n));
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double u = 2.0 * i / n - 1, v = 2.0 * j / n - 1, k = std::max(std::abs(u), std::abs(v));
      const double angle = k == 0                       ? 0
                           : std::abs(u) >= std::abs(v) ? pi / 4 * v / u + (u < 0 ? pi : 0)
                                                        : pi / 2 - pi / 4 * u / v + (v < 0 ? pi : 0);
      section.nodes.push_back({outer * k, angle});
    }
  return section;
}

Section section_of_tube(int round, int through, double inner, double radius) {
  Section section{round, through + 1, true, {}};
  const double outer = radius / std::cos(pi / round);
  for (int j = 0; j <= through; ++j)
    for (int i = 0; i < round; ++i)
      section.nodes.push_back({inner + (outer - inner) * j / through, 2 * pi * i / round});
  return section;
}

// Whether a tet of a cell whose axes are right-handed has negative volume. Round, out and along are
// left-handed.
bool is_mirrored(const int (&corners)[4]) {
  const auto p = [&](int c) { return Vec3(corners[c] & 1, corners[c] >> 1 & 1, corners[c] >> 2); };
  return signed_volume(p(0), p(1), p(2), p(3)) < 0;
}

int vertices_round(const TubeModel& tube) {
  return std::max(12, pieces(pi * tube.diameter_m, tube.triangle_m));
}

}  // namespace

bool is_closed(const std::vector<Vec3>& path) { return path.size() > 2 && path.front() == path.back(); }
double min_bend_radius_m(const TubeModel& tube) { return Curve(tube.path_m).min_radius(); }
double length_m(const TubeModel& tube) { return Curve(tube.path_m).length(); }

SurfaceMesh make_tube(const TubeModel& tube) {
  const Curve curve(tube.path_m);
  const double radius = tube.diameter_m / 2;
  const bool hollow = tube.wall_m > 0, ends = !hollow && !curve.closed();
  LIMBER_CHECK(!(hollow && curve.closed()), tube.wall_m);
  const std::vector<Ring> rings = hollow ? rings_of_tube(curve.length(), radius, tube.wall_m, tube.triangle_m)
                                  : ends ? rings_of_rod(curve.length(), radius, tube.triangle_m)
                                         : rings_of_loop(curve.length(), radius, tube.triangle_m);
  const int round = vertices_round(tube);
  SurfaceBuilder builder;
  for (const Ring& ring : rings) {
    const Frame frame = curve.at(ring.along);
    for (int i = 0; i < round; ++i) builder.add(frame.at(ring.radius, 2 * pi * i / round));
  }
  const int count = int(rings.size());
  const auto vertex = [&](int ring, int i) { return ring % count * round + i % round; };
  for (int ring = 0; ring < (ends ? count - 1 : count); ++ring)
    for (int i = 0; i < round; ++i)
      builder.quad(vertex(ring, i), vertex(ring, i + 1), vertex(ring + 1, i + 1), vertex(ring + 1, i),
                   (ring + i) % 2);
  if (ends)
    for (const bool last : {false, true}) {
      const int pole = builder.add(curve.at(last ? curve.length() : 0).place), ring = last ? count - 1 : 0;
      for (int i = 0; i < round; ++i)
        builder.triangles.emplace_back(pole, vertex(ring, last ? i : i + 1), vertex(ring, last ? i + 1 : i));
    }
  return builder.mesh();
}

namespace {

// The cage whose outer radius is larger, and whose inner one smaller, by `margin`.
TetMesh swept_cage(const TubeModel& tube, const Curve& curve, const Eigen::Vector3i& cells, double margin) {
  const double length = curve.length(), radius = tube.diameter_m / 2;
  const bool hollow = tube.wall_m > 0;
  // Chords of the surface's inner circles come nearer to the middle than their ends.
  const double inner = (radius - tube.wall_m) * std::cos(pi / vertices_round(tube)) - margin;
  if (hollow && !(inner > margin))
    throw InputError(
        fmt::format("cells = [{}, {}, {}] are too few along the tube for how it bends: its cage "
                    "would close the lumen; write more along it",
                    cells[0], cells[1], cells[2]));
  const Section section = hollow ? section_of_tube(cells[0], cells[1], inner, radius + margin)
                                 : section_of_rod(cells[0], radius + margin);
  const int a_section = int(section.nodes.size());
  const int sections = curve.closed() ? cells[2] : cells[2] + 1;
  TetMesh cage{Points(Eigen::Index(a_section) * sections, 3), Tets()};
  for (int k = 0; k < sections; ++k) {
    const double beyond = curve.closed() ? 0 : k == 0 ? -margin : k == cells[2] ? margin : 0;
    const Frame frame = curve.at(length * k / cells[2] + beyond);
    for (int n = 0; n < a_section; ++n)
      cage.positions.row(Eigen::Index(k) * a_section + n) =
          frame.at(section.nodes[std::size_t(n)][0], section.nodes[std::size_t(n)][1]);
  }
  const int columns = section.round ? section.columns : section.columns - 1, rows = section.rows - 1;
  cage.tets.resize(Eigen::Index(5) * columns * rows * cells[2], 4);
  Eigen::Index t = 0;
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        for (const auto& corners : five_tets[(i + j + k) % 2]) {
          Eigen::RowVector4i tet;
          for (int c = 0; c < 4; ++c)
            tet[c] = (k + (corners[c] >> 2)) % sections * a_section +
                     (j + (corners[c] >> 1 & 1)) * section.columns + (i + (corners[c] & 1)) % section.columns;
          if (is_mirrored(corners) != section.round) std::swap(tet[2], tet[3]);
          const auto p = [&](int c) -> Vec3 { return cage.positions.row(tet[c]); };
          if (!(signed_volume(p(0), p(1), p(2), p(3)) > 0))
            throw InputError(
                fmt::format("the tube bends so sharply {:.3g} m along it that cells = [{}, {}, {}] "
                            "fold; make it thinner, move its points apart, or write more cells",
                            length * (k + 0.5) / cells[2], cells[0], cells[1], cells[2]));
          cage.tets.row(t++) = tet;
        }
  return cage;
}

// Whether all points are in the cage. Neighbours are likely in tets of near numbers, so the search for each
// begins a little before that of the one before it.
bool holds(const TetMesh& cage, const Points& points, Eigen::Index a_little) {
  const Eigen::Index tets = cage.tets.rows();
  const auto is_in = [&](const Vec3& p, Eigen::Index t) {
    Vec3 q[4];
    for (int c = 0; c < 4; ++c) q[c] = cage.positions.row(cage.tets(t, c));
    for (int c = 0; c < 4; ++c) {
      const Vec3 corner = std::exchange(q[c], p);
      if (signed_volume(q[0], q[1], q[2], q[3]) < 0) return false;
      q[c] = corner;
    }
    return true;
  };
  Eigen::Index first = 0;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    Eigen::Index n = 0;
    while (n < tets && !is_in(points.row(v), (first + n) % tets)) ++n;
    if (n == tets) return false;
    first = (first + n + tets - std::min(a_little, tets)) % tets;
  }
  return true;
}

}  // namespace

// The margin is an estimate, so it grows where the surface leaves the cage.
TetMesh make_tube_cage(const TubeModel& tube, const Eigen::Vector3i& cells) {
  constexpr double growth = 1.15;
  const Curve curve(tube.path_m);
  const double length = curve.length(), radius = tube.diameter_m / 2;
  double margin = 0;
  for (int k = 0; k < cells[2]; ++k)
    for (const double r : {radius, radius - tube.wall_m})
      margin = std::max(margin, bulge(curve, length * k / cells[2], length * (k + 1) / cells[2], r));
  margin = 1.2 * margin + 1e-4 * radius;
  const Points surface = make_tube(tube).positions;
  TetMesh cage = swept_cage(tube, curve, cells, margin);  // ends in an error once its cells fold
  while (!holds(cage, surface, cage.tets.rows() / cells[2]))
    cage = swept_cage(tube, curve, cells, margin *= growth);
  return cage;
}

}  // namespace limber::scenes
