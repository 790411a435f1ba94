#include "plan/guidance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "core/error.h"

namespace limber::plan {

namespace {

constexpr float far = 1e18f;
constexpr double rigid_over_soft = 10;
constexpr double inside_rigid = 1000;  // price of a metre: never better than a way round, yet a number

// Lower envelope of parabolas, along one line of a grid.
class LineTransform {
 public:
  explicit LineTransform(int longest)
      : f_(std::size_t(longest)), apex_(std::size_t(longest)), from_(std::size_t(longest) + 1) {}

  void apply(float* first, int count, int stride) {
    for (int i = 0; i < count; ++i) f_[std::size_t(i)] = double(first[std::ptrdiff_t(i) * stride]);
    int last = -1;
    for (int q = 0; q < count; ++q) {
      if (f_[std::size_t(q)] >= double(far)) continue;
      double start = -std::numeric_limits<double>::infinity();
      for (; last >= 0; --last) {
        start = crossing(apex_[std::size_t(last)], q);
        if (start > from_[std::size_t(last)]) break;
        start = -std::numeric_limits<double>::infinity();
      }
      ++last;
      apex_[std::size_t(last)] = q, from_[std::size_t(last)] = start;
    }
    if (last < 0) return;
    int k = 0;
    for (int q = 0; q < count; ++q) {
      while (k < last && from_[std::size_t(k) + 1] < q) ++k;
      const double d = q - apex_[std::size_t(k)];
      first[std::ptrdiff_t(q) * stride] = float(d * d + f_[std::size_t(apex_[std::size_t(k)])]);
    }
  }

