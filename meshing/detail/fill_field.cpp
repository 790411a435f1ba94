#include "meshing/detail/fill_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/progress.h"
#include "core/threads.h"
#include "meshing/detail/nearest_on_triangle.h"
#include "meshing/detail/surface_spots.h"

namespace limber::meshing::detail {

namespace {

constexpr double near_cells = 1.2;  // within which distances are exact
constexpr double largest_value = 32'000;
constexpr double spots_a_cell = 4, max_spots = 2e6;  // a face of a cell; to fit the field to
constexpr int fitting_steps = 4;

class Filler {
 public:
  Filler(const SeenSurface& surface, const DistanceField& grid)
      : pieces_(surface.pieces),
        lower_(grid.lower_m),
        cell_(grid.cell_m),
        nodes_(grid.nodes),
        step_{1, nodes_[0], std::ptrdiff_t(nodes_[0]) * nodes_[1]},
        distance_(std::size_t(step_[2]) * nodes_[2], 1e100),
        nearest_(distance_.size(), -1) {}

  // Of the nodes round each piece.
  void measure_near() {
    const double reach = near_cells * cell_;
    clear_.assign(distance_.size(), float(reach));
    // Slabs of nodes at once, each with its pieces in order.
    constexpr int slab = 4;  // nodes high
    std::vector<std::vector<int>> pieces_of_slab(std::size_t((nodes_[2] + slab - 1) / slab));
    for (int n = 0; n < int(pieces_.size()); ++n) {
      const auto [from, to] = nodes_round(pieces_[std::size_t(n)], reach, 2);
      for (int s = from / slab; s <= to / slab && from <= to; ++s)
        pieces_of_slab[std::size_t(s)].push_back(n);
    }
    parallel_for(int(pieces_of_slab.size()), [&](int s) {
      for (const int n : pieces_of_slab[std::size_t(s)]) {
        throw_if_stopped();
        measure_round(n, reach, slab * s, slab * (s + 1) - 1);
      }
    });
    fixed_.assign(distance_.size(), 0);
    for (auto& unsaid : unsaid_) unsaid.assign(distance_.size(), 0);
    for (std::size_t n = 0; n < fixed_.size(); ++n)
      if (nearest_[n] >= 0) fixed_[n] = 1, to_say(n);
  }

  // A node takes the nearest piece of a neighbour where that is nearer than its own, in sweeps that run each
  // of the eight ways (the fast sweeping of Zhao, Mathematics of Computation 74, 2005, with pieces for
  // distances). What a node has said to a neighbour it does not say again before it has another piece: the
  // neighbour would not take it. A row hears of the two behind it, so blocks of rows along a diagonal are
  // taken at once.
  void measure_far() {
    for (int way = 0; way < 8; ++way) {
      const std::array<bool, 3> down{(way & 1) != 0, (way & 2) != 0, (way & 4) != 0};
      std::array<std::ptrdiff_t, 3> back;  // to the neighbour that the sweep has come by
      std::array<std::uint8_t, 3> to_us;   // its bit for the way from there
      for (int axis = 0; axis < 3; ++axis) {
        back[axis] = down[axis] ? step_[axis] : -step_[axis];
        to_us[axis] = std::uint8_t(1 << down[axis]);
      }
      const auto take_row = [&](int j, int k) {
        const int y = down[1] ? nodes_[1] - 1 - j : j, z = down[2] ? nodes_[2] - 1 - k : k;
        std::ptrdiff_t node = z * step_[2] + y * step_[1] + (down[0] ? nodes_[0] - 1 : 0);
        for (int i = 0; i < nodes_[0]; ++i, node -= back[0]) {
          const std::array<int, 3> at{i, j, k};
          for (int axis = 0; axis < 3; ++axis)
            if (at[axis] > 0) hear(node, node + back[axis], unsaid_[axis].data(), to_us[axis]);
        }
      };
      constexpr int wide = 8;
      const auto take_block = [&](int b, int c) {
        for (int k = wide * c; k < std::min(nodes_[2], wide * (c + 1)); ++k)
          for (int j = wide * b; j < std::min(nodes_[1], wide * (b + 1)); ++j) take_row(j, k);
      };
      const int blocks_y = (nodes_[1] + wide - 1) / wide, blocks_z = (nodes_[2] + wide - 1) / wide;
      for (int diagonal = 0; diagonal < blocks_y + blocks_z - 1; ++diagonal) {
        throw_if_stopped();
        const int first = std::max(0, diagonal - blocks_y + 1), last = std::min(diagonal, blocks_z - 1);
        parallel_for(last - first + 1, [&](int i) { take_block(diagonal - first - i, first + i); });
      }
    }
  }

