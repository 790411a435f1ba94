// The grid's distances, its prices, its sheets, and Dijkstra's search from the goal.
//
// What always holds: the cost-to-go is a function of workspace, goal and prices, and equal costs go by the
// number of the cell, so it is the same on any machine. No price is infinite: a robot that touches a wall has
// a way out.
//
// A sheet is a copy of the grid for one reduced word of passages through holes: the graph is the grid
// augmented by homotopy (Bhattacharya, Likhachev and Kumar, Autonomous Robots 2012). A way that unwinds what
// it winds ends on the sheet on which it began. With one sheet a strand's end that turns back seems near
// (docs/planning.md, "Windings").
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
constexpr std::size_t max_sheets = 200;
constexpr double bend = 3;  // of a strand's radius: bent so, its outside is stretched by a third

// Squared distances along one line of a grid: the lower envelope of the parabolas (x − q)² + f(q), each of
// which is lowest from where it crosses the one before. Lines of x, then y, then z make distances in space.
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

// A strand goes round things in a bend, and not sharper than its radius lets it.
Guidance::Guidance(const Workspace& space, const Vec3& goal, double soft_price, const Windings& start)
    : space_(space), goal_(goal) {
  LIMBER_CHECK(space.cells.minCoeff() > 0 && space.what.size() == std::size_t(space.cells.prod()),
               space.what.size());
  if (!space_.holes.empty()) space_.robot_radius_m *= bend;
  set_prices(soft_price);
  set_sheets(start);
  renew();
}

Vec3 Guidance::center_of(int cell) const {
  const int nx = space_.cells.x(), ny = space_.cells.y();
  const Vec3 place(cell % nx + 0.5, cell / nx % ny + 0.5, cell / (nx * ny) + 0.5);
  return space_.box.lower + space_.cell_m * place;
}

// Of the nearest place in the box, where it is outside.
int Guidance::cell_at(const Vec3& p) const {
  Eigen::Vector3i c;
  for (int i = 0; i < 3; ++i)
    c[i] = int(std::clamp((p[i] - space_.box.lower[i]) / space_.cell_m, 0.0, double(space_.cells[i]) - 0.5));
  return (c.z() * space_.cells.y() + c.y()) * space_.cells.x() + c.x();
}

// With c the clearance of a place and r the robot's radius, what of r is lacking is s = (r − c)/r, at most 2;
// a metre costs 1 + price (s² of what is soft + 10 s² of what is rigid). So free places cost 1, and soft ones
// can be pressed into at a price that grows with how much has to give way.
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

// All reduced words in which no hole is more often than the goal asks for, or than it is at the start. Where
// those are too many, there is one sheet, and holes are holes in walls.
void Guidance::set_sheets(const Windings& start) {
  std::vector<int> most;
  for (std::size_t h = 0; h < space_.holes.size(); ++h)
    most.push_back(std::max(space_.holes[h].pieces, pieces_in(start, int(h))));
  sheets_ = {{}};
  for (std::size_t s = 0; s < sheets_.size() && sheets_.size() <= max_sheets; ++s)
    for (int letter = -int(most.size()); letter <= int(most.size()); ++letter) {
      const Windings& word = sheets_[s];
      if (letter == 0 || (!word.empty() && word.back() == -letter)) continue;
      if (pieces_in(word, std::abs(letter) - 1) == most[std::size_t(std::abs(letter)) - 1]) continue;
      Windings longer = word;
      longer.push_back(letter);
      sheets_.push_back(std::move(longer));
    }
  if (sheets_.size() > max_sheets) sheets_ = {{}}, space_.holes.clear();
  for (std::size_t s = 0; s < sheets_.size(); ++s) sheet_of_[sheets_[s]] = int(s);
  near_hole_.assign(price_.size(), false);
  for (std::size_t c = 0; c < price_.size(); ++c)
    for (const Hole& hole : space_.holes) {
      const Vec3 away = center_of(int(c)) - hole.middle_m;
      const double step = 2 * space_.cell_m;  // longer than to any neighbour
      if (std::abs(away.dot(hole.normal)) < step && away.norm() < hole.radius_m + step) near_hole_[c] = true;
    }
}

