#include "imaging/surface_nets.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "core/error.h"
#include "core/progress.h"
#include "core/threads.h"

namespace limber::imaging {

namespace {

// Corners of voxels are points (i j k) of a grid with one more in each direction; eight voxels are round
// each, numbered by bits: 1 where it is the one beyond in i, 2 in j, 4 in k. Voxel (i j k) is the one before
// point (i+1 j+1 k+1) in all three.

// Taubin, A signal processing approach to fair surface design, 1995: what the first step shrinks, the second
// widens again.
constexpr double smoothing = 0.5, widening = -0.526;
// No point moves farther from its corner than this, in voxels along each axis, so that a sheet of one voxel
// keeps a tenth of its thickness, and a boundary that was right within half a voxel stays so.
constexpr double farthest = 0.45;
constexpr double min_behind = 0.2;  // of a step's length: what it goes behind each triangle round its vertex
constexpr double min_tet = 0.02;    // six times its volume, voxels; of a voxel that nobody moved a half

// Of a face, in turn: its shorter diagonal is from corner 0 or from corner 1. By places in voxels, and both
// sides of it see the same.
std::size_t diagonal(const std::array<Vec3, 4>& corner, const std::array<std::int64_t, 4>& rank) {
  const double one = (corner[0] - corner[2]).squaredNorm(), two = (corner[1] - corner[3]).squaredNorm();
  const std::int64_t least = std::min({rank[0], rank[1], rank[2], rank[3]});
  return one < two || (one == two && (least == rank[0] || least == rank[2])) ? 0 : 1;
}

// A set of many bits that tells how many are set before one.
class RankedBits {
 public:
  explicit RankedBits(std::int64_t size) : words_(std::size_t((size + 63) / 64)) {}
  void set(std::int64_t i) { words_[std::size_t(i >> 6)] |= std::uint64_t(1) << (i & 63); }
  bool test(std::int64_t i) const { return words_[std::size_t(i >> 6)] >> (i & 63) & 1; }
  void count() {
    before_.resize(words_.size());
    std::int64_t sum = 0;
    for (std::size_t w = 0; w < words_.size(); ++w) before_[w] = sum, sum += std::popcount(words_[w]);
    total_ = sum;
  }
  std::int64_t total() const { return total_; }
  std::int64_t rank(std::int64_t i) const {
    const std::uint64_t below = words_[std::size_t(i >> 6)] & ((std::uint64_t(1) << (i & 63)) - 1);
    return before_[std::size_t(i >> 6)] + std::popcount(below);
  }