  // One winding number for each region of nodes joined by edges that no surface crosses. Regions are joined
  // from runs along x.
  std::vector<char> inside_by_regions(const WindingNumber& winding) const {
    std::vector<std::int32_t> run(distance_.size()),
        joined_to;  // [node]; [run], in the end of a region its first
    for (std::size_t node = 0; node < run.size(); ++node) {
      const bool goes_on = node % std::size_t(step_[1]) != 0 && uncrossed(node - 1, node);
      if (!goes_on) joined_to.push_back(std::int32_t(joined_to.size()));
      run[node] = std::int32_t(joined_to.size()) - 1;
    }
    const auto first_of = [&](std::int32_t r) {
      while (joined_to[std::size_t(r)] != r)
        r = joined_to[std::size_t(r)] = joined_to[std::size_t(joined_to[std::size_t(r)])];
      return r;
    };
    for (const int axis : {1, 2}) {
      std::pair<std::int32_t, std::int32_t> last{-1, -1};
      for (std::size_t node = std::size_t(step_[axis]); node < run.size(); ++node) {
        const std::size_t other = node - std::size_t(step_[axis]);
        const std::pair pair(run[other], run[node]);
        if (pair == last || (axis == 1 && node % std::size_t(step_[2]) < std::size_t(step_[1])) ||
            !uncrossed(other, node))
          continue;
        last = pair;
        const std::int32_t one = first_of(pair.first), two = first_of(pair.second);
        joined_to[std::size_t(std::max(one, two))] = std::min(one, two);
      }
      throw_if_stopped();
    }
    constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> clearest(joined_to.size(), none);  // of each region, the first of equals
    for (std::size_t node = 0; node < run.size(); ++node) {
      std::size_t& best = clearest[std::size_t(run[node] = first_of(run[node]))];
      if (best == none || clear_[node] > clear_[best]) best = node;
    }
    std::vector<char> is_inside(joined_to.size());
    for (std::size_t r = 0; r < clearest.size(); ++r) {
      if (clearest[r] == none) continue;
      throw_if_stopped();
      const auto [i, j, k] = indices(clearest[r]);
      is_inside[r] = winding.inside(position(i, j, k));
    }
    std::vector<char> inside(run.size());
    for (std::size_t node = 0; node < run.size(); ++node) inside[node] = is_inside[std::size_t(run[node])];
    return inside;
  }

  // For open surfaces, where the winding number changes between them too, but slowly: where it is clearly on
  // one side of a half, it stays there for half the distance to the surface, or two cells without crossing
  // it.
  std::vector<char> inside_by_nodes(const WindingNumber& winding) const {
    enum : char { no, yes, unknown };
    std::vector<char> inside(distance_.size(), unknown);
    std::vector<std::size_t> patch;
    for (std::size_t start = 0; start < inside.size(); ++start) {
      if (inside[start] != unknown) continue;
      throw_if_stopped();
      const auto center = indices(start);
      const double there = winding.at(position(center[0], center[1], center[2])) - 0.5;
      inside[start] = there > 0 ? yes : no;
      if (std::abs(there) < 0.25) continue;
      const double reach = std::max(2.0, 0.5 * distance_[start] / cell_);
      patch.assign(1, start);
      for (std::size_t head = 0; head < patch.size(); ++head)
        for_uncrossed_edges(patch[head], [&](std::size_t other) {
          const auto at = indices(other);
          const Vec3 away(at[0] - center[0], at[1] - center[1], at[2] - center[2]);
          if (inside[other] != unknown || away.squaredNorm() > reach * reach) return;
          inside[other] = inside[start];
          patch.push_back(other);
        });
    }
    return inside;
  }

