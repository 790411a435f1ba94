// convert IN OUT [PARTS]: a model as triangles in OUT (.off or .stl, ASCII, 17 digits), read as the checker
// reads it. With PARTS each edge is cut into so many, each triangle into PARTS²: the same shape in more
// triangles.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>

#include "tools/check_cage/files.h"

using namespace check;

namespace {

Surface subdivided(const Surface& coarse, int parts) {
  Surface fine{coarse.points, {}};
  std::map<std::array<int, 3>, int> row_of;  // on the edge (low, high), so many parts from low
  const auto between = [&](int a, int b, int i) {
    if (i == 0) return a;
    if (i == parts) return b;
    if (a > b) std::swap(a, b), i = parts - i;
    const auto [found, is_new] = row_of.try_emplace({a, b, i}, int(fine.points.size()));
    if (is_new) {
      Point p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] =
            (coarse.points[std::size_t(a)][k] * (parts - i) + coarse.points[std::size_t(b)][k] * i) / parts;
      fine.points.push_back(p);
    }
    return found->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    // Row r holds the points (parts − r, r − j, j) of the triangle; its inner ones belong to no edge.
    std::vector<std::vector<int>> rows;
    for (int r = 0; r <= parts; ++r) {
      rows.emplace_back();
      for (int j = 0; j <= r; ++j) {
        if (j == 0 || j == r || r == parts) {
          rows.back().push_back(j == 0 ? between(a, b, r) : j == r ? between(a, c, r) : between(b, c, j));
          continue;
        }
        Point p;
        for (std::size_t k = 0; k < 3; ++k)
          p[k] = (coarse.points[std::size_t(a)][k] * (parts - r) +
                  coarse.points[std::size_t(b)][k] * (r - j) + coarse.points[std::size_t(c)][k] * j) /
                 parts;
        rows.back().push_back(int(fine.points.size()));
        fine.points.push_back(p);
      }
    }
    for (std::size_t r = 0; r < std::size_t(parts); ++r)
      for (std::size_t j = 0; j <= r; ++j) {
        fine.triangles.push_back({rows[r][j], rows[r + 1][j], rows[r + 1][j + 1]});
        if (j < r) fine.triangles.push_back({rows[r][j], rows[r + 1][j + 1], rows[r][j + 1]});
      }
  }
  return fine;
}

void write_off(std::ostream& out, const Surface& surface) {
  out << "OFF\n" << surface.points.size() << " " << surface.triangles.size() << " 0\n";
  for (const Point& p : surface.points) out << p[0] << " " << p[1] << " " << p[2] << "\n";
  for (const auto& [a, b, c] : surface.triangles) out << "3 " << a << " " << b << " " << c << "\n";
}

void write_stl(std::ostream& out, const Surface& surface) {
  out << "solid model\n";
  for (const Triangle& t : surface.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (int v : t) {
      const Point& p = surface.points[std::size_t(v)];
      out << "vertex " << p[0] << " " << p[1] << " " << p[2] << "\n";
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid model\n";
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3 || argc > 4) throw FileError("usage: convert IN OUT [PARTS]");
  const int parts = argc == 4 ? std::atoi(argv[3]) : 1;
  if (parts < 1 || parts > 100) throw FileError("PARTS: 1 to 100");
  const std::string out_file = argv[2];
  const Surface surface = subdivided(read_surface(argv[1]), parts);
  std::ofstream out(out_file);
  out.precision(17);
  out_file.ends_with(".stl") ? write_stl(out, surface) : write_off(out, surface);
  if (!out.flush()) throw FileError(out_file + ": cannot be written");
} catch (const FileError& error) {
  std::fprintf(stderr, "convert: %s\n", error.what());
  return 2;
}