 private:
  std::vector<std::uint64_t> words_;
  std::vector<std::int64_t> before_;
  std::int64_t total_ = 0;
};

// The faces of voxels that meet at a point: face f lies between voxels first[f] and second[f] of its eight.
struct PointFaces {
  std::array<std::array<int, 2>, 12> voxels{};
  std::array<std::array<int, 8>, 8> between{};  // the face, by its two voxels; -1
};
constexpr PointFaces point_faces = [] {
  PointFaces faces;
  for (auto& row : faces.between) row.fill(-1);
  int f = 0;
  for (int axis = 1; axis <= 4; axis *= 2)
    for (int v = 0; v < 8; ++v)
      if (!(v & axis)) {
        faces.voxels[std::size_t(f)] = {v, v | axis};
        faces.between[std::size_t(v)][std::size_t(v | axis)] = f;
        faces.between[std::size_t(v | axis)][std::size_t(v)] = f;
        ++f;
      }
  return faces;
}();

// For each choice of the eight voxels: which faces of theirs hang together round the point, by grid edges of
// which two faces are theirs, or, where four are, by the two of the same voxel. Each patch is one fan.
struct Patches {
  std::array<std::int8_t, 12> of_face{};  // its patch; -1 where it is no boundary
  int count = 0;
  // Of each: whether the voxels that it bounds, as they hang together by faces, have another patch, too: what
  // is outside reaches them from two sides, and they are pinched here.
  std::array<bool, 4> pinched{};
};
std::vector<Patches> patches_of_all() {
  std::vector<Patches> all(256);
  for (int mask = 0; mask < 256; ++mask) {
    std::array<int, 12> root{};
    for (int f = 0; f < 12; ++f) root[std::size_t(f)] = f;
    const auto find = [&](int f) {
      while (root[std::size_t(f)] != f) f = root[std::size_t(f)];
      return f;
    };
    const auto in = [&](int v) { return mask >> v & 1; };
    // Six grid edges leave the point, one for each axis and side; round each are four voxels.
    for (int axis = 1; axis <= 4; axis *= 2)
      for (int side = 0; side <= axis; side += axis) {
        const int a = axis == 1 ? 2 : 1, b = axis == 4 ? 2 : 4;
        const std::array<int, 4> ring{side, side | a, side | a | b, side | b};
        std::vector<std::pair<int, int>> faces;  // and the voxel of theirs
        for (std::size_t k = 0; k < 4; ++k) {
          const int v = ring[k], w = ring[(k + 1) % 4];
          if (in(v) != in(w))
            faces.push_back({point_faces.between[std::size_t(v)][std::size_t(w)], in(v) ? v : w});
        }
        for (std::size_t i = 0; i < faces.size(); ++i)
          for (std::size_t j = i + 1; j < faces.size(); ++j)
            if (faces.size() == 2 || faces[i].second == faces[j].second)
              root[std::size_t(find(faces[j].first))] = find(faces[i].first);
      }
    Patches& p = all[std::size_t(mask)];
    p.of_face.fill(-1);
    std::array<int, 12> number{};
    number.fill(-1);
    for (int f = 0; f < 12; ++f) {
      const auto [v, w] = point_faces.voxels[std::size_t(f)];
      if (in(v) == in(w)) continue;
      int& n = number[std::size_t(find(f))];
      if (n < 0) n = p.count++;
      p.of_face[std::size_t(f)] = std::int8_t(n);
    }
    std::array<int, 8> piece{0, 1, 2, 3, 4, 5, 6, 7};
    for (int round = 0; round < 4; ++round)
      for (const auto& [v, w] : point_faces.voxels)
        if (in(v) && in(w))
          piece[std::size_t(v)] = piece[std::size_t(w)] =
              std::min(piece[std::size_t(v)], piece[std::size_t(w)]);
    for (int f = 0; f < 12; ++f)
      for (int g = 0; g < 12; ++g) {
        const int one = p.of_face[std::size_t(f)], other = p.of_face[std::size_t(g)];
        if (one < 0 || other < 0 || one == other) continue;
        const auto inside = [&](int face) {
          const auto [v, w] = point_faces.voxels[std::size_t(face)];
          return piece[std::size_t(in(v) ? v : w)];
        };
        if (inside(f) == inside(g)) p.pinched[std::size_t(one)] = true;
      }
  }
  return all;
}

class Nets {
 public:
  Nets(const LabelMap& map, const SurfaceNetOptions& options)
      : map_(map),
        options_(options),
        material_(map.material),
        points_{map.size[0] + 1, map.size[1] + 1, map.size[2] + 1},
        boundary_(std::int64_t(points_[0]) * points_[1] * points_[2]) {}

  std::vector<LabelSurface> surfaces(const std::vector<int>& rows) {
    drop_islands();
    find_boundary();
    smooth();
    std::vector<LabelSurface> result(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      throw_if_stopped();
      result[i] = surface(rows[i]);
    }
    return result;
  }

 private:
  int at(int i, int j, int k) const {
    if (i < 0 || j < 0 || k < 0 || i >= map_.size[0] || j >= map_.size[1] || k >= map_.size[2]) return 0;
    return material_[std::size_t(i + std::int64_t(map_.size[0]) * (j + std::int64_t(map_.size[1]) * k))];
  }
  bool has(const Eigen::Vector3i& p) const {
    return (p.array() >= 0).all() && p.x() < points_[0] && p.y() < points_[1] && p.z() < points_[2];
  }
  std::int64_t point(const Eigen::Vector3i& p) const {
    return p.x() + std::int64_t(points_[0]) * (p.y() + std::int64_t(points_[1]) * p.z());
  }
  std::array<int, 8> round(int i, int j, int k) const {
    std::array<int, 8> materials;
    for (int v = 0; v < 8; ++v)
      materials[std::size_t(v)] = at(i - 1 + (v & 1), j - 1 + (v >> 1 & 1), k - 1 + (v >> 2 & 1));
    return materials;
  }
  Vec3 grid_of(std::int64_t rank) const {
    return grid_[std::size_t(rank)].cast<double>() + offset_[std::size_t(rank)];
  }
  // Of a place in voxels' corners: corner (0 0 0) is half a voxel before the middle of the first.
  Vec3 metres(const Vec3& grid) const { return map_.origin_m + map_.axes_m * (grid - Vec3::Constant(0.5)); }