  // Where inside changes without a surface there is a hole, which is closed by points in the middles of
  // edges.
  void close_holes(const std::vector<char>& inside) {
    for (std::size_t node = 0; node < inside.size(); ++node)
      for_uncrossed_edges(node, [&](std::size_t other) {
        if (other < node || inside[node] == inside[other]) return;
        const auto a = indices(node), b = indices(other);
        closing_.push_back(0.5 * (position(a[0], a[1], a[2]) + position(b[0], b[1], b[2])));
        for (const std::size_t end : {node, other})
          if (0.5 * cell_ < distance_[end]) {
            distance_[end] = 0.5 * cell_;
            nearest_[end] = int(pieces_.size() + closing_.size()) - 1;
            to_say(end);
          }
      });
    if (!closing_.empty()) measure_far();
  }

  void turn_negative(const std::vector<char>& inside) {
    for (std::size_t n = 0; n < distance_.size(); ++n)
      if (inside[n]) distance_[n] = -distance_[n];
  }

  // Distances at the nodes next to the surface are changed so that what lies between them is nearer to 0 on
  // the surface, since a trilinear field rounds its edges off: four steps of SART (Andersen and Kak,
  // Ultrasonic Imaging 6, 1984).
  void fit(const SeenSurface& surface) {
    const double spots = spots_a_cell * surface.area_m2 / (cell_ * cell_);
    if (!(spots >= 1)) return;
    const SurfaceSpots sequence(surface);
    std::vector<Place> places(std::size_t(std::min(spots, max_spots)));
    parallel_for_many(int(places.size()), [&](int i) {
      throw_if_stopped();
      places[std::size_t(i)] = place_of(sequence.at(std::uint32_t(i)).position);
    });
    std::vector<float> weights(distance_.size());
    std::vector<char> known(distance_.size());
    std::vector<std::size_t> near;  // the nodes of all places
    for (const Place& p : places)
      for (int c = 0; c < 8; ++c) {
        const std::size_t n = p.node + offset(c);
        weights[n] += p.weights[std::size_t(c)];
        if (!std::exchange(known[n], 1)) near.push_back(n);
      }
    std::vector<double> errors(distance_.size());
    for (int step = 0; step < fitting_steps; ++step) {
      throw_if_stopped();
      for (const std::size_t n : near) errors[n] = 0;
      for (const Place& p : places) {
        double error = 0;
        for (int c = 0; c < 8; ++c) error += p.weights[std::size_t(c)] * distance_[p.node + offset(c)];
        for (int c = 0; c < 8; ++c) errors[p.node + offset(c)] += p.weights[std::size_t(c)] * error;
      }
      // A node that few spots are near is changed less.
      for (const std::size_t n : near) distance_[n] -= errors[n] / (weights[n] + 0.5);
    }
  }

  // Returns the volume inside.
  double store(DistanceField& field) const {
    double volume = 0, most = 0;
    for (const double d : distance_) most = std::max(most, std::abs(d));
    field.unit_m = most / largest_value;
    field.values.resize(distance_.size());
    for (std::size_t n = 0; n < distance_.size(); ++n) {
      field.values[n] = std::int16_t(std::lround(distance_[n] / field.unit_m));
      volume += std::clamp(0.5 - distance_[n] / cell_, 0.0, 1.0);
    }
    return volume * cell_ * cell_ * cell_;
  }