 private:
  double crossing(int a, int b) const {
    return ((f_[std::size_t(b)] + double(b) * b) - (f_[std::size_t(a)] + double(a) * a)) / (2.0 * (b - a));
  }
  std::vector<double> f_;
  std::vector<int> apex_;
  std::vector<double> from_;
};

}  // namespace

std::vector<float> distance_in_cells(const Eigen::Vector3i& n, const std::vector<bool>& is) {
  std::vector<float> d(is.size());
  for (std::size_t i = 0; i < is.size(); ++i) d[i] = is[i] ? 0 : far;
  LineTransform line(n.maxCoeff());
  for (int z = 0; z < n.z(); ++z)
    for (int y = 0; y < n.y(); ++y) line.apply(&d[std::size_t((z * n.y() + y) * n.x())], n.x(), 1);
  for (int z = 0; z < n.z(); ++z)
    for (int x = 0; x < n.x(); ++x) line.apply(&d[std::size_t(z * n.y() * n.x() + x)], n.y(), n.x());
  for (int y = 0; y < n.y(); ++y)
    for (int x = 0; x < n.x(); ++x) line.apply(&d[std::size_t(y * n.x() + x)], n.z(), n.x() * n.y());
  for (float& v : d) v = v >= far ? 1e9f : std::sqrt(v);
  return d;
}

Guidance::Guidance(const Workspace& space, const Vec3& goal, double soft_price) : space_(space), goal_(goal) {
  LIMBER_CHECK(space.cells.minCoeff() > 0 && space.what.size() == std::size_t(space.cells.prod()),
               space.what.size());
  set_prices(soft_price);
  renew();
}

Vec3 Guidance::center_of(int cell) const {
  const int nx = space_.cells.x(), ny = space_.cells.y();
  const Vec3 place(cell % nx + 0.5, cell / nx % ny + 0.5, cell / (nx * ny) + 0.5);
  return space_.box.lower + space_.cell_m * place;
}

int Guidance::cell_at(const Vec3& p) const {
  Eigen::Vector3i c;
  for (int i = 0; i < 3; ++i)
    c[i] = int(std::clamp((p[i] - space_.box.lower[i]) / space_.cell_m, 0.0, double(space_.cells[i]) - 0.5));
  return (c.z() * space_.cells.y() + c.y()) * space_.cells.x() + c.x();
}

void Guidance::set_prices(double soft_price) {
  std::vector<bool> soft(space_.what.size()), open(space_.what.size()), rigid(space_.what.size());
  for (std::size_t c = 0; c < space_.what.size(); ++c) {
    soft[c] = space_.what[c] == Workspace::soft;
    rigid[c] = space_.what[c] == Workspace::rigid;
    open[c] = !soft[c];
  }
  const auto to_soft = distance_in_cells(space_.cells, soft), to_open = distance_in_cells(space_.cells, open),
             to_rigid = distance_in_cells(space_.cells, rigid);
  price_.resize(space_.what.size());
  const double radius = space_.robot_radius_m;
  const auto lacking = [&](double clearance) {
    return radius > 0 ? std::clamp((radius - clearance) / radius, 0.0, 2.0) : double(clearance < 0);
  };
  for (std::size_t c = 0; c < price_.size(); ++c) {
    const Vec3 place = center_of(int(c));
    // A surface lies half a cell before the middle of the first cell behind it.
    const double soft_m = space_.cell_m * (soft[c] ? 0.5 - double(to_open[c]) : double(to_soft[c]) - 0.5);
    double rigid_m = space_.cell_m * (double(to_rigid[c]) - 0.5);
    if (space_.walls)
      rigid_m =
          std::min({rigid_m, (place - space_.box.lower).minCoeff(), (space_.box.upper - place).minCoeff()});
    const double s = lacking(soft_m), r = lacking(rigid_m);
    price_[c] = float(rigid[c] ? inside_rigid : 1 + soft_price * (s * s + rigid_over_soft * r * r));
  }
}

void Guidance::renew() {
  const int nx = space_.cells.x(), ny = space_.cells.y(), nz = space_.cells.z();
  to_go_.assign(price_.size(), std::numeric_limits<float>::infinity());
  next_.assign(price_.size(), -1);
  using Entry = std::pair<float, int>;  // equal costs in order of cells: one result
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open;
  const int goal = cell_at(goal_);
  to_go_[std::size_t(goal)] = 0, next_[std::size_t(goal)] = goal;
  open.emplace(0.0f, goal);
  struct Step {
    int x, y, z;
    float length;
  };
  std::vector<Step> steps;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (x || y || z)
          steps.push_back({x, y, z, float(space_.cell_m) * std::sqrt(float(x * x + y * y + z * z))});
  while (!open.empty()) {
    const auto [cost, cell] = open.top();
    open.pop();
    if (cost > to_go_[std::size_t(cell)]) continue;
    const int x = cell % nx, y = cell / nx % ny, z = cell / (nx * ny);
    for (const Step& s : steps) {
      const int i = x + s.x, j = y + s.y, k = z + s.z;
      if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
      const int other = (k * ny + j) * nx + i;
      const float way = cost + 0.5f * s.length * (price_[std::size_t(cell)] + price_[std::size_t(other)]);
      if (!(way < to_go_[std::size_t(other)])) continue;
      to_go_[std::size_t(other)] = way, next_[std::size_t(other)] = cell;
      open.emplace(way, other);
    }
  }
}

double Guidance::to_go(const Vec3& place) const {
  const int cell = cell_at(place);
  // Within a cell the way to its middle's successor is measured, so that the number changes as the robot
  // moves.
  const int next = next_[std::size_t(cell)];
  const Vec3 towards = next == cell ? goal_ : center_of(next);
  const double price = double(price_[std::size_t(cell)]);
  return double(to_go_[std::size_t(next)]) + price * (towards - place).norm();
}

Vec3 Guidance::ahead(const Vec3& place, double way_m) const {
  int cell = cell_at(place);
  Vec3 at = place;
  while (next_[std::size_t(cell)] != cell) {
    cell = next_[std::size_t(cell)];
    const Vec3 to = center_of(cell);
    const double length = (to - at).norm();
    if (length >= way_m) return at + (to - at) * (way_m / length);
    way_m -= length;
    at = to;
  }
  const double length = (goal_ - at).norm();
  return length > way_m ? Vec3(at + (goal_ - at) * (way_m / length)) : goal_;
}

double Guidance::price(const Vec3& place) const { return double(price_[std::size_t(cell_at(place))]); }

void Guidance::raise(const Vec3& place, double by) {
  const double reach = std::max(0.5 * space_.robot_radius_m, space_.cell_m);
  for (int c = 0; c < int(price_.size()); ++c)
    if ((center_of(c) - place).squaredNorm() <= reach * reach) price_[std::size_t(c)] += float(by);
}

}  // namespace limber::plan