  void drop_islands();
  void find_boundary();
  void smooth();
  void unfold();
  bool is_whole(const Eigen::Vector3i& voxel) const;
  std::array<Vec3, 8> corners_of(const Eigen::Vector3i& voxel) const;
  static Vec3 middle_of(const std::array<Vec3, 8>& corners);
  LabelSurface surface(int row) const;
  class OneLabel;

  const LabelMap& map_;
  const SurfaceNetOptions& options_;
  std::vector<std::uint16_t> material_;  // without islands
  std::array<int, 3> points_;
  RankedBits boundary_;                // points round which not all voxels are alike
  std::vector<Eigen::Vector3i> grid_;  // of each of those, by rank
  std::vector<std::uint8_t> edges_;    // six bits: grid edges to −i, +i, −j … that lie on a boundary
  std::vector<Vec3> offset_;           // from its corner, voxels
  std::vector<int> islands_;           // of each label
  std::vector<std::int64_t> voxels_, dropped_;
  struct VoxelBox {
    Eigen::Vector3i lower = Eigen::Vector3i::Constant(1 << 20), upper = Eigen::Vector3i::Constant(-1);
  };
  std::vector<VoxelBox> boxes_;  // of what is left of each label
  const std::vector<Patches> patches_ = patches_of_all();
};

// Pieces whose voxels hang together by their faces.
void Nets::drop_islands() {
  const std::size_t labels = map_.labels.size();
  islands_.assign(labels, 0), voxels_.assign(labels, 0), dropped_.assign(labels, 0);
  boxes_.assign(labels, {});
  std::vector<bool> seen(material_.size(), false);
  std::vector<std::int64_t> piece;
  const std::int64_t nx = map_.size[0], ny = map_.size[1], nz = map_.size[2];
  for (std::int64_t first = 0; first < map_.voxels(); ++first) {
    if (first % (1 << 20) == 0) throw_if_stopped();
    const std::uint16_t label = material_[std::size_t(first)];
    if (label == 0 || seen[std::size_t(first)]) continue;
    piece.assign(1, first);
    seen[std::size_t(first)] = true;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const std::int64_t v = piece[next], i = v % nx, j = v / nx % ny, k = v / (nx * ny);
      const auto visit = [&](bool inside, std::int64_t w) {
        if (!inside || seen[std::size_t(w)] || material_[std::size_t(w)] != label) return;
        seen[std::size_t(w)] = true;
        piece.push_back(w);
      };
      visit(i > 0, v - 1), visit(i + 1 < nx, v + 1);
      visit(j > 0, v - nx), visit(j + 1 < ny, v + nx);
      visit(k > 0, v - nx * ny), visit(k + 1 < nz, v + nx * ny);
    }
    if (double(piece.size()) < options_.min_island) {
      for (const std::int64_t v : piece) material_[std::size_t(v)] = 0;
      ++islands_[label], dropped_[label] += std::int64_t(piece.size());
    } else {
      voxels_[label] += std::int64_t(piece.size());
      VoxelBox& box = boxes_[label];
      for (const std::int64_t v : piece) {
        const Eigen::Vector3i voxel(int(v % nx), int(v / nx % ny), int(v / (nx * ny)));
        box.lower = box.lower.cwiseMin(voxel), box.upper = box.upper.cwiseMax(voxel);
      }
    }
  }
}

void Nets::find_boundary() {
  for (int k = 0; k < points_[2]; ++k) {
    throw_if_stopped();
    for (int j = 0; j < points_[1]; ++j)
      for (int i = 0; i < points_[0]; ++i) {
        const std::array<int, 8> m = round(i, j, k);
        if (std::any_of(m.begin(), m.end(), [&](int one) { return one != m[0]; }))
          boundary_.set(point({i, j, k}));
      }
  }
  boundary_.count();
  if (boundary_.total() > std::int64_t(1) << 28)
    throw InputError(fmt::format(
        "the labels have {} boundary points, more than limber holds; resample the map", boundary_.total()));
  grid_.reserve(std::size_t(boundary_.total()));
  edges_.reserve(grid_.capacity());
  for (int k = 0; k < points_[2]; ++k)
    for (int j = 0; j < points_[1]; ++j)
      for (int i = 0; i < points_[0]; ++i) {
        if (!boundary_.test(point({i, j, k}))) continue;
        grid_.emplace_back(i, j, k);
        const std::array<int, 8> m = round(i, j, k);
        std::uint8_t bits = 0;
        for (int axis = 0; axis < 3; ++axis)
          for (int side = 0; side < 2; ++side) {
            const int bit = 1 << axis, a = axis == 0 ? 2 : 1, b = axis == 2 ? 2 : 4, s = side ? bit : 0;
            if (m[std::size_t(s)] != m[std::size_t(s | a)] || m[std::size_t(s)] != m[std::size_t(s | b)] ||
                m[std::size_t(s)] != m[std::size_t(s | a | b)])
              bits = std::uint8_t(bits | 1 << (2 * axis + side));
          }
        edges_.push_back(bits);
      }
}

void Nets::smooth() {
  const std::int64_t count = boundary_.total();
  offset_.assign(std::size_t(count), Vec3::Zero());
  // What the gap takes later stays within the bound, too.
  const double bound = farthest - 0.5 * options_.gap;
  const std::array<std::int64_t, 3> stride{1, points_[0], std::int64_t(points_[0]) * points_[1]};
  std::vector<std::array<std::int32_t, 6>> neighbour(static_cast<std::size_t>(count));
  constexpr std::int64_t piece = 1 << 14;
  const int pieces = int((count + piece - 1) / piece);
  const auto for_all = [&](const auto& body) {
    parallel_for(pieces, [&](int p) {
      for (std::int64_t r = p * piece; r < std::min(count, (p + 1) * piece); ++r) body(std::size_t(r));
    });
  };
  for_all([&](std::size_t r) {
    const std::int64_t at = point(grid_[r]);
    for (int e = 0; e < 6; ++e)
      neighbour[r][std::size_t(e)] =
          edges_[r] >> e & 1
              ? std::int32_t(boundary_.rank(at + (e % 2 ? 1 : -1) * stride[std::size_t(e / 2)]))
              : -1;
  });
  std::vector<Vec3> next(offset_.size());
  Progress progress("smooth", options_.rounds);
  for (int round = 0; round < options_.rounds; ++round) {
    throw_if_stopped();
    for (const double step : {smoothing, widening}) {
      for_all([&](std::size_t r) {
        Vec3 sum = Vec3::Zero();
        int edges = 0;
        for (const std::int32_t n : neighbour[r])
          if (n >= 0) sum += grid_of(n), ++edges;
        Vec3 o = offset_[r];
        if (edges > 0) o += step * (sum / edges - grid_of(std::int64_t(r)));
        next[r] = o.cwiseMax(-bound).cwiseMin(bound);
      });
      offset_.swap(next);
    }
    progress.update(round + 1);
  }
  unfold();
}

std::array<Vec3, 8> Nets::corners_of(const Eigen::Vector3i& voxel) const {
  std::array<Vec3, 8> corners;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i p = voxel + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2 & 1);
    const bool moved = has(p) && boundary_.test(point(p));
    corners[std::size_t(c)] = moved ? grid_of(boundary_.rank(point(p))) : Vec3(p.cast<double>());
  }
  return corners;
}