 private:
  // The cell that holds a point: its first node, and the shares of its eight corners, x fastest.
  struct Place {
    std::size_t node;
    std::array<float, 8> weights;
  };
  std::size_t offset(int corner) const {
    return std::size_t((corner & 1) * step_[0] + (corner >> 1 & 1) * step_[1] + (corner >> 2) * step_[2]);
  }
  Place place_of(const Vec3& p) const {
    Place result{0, {}};
    Vec3 share;
    for (int axis = 0; axis < 3; ++axis) {
      const double at = (p[axis] - lower_[axis]) / cell_;
      const int first = std::clamp(int(at), 0, nodes_[axis] - 2);
      result.node += std::size_t(first * step_[axis]);
      share[axis] = std::clamp(at - first, 0.0, 1.0);
    }
    for (int c = 0; c < 8; ++c)
      result.weights[std::size_t(c)] =
          float(((c & 1) ? share[0] : 1 - share[0]) * ((c & 2) ? share[1] : 1 - share[1]) *
                ((c & 4) ? share[2] : 1 - share[2]));
    return result;
  }
  // The first and the last node along an axis of those that may be within reach of a piece.
  std::pair<int, int> nodes_round(const SurfacePiece& piece, double reach, int axis) const {
    const auto& [a, b, c] = piece.corners;
    const auto place = [&](double x) {
      return std::clamp((x - lower_[axis]) / cell_, -1.0, double(nodes_[std::size_t(axis)]));
    };
    return {int(std::max(0.0, std::ceil(place(std::min({a[axis], b[axis], c[axis]}) - reach)))),
            std::min(nodes_[std::size_t(axis)] - 1,
                     int(std::floor(place(std::max({a[axis], b[axis], c[axis]}) + reach))))};
  }
  // Of the nodes round a piece those from `lowest` to `highest` along z.
  void measure_round(int n, double reach, int lowest, int highest) {
    const SurfacePiece& piece = pieces_[std::size_t(n)];
    const auto& [a, b, c] = piece.corners;
    Vec3 normal = (b - a).cross(c - a);
    if (const double length = normal.norm(); length > 0) normal /= length;
    const auto [x0, x1] = nodes_round(piece, reach, 0);
    const auto [y0, y1] = nodes_round(piece, reach, 1);
    const auto [z0, z1] = nodes_round(piece, reach, 2);
    for (int k = std::max(z0, lowest); k <= std::min(z1, highest); ++k)
      for (int j = y0; j <= y1; ++j)
        for (int i = x0; i <= x1; ++i) {
          const Vec3 p = position(i, j, k);
          const std::size_t node = std::size_t(k * step_[2] + j * step_[1] + i);
          const double off_plane = std::abs((p - a).dot(normal));
          if (off_plane > clear_[node] && (!piece.seen || off_plane >= distance_[node])) continue;
          const double distance = (nearest_on_triangle(a, b, c, p) - p).norm();
          clear_[node] = std::min(clear_[node], float(distance));
          if (piece.seen && distance < std::min(distance_[node], reach))
            distance_[node] = distance, nearest_[node] = n;
        }
  }
  // No surface crosses the edge between two neighbours, since the balls about both ends within which there is
  // none cover it.
  bool uncrossed(std::size_t node, std::size_t other) const {
    return double(clear_[node]) + clear_[other] > cell_ * (1 + 1e-5);
  }
  // Calls visit(node) for the neighbours of a node that are joined to it by such an edge.
  template <class Visit>
  void for_uncrossed_edges(std::size_t node, Visit visit) const {
    const std::array<int, 3> at = indices(node);
    for (int axis = 0; axis < 3; ++axis)
      for (const int turn : {-1, 1}) {
        if (at[axis] + turn < 0 || at[axis] + turn >= nodes_[axis]) continue;
        const std::size_t other = std::size_t(std::ptrdiff_t(node) + turn * step_[axis]);
        if (uncrossed(node, other)) visit(other);
      }
  }
  // It has another piece since it was asked, whichever way.
  void to_say(std::size_t node) {
    for (auto& unsaid : unsaid_) unsaid[node] = 3;
  }
  // `node` takes the piece of `other` where that is nearer than its own; `to_us` is the bit of that way.
  void hear(std::ptrdiff_t node, std::ptrdiff_t other, std::uint8_t* unsaid, std::uint8_t to_us) {
    const std::size_t n = std::size_t(node), o = std::size_t(other);
    if (!(unsaid[o] & to_us)) return;
    unsaid[o] &= std::uint8_t(~to_us);
    const int piece = nearest_[o];
    if (fixed_[n] || piece == nearest_[n] || distance_[o] - cell_ >= distance_[n]) return;
    const auto [i, j, k] = indices(n);
    const double distance = distance_to(piece, position(i, j, k));
    if (distance < distance_[n]) distance_[n] = distance, nearest_[n] = piece, to_say(n);
  }
  double distance_to(int piece, const Vec3& p) const {
    if (std::size_t(piece) >= pieces_.size())
      return (closing_[std::size_t(piece) - pieces_.size()] - p).norm();
    const auto& [a, b, c] = pieces_[std::size_t(piece)].corners;
    return (nearest_on_triangle(a, b, c, p) - p).norm();
  }
  Vec3 position(int i, int j, int k) const { return lower_ + cell_ * Vec3(i, j, k); }
  std::array<int, 3> indices(std::size_t node) const {
    return {int(node % std::size_t(step_[1])), int(node / std::size_t(step_[1]) % std::size_t(nodes_[1])),
            int(node / std::size_t(step_[2]))};
  }