// From the place to the middle of its cell the strand's end may pass through a hole, too.
int Guidance::node_at(const Vec3& place, Windings windings) const {
  const int cell = cell_at(place);
  if (space_.holes.empty()) return cell;
  wind(windings, space_.holes, place, center_of(cell));
  const auto sheet = sheet_of_.find(windings);
  return sheet == sheet_of_.end() ? -1 : sheet->second * cells() + cell;
}

int Guidance::sheet_behind(int sheet, int cell, int other) const {
  if (!near_hole_[std::size_t(cell)]) return sheet;
  Windings windings = sheets_[std::size_t(sheet)];
  wind(windings, space_.holes, center_of(cell), center_of(other));
  const auto found = sheet_of_.find(windings);
  return found == sheet_of_.end() ? -1 : found->second;
}

// A step backwards unwinds what the step itself winds, so from the goal the same rule holds.
void Guidance::renew() {
  const int nx = space_.cells.x(), ny = space_.cells.y(), nz = space_.cells.z();
  to_go_.assign(sheets_.size() * price_.size(), std::numeric_limits<float>::infinity());
  next_.assign(to_go_.size(), -1);
  using Entry = std::pair<float, int>;  // equal costs in order of cells: one result
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open;
  for (std::size_t s = 0; s < sheets_.size(); ++s) {
    if (!hangs_as_asked(sheets_[s], space_.holes)) continue;
    const int goal = int(s) * cells() + cell_at(goal_);
    to_go_[std::size_t(goal)] = 0, next_[std::size_t(goal)] = goal;
    open.emplace(0.0f, goal);
  }
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
    const auto [cost, at] = open.top();
    open.pop();
    if (cost > to_go_[std::size_t(at)]) continue;
    const int sheet = at / cells(), cell = at % cells();
    farthest_ = cost;
    const int x = cell % nx, y = cell / nx % ny, z = cell / (nx * ny);
    for (const Step& s : steps) {
      const int i = x + s.x, j = y + s.y, k = z + s.z;
      if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
      const int other = (k * ny + j) * nx + i;
      const float way = cost + 0.5f * s.length * (price_[std::size_t(cell)] + price_[std::size_t(other)]);
      const int behind = sheet_behind(sheet, cell, other);
      if (behind < 0) continue;
      const int from = behind * cells() + other;
      if (!(way < to_go_[std::size_t(from)])) continue;
      to_go_[std::size_t(from)] = way, next_[std::size_t(from)] = at;
      open.emplace(way, from);
    }
  }
}

double Guidance::to_go(const Vec3& place, const Windings& windings) const {
  const int from = node_at(place, windings);
  if (from < 0) return double(farthest_);
  // Within a cell the way to its middle's successor is measured, so that the number changes as the robot
  // moves.
  const int next = next_[std::size_t(from)];
  const Vec3 towards = next == from ? goal_ : center_of(next % cells());
  const double price = double(price_[std::size_t(from % cells())]);
  return double(to_go_[std::size_t(next)]) + price * (towards - place).norm();
}

Vec3 Guidance::ahead(const Vec3& place, double way_m, const Windings& windings) const {
  int node = node_at(place, windings);
  if (node < 0) return place;
  Vec3 here = place;
  while (next_[std::size_t(node)] != node) {
    node = next_[std::size_t(node)];
    const Vec3 to = center_of(node % cells());
    const double length = (to - here).norm();
    if (length >= way_m) return here + (to - here) * (way_m / length);
    way_m -= length;
    here = to;
  }
  const double length = (goal_ - here).norm();
  return length > way_m ? Vec3(here + (goal_ - here) * (way_m / length)) : goal_;
}

double Guidance::price(const Vec3& place) const { return double(price_[std::size_t(cell_at(place))]); }

// Of the cells within half the robot's radius, of one at least.
void Guidance::raise(const Vec3& place, double by) {
  const double reach = std::max(0.5 * space_.robot_radius_m, space_.cell_m);
  for (int c = 0; c < int(price_.size()); ++c)
    if ((center_of(c) - place).squaredNorm() <= reach * reach) price_[std::size_t(c)] += float(by);
}

}  // namespace limber::plan