Vec3 Nets::middle_of(const std::array<Vec3, 8>& corners) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& corner : corners) sum += corner;
  return sum / 8;
}

// Whether the voxel between its moved corners is seen whole from the middle of them: then no two voxels
// overlap, and no surface made of their faces meets itself.
bool Nets::is_whole(const Eigen::Vector3i& voxel) const {
  const std::array<Vec3, 8> corners = corners_of(voxel);
  const Vec3 middle = middle_of(corners);
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1}) {
      const int a = 1 << (axis + 1) % 3, b = 1 << (axis + 2) % 3, first = side << axis;
      std::array<Vec3, 4> face;
      std::array<std::int64_t, 4> number;
      for (std::size_t q = 0; q < 4; ++q) {
        const int c = first | (q == 1 || q == 2 ? a : 0) | (q >= 2 ? b : 0);
        face[q] = corners[std::size_t(c)];
        number[q] = point(voxel + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2 & 1));
      }
      const std::size_t from = diagonal(face, number);
      for (const std::size_t half : {from, from + 2}) {
        const auto at = [&](std::size_t n) -> Vec3 { return face[(half + n) % 4] - middle; };
        if ((side ? 1 : -1) * at(0).cross(at(1)).dot(at(2)) < min_tet) return false;
      }
    }
  return true;
}