  const std::vector<SurfacePiece>& pieces_;
  const Vec3 lower_;
  const double cell_;
  const std::array<int, 3> nodes_;
  const std::array<std::ptrdiff_t, 3> step_;  // between neighbouring nodes
  std::vector<double> distance_;              // to the nearest piece seen
  std::vector<int> nearest_;                  // that piece, or of closing_ counted on; −1: none known yet
  std::vector<Vec3> closing_;                 // points that close holes
  std::vector<float> clear_;                  // no piece, seen or not, is nearer; up to near_cells
  std::vector<char> fixed_;
  // Of each axis: a node has another piece since it was asked along + (1) and along − (2). No two threads
  // touch the same axis of a node at once.
  std::array<std::vector<std::uint8_t>, 3> unsaid_;
};

}  // namespace

DistanceField grid_over(const Box& box, double cell_m, std::int64_t max_nodes) {
  DistanceField field;
  while (true) {
    std::int64_t count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double nodes = std::ceil(box.size()[axis] / cell_m) + 3;
      field.nodes[std::size_t(axis)] = int(std::min(nodes, 1e6));
      count *= std::min<std::int64_t>(field.nodes[std::size_t(axis)], max_nodes);
    }
    if (count <= max_nodes) break;
    cell_m *= 1.02;
  }
  field.cell_m = cell_m;
  // What is left of the last cell is shared by both sides.
  for (int axis = 0; axis < 3; ++axis)
    field.lower_m[axis] = box.center()[axis] - 0.5 * cell_m * (field.nodes[std::size_t(axis)] - 1);
  return field;
}

double fill(const SeenSurface& surface, const WindingNumber& winding, bool closed, DistanceField& field) {
  Filler filler(surface, field);
  filler.measure_near();
  filler.measure_far();
  const std::vector<char> inside =
      closed ? filler.inside_by_regions(winding) : filler.inside_by_nodes(winding);
  if (!closed) filler.close_holes(inside);
  filler.turn_negative(inside);
  filler.fit(surface);
  return filler.store(field);
}

}  // namespace limber::meshing::detail