// Corners of voxels that are not whole go back towards their places, until all are.
void Nets::unfold() {
  std::vector<std::int32_t> all(offset_.size());
  std::iota(all.begin(), all.end(), 0);
  while (!all.empty()) {
    throw_if_stopped();
    std::vector<char> folded(all.size(), 0);
    parallel_for(int((all.size() + 1023) / 1024), [&](int piece) {
      for (std::size_t n = std::size_t(piece) * 1024; n < std::min(all.size(), std::size_t(piece + 1) * 1024);
           ++n)
        for (int c = 0; c < 8 && !folded[n]; ++c)
          folded[n] = !is_whole(grid_[std::size_t(all[n])] - Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2 & 1));
    });
    std::vector<std::int32_t> again;
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (!folded[n]) continue;
      Vec3& o = offset_[std::size_t(all[n])];
      if (o.isZero(0)) continue;  // others of that voxel go back
      o = o.norm() < 0.01 ? Vec3(Vec3::Zero()) : Vec3(0.75 * o);
      // All that has a voxel with it is looked at once more.
      for (int c = 0; c < 27; ++c) {
        const Eigen::Vector3i p =
            grid_[std::size_t(all[n])] + Eigen::Vector3i(c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1);
        if (has(p) && boundary_.test(point(p))) again.push_back(std::int32_t(boundary_.rank(point(p))));
      }
    }
    std::sort(again.begin(), again.end());
    again.erase(std::unique(again.begin(), again.end()), again.end());
    all = std::move(again);
  }
}

// The surface of one label: faces of its voxels, at the smoothed corners that all labels share.
class Nets::OneLabel {
 public:
  OneLabel(const Nets& nets, int row) : nets_(nets), row_(row) {}
  SurfaceMesh surface() {
    const VoxelBox& box = nets_.boxes_[std::size_t(row_)];
    for (int k = box.lower.z(); k <= box.upper.z(); ++k) {
      throw_if_stopped();
      for (int j = box.lower.y(); j <= box.upper.y(); ++j)
        for (int i = box.lower.x(); i <= box.upper.x(); ++i)
          if (nets_.at(i, j, k) == row_)
            for (int axis = 0; axis < 3; ++axis)
              for (const int side : {0, 1}) add_face({i, j, k}, axis, side);
    }
    return stepped_back();
  }

 private:
  struct Corner {
    Eigen::Vector3i point;
    std::int64_t rank;
    int vertex;
  };
  bool is_own(const Eigen::Vector3i& voxel) const {
    return nets_.at(voxel.x(), voxel.y(), voxel.z()) == row_;
  }
  int vertex(std::int64_t key, const Vec3& grid, bool touches);
  Corner corner(const Eigen::Vector3i& point, const Eigen::Vector3i& inside, const Eigen::Vector3i& outside,
                bool touches);
  int middle(const Corner&, const Corner&, int along, const Eigen::Vector3i& inside);
  void add_face(const Eigen::Vector3i& inside, int axis, int side);
  SurfaceMesh stepped_back() const;

  const Nets& nets_;
  int row_;
  // A vertex is a patch of a point, or the middle of a grid edge on the side of one voxel.
  std::unordered_map<std::int64_t, int> vertex_of_;
  std::vector<Vec3> vertices_;  // in voxels, from the first corner
  std::vector<char> touches_;   // another label, or itself at an edge or a point
  std::vector<char> pinched_;   // as Patches has it
  std::vector<Vec3> inwards_;   // sum of middles of its voxels, less itself
  std::vector<std::array<int, 3>> triangles_;
};

int Nets::OneLabel::vertex(std::int64_t key, const Vec3& grid, bool touches) {
  const auto [found, is_new] = vertex_of_.try_emplace(key, int(vertices_.size()));
  if (is_new)
    vertices_.push_back(grid), touches_.push_back(touches), inwards_.push_back(Vec3::Zero()),
        pinched_.push_back(0);
  char& known = touches_[std::size_t(found->second)];
  known = char(known || touches);
  return found->second;
}

Nets::OneLabel::Corner Nets::OneLabel::corner(const Eigen::Vector3i& point, const Eigen::Vector3i& inside,
                                              const Eigen::Vector3i& outside, bool touches) {
  const std::int64_t rank = nets_.boundary_.rank(nets_.point(point));
  const std::array<int, 8> m = nets_.round(point.x(), point.y(), point.z());
  int mask = 0;
  for (int bit = 0; bit < 8; ++bit) mask |= (m[std::size_t(bit)] == row_) << bit;
  const auto number = [&](const Eigen::Vector3i& voxel) {  // among the eight
    const Eigen::Vector3i beyond = voxel - point + Eigen::Vector3i::Ones();
    return std::size_t(beyond.x() + 2 * beyond.y() + 4 * beyond.z());
  };
  const Patches& patches = nets_.patches_[std::size_t(mask)];
  const int patch = patches.of_face[std::size_t(point_faces.between[number(inside)][number(outside)])];
  const int number_of_vertex = vertex(4 * rank + patch, nets_.grid_of(rank), touches || patches.count > 1);
  if (patches.pinched[std::size_t(patch)]) pinched_[std::size_t(number_of_vertex)] = 1;
  return {point, rank, number_of_vertex};
}

// Of a grid edge of which four faces are the label's: both of its ends may be one patch, so each side has a
// middle of its own. -1 for other edges.
int Nets::OneLabel::middle(const Corner& c, const Corner& d, int along, const Eigen::Vector3i& inside) {
  const Eigen::Vector3i low = c.point.cwiseMin(d.point);
  const int u = (along + 1) % 3, w = (along + 2) % 3;
  std::array<bool, 4> own;  // in turn round the edge
  for (int q = 0; q < 4; ++q) {
    Eigen::Vector3i voxel = low;
    voxel[u] -= q == 1 || q == 2 ? 0 : 1, voxel[w] -= q >= 2 ? 0 : 1;
    own[std::size_t(q)] = is_own(voxel);
  }
  if (own[0] != own[2] || own[1] != own[3] || own[0] == own[1]) return -1;
  const std::int64_t edge = 3 * std::min(c.rank, d.rank) + along, side = (inside - low)[u] + 1;
  return vertex(4 * nets_.boundary_.total() + 2 * edge + side,
                0.5 * (nets_.grid_of(c.rank) + nets_.grid_of(d.rank)), true);
}

void Nets::OneLabel::add_face(const Eigen::Vector3i& inside, int axis, int side) {
  Eigen::Vector3i outside = inside;
  outside[axis] += side ? 1 : -1;
  const int beyond = nets_.at(outside.x(), outside.y(), outside.z());
  if (beyond == row_) return;
  // Counter-clockwise seen from beyond.
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  std::array<Corner, 4> c;
  for (std::size_t q = 0; q < 4; ++q) {
    Eigen::Vector3i point = inside;
    point[axis] += side;
    point[a] += q == 1 || q == 2, point[b] += q >= 2;
    c[q] = corner(point, inside, outside, beyond != 0);
  }
  std::array<int, 4> middles;
  for (std::size_t q = 0; q < 4; ++q) middles[q] = middle(c[q], c[(q + 1) % 4], q % 2 == 0 ? a : b, inside);

  // Two triangles at the shorter diagonal.
  const std::size_t from = diagonal({nets_.grid_of(c[0].rank), nets_.grid_of(c[1].rank),
                                     nets_.grid_of(c[2].rank), nets_.grid_of(c[3].rank)},
                                    {c[0].rank, c[1].rank, c[2].rank, c[3].rank});
  const Vec3 middle = middle_of(nets_.corners_of(inside));
  const bool flip = (side == 0) != (nets_.map_.axes_m.determinant() < 0);
  for (const std::size_t half : {from, from + 2}) {
    std::vector<int> rim;
    std::size_t tip = 0;  // a middle where there is one, so that no triangle lies on a line
    for (std::size_t q = half; q < half + 2; ++q) {
      rim.push_back(c[q % 4].vertex);
      if (middles[q % 4] < 0) continue;
      if (tip == 0) tip = rim.size();
      rim.push_back(middles[q % 4]);
    }
    rim.push_back(c[(half + 2) % 4].vertex);
    const std::size_t n = rim.size();
    for (const int v : rim) inwards_[std::size_t(v)] += middle - vertices_[std::size_t(v)];
    for (std::size_t t = 1; t + 1 < n; ++t) {
      std::array<int, 3> triangle{rim[tip], rim[(tip + t) % n], rim[(tip + t + 1) % n]};
      if (flip) std::swap(triangle[1], triangle[2]);
      triangles_.push_back(triangle);
    }
  }
}

// Inwards by half of the gap, where another label or another part of this one is next.
SurfaceMesh Nets::OneLabel::stepped_back() const {
  SurfaceMesh mesh;
  mesh.positions.resize(Eigen::Index(vertices_.size()), 3);
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    mesh.positions.row(Eigen::Index(v)) = nets_.metres(vertices_[v]).transpose();
  mesh.triangles.resize(Eigen::Index(triangles_.size()), 3);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    mesh.triangles.row(Eigen::Index(t)) << triangles_[t][0], triangles_[t][1], triangles_[t][2];

  const Eigen::Matrix3d& axes = nets_.map_.axes_m;
  const double half = 0.5 * nets_.options_.gap, half_m = half * axes.colwise().norm().minCoeff();
  const Points normals = vertex_normals(mesh.positions, mesh.triangles);
  // Least of what a step goes behind the triangles round a vertex, over its length.
  std::vector<Vec3> step(vertices_.size());
  std::vector<double> behind(vertices_.size(), 1);
  const auto measure = [&] {
    std::fill(behind.begin(), behind.end(), 1);
    for (const std::array<int, 3>& t : triangles_) {
      const auto p = [&](int k) { return Vec3(mesh.positions.row(t[std::size_t(k)])); };
      const Vec3 normal = (p(1) - p(0)).cross(p(2) - p(0)).normalized();
      for (const int v : t) {
        double& least = behind[std::size_t(v)];
        least = std::min(least, -normal.dot(step[std::size_t(v)].normalized()));
      }
    }
  };
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    step[v] = -half_m * normals.row(Eigen::Index(v)).transpose();
  measure();
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    if (behind[v] < min_behind) step[v] = half_m * (axes * inwards_[v]).normalized();
  measure();
  const Eigen::Matrix3d voxels_from_m = axes.inverse();
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    if (!touches_[v]) continue;
    // Where it is pinched it must not meet itself: there the others alone step back.
    const double part = pinched_[v] ? -0.25 : behind[v] < min_behind ? 0.25 : 1;
    const Vec3 in_voxels = part * (voxels_from_m * step[v]);
    mesh.positions.row(Eigen::Index(v)) =
        nets_.metres(vertices_[v] + in_voxels.cwiseMax(-half).cwiseMin(half)).transpose();
  }
  return mesh;
}

LabelSurface Nets::surface(int row) const {
  LabelSurface result;
  result.voxels = voxels_[std::size_t(row)];
  result.islands_dropped = islands_[std::size_t(row)], result.voxels_dropped = dropped_[std::size_t(row)];
  result.surface = {Points(0, 3), Triangles(0, 3)};
  if (result.voxels > 0) result.surface = OneLabel(*this, row).surface();
  return result;
}

void check(const LabelMap& map, const std::vector<int>& rows, const SurfaceNetOptions& options) {
  if (!(options.gap >= 0 && options.gap <= 0.6))
    throw InputError(fmt::format("a gap of {} voxels is not from 0 to 0.6", options.gap));
  if (options.rounds < 0 || options.rounds > 1000)
    throw InputError(fmt::format("{} rounds of smoothing are not from 0 to 1000", options.rounds));
  if (!(options.min_island >= 0)) throw InputError("the least island has a negative size");
  for (const int row : rows)
    if (row < 1 || row >= int(map.labels.size()))
      throw InputError(fmt::format("there is no label in row {}; there are {}", row, map.labels.size() - 1));
}

}  // namespace

std::vector<LabelSurface> surfaces_of(const LabelMap& map, const std::vector<int>& rows,
                                      const SurfaceNetOptions& options) {
  check(map, rows, options);
  return Nets(map, options).surfaces(rows);
}

}  // namespace limber::imaging
