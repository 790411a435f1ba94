#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "core/error.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

// "7", "7/1", "7//3", "7/1/3": vertex 6; negative numbers count back from the vertex read last.
int vertex_of(std::string_view corner, const TextScanner& scanner, std::size_t vertices) {
  std::int64_t number = 0;
  if (!parse_integer(corner.substr(0, corner.find('/')), number) || number == 0)
    scanner.complain(
        fmt::format("corner \"{}\" of a face does not name a vertex (1 is the first, -1 the last)",
                    corner.substr(0, 40)));
  const std::int64_t vertex = number > 0 ? number - 1 : number + std::int64_t(vertices);
  // A vertex may come after the face that names it; require_indices() has the last word on those.
  if (vertex < 0 || vertex > std::numeric_limits<int>::max())
    scanner.complain(
        fmt::format("corner \"{}\" of a face: there are only {} vertices", corner.substr(0, 40), vertices));
  return int(vertex);
}

// "7/1", "7/1/3": place 0 of the coordinates; −1 where the corner names none.
std::int64_t uv_of(std::string_view corner, std::size_t uvs) {
  const std::size_t slash = corner.find('/');
  if (slash == std::string_view::npos) return -1;
  const std::string_view word = corner.substr(slash + 1, corner.find('/', slash + 1) - slash - 1);
  std::int64_t number = 0;
  if (!parse_integer(word, number) || number == 0) return -1;
  return number > 0 ? number - 1 : std::max<std::int64_t>(-1, number + std::int64_t(uvs));
}

Eigen::Vector2d read_uv(TextScanner& scanner) {
  Eigen::Vector2d uv(0, 0);
  for (int i = 0; i < 2; ++i)
    if (const std::string_view word = scanner.next_word(); !word.empty() && !parse_number(word, uv[i]))
      uv[i] = std::numeric_limits<double>::quiet_NaN();
  return uv;
}

// Three numbers after the place are a color, sRGB; one would be a weight.
std::optional<Vec3> read_color(TextScanner& scanner) {
  Vec3 color;
  for (int i = 0; i < 3; ++i)
    if (!parse_number(scanner.next_word(), color[i])) return std::nullopt;
  return color.unaryExpr([](double c) { return linear_from_srgb(c); });
}

// What comes of faces and coordinates that a corner names before they are read.
void require_uvs(PolygonSoup& soup) {
  if (soup.uvs.empty()) return soup.corner_uv.clear();
  int missing = 0;
  for (int& uv : soup.corner_uv)
    if (uv >= int(soup.uvs.size())) uv = -1, ++missing;
  if (missing > 0)
    soup.warnings.push_back(
        fmt::format("{} corners of faces name texture coordinates that are not there", missing));
}

// OBJ has no counts and no end, so a file cut between two lines is a whole file. Three traces may give it
// away: a comment that counts, vertices at the end that no face names, a last line without its end.

// What a comment line says: "# 8 vertices, 12 faces", "# Vertices: 8", "#Vertex Count 8".
struct Announced {
  std::int64_t vertices = 0, faces = 0, triangles = 0;
};

void read_announcement(std::string_view comment, Announced& most) {
  const auto next = [&] {
    const std::size_t begin = std::min(comment.find_first_not_of("# \t,:;="), comment.size());
    comment.remove_prefix(begin);
    const std::string_view word = comment.substr(0, comment.find_first_of(" \t,:;="));
    comment.remove_prefix(word.size());
    return word;
  };
  const auto count_of = [&](std::string_view word) -> std::int64_t* {
    std::string lower(word);
    for (char& c : lower)
      if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    if (lower == "vertices" || lower == "vertex" || lower == "verts") return &most.vertices;
    if (lower == "faces" || lower == "face" || lower == "polygons") return &most.faces;
    return lower == "triangles" ? &most.triangles : nullptr;
  };
  while (true) {
    std::string_view first = next(), second = next();
    if (second == "Count" || second == "count") second = next();
    std::int64_t number = 0, *count = nullptr;
    if (parse_integer(first, number))
      count = count_of(second);
    else if (parse_integer(second, number))
      count = count_of(first);
    if (!count) return;
    *count = std::max(*count, number);
  }
}

Announced announced_in_comments(std::string_view text) {
  Announced most;
  for (std::size_t at = text.find('#'); at != std::string_view::npos; at = text.find('#', at)) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    if (at == 0 || text[at - 1] == '\n' || text[at - 1] == '\r')
      read_announcement(text.substr(at, end - at), most);
    at = end;
  }
  return most;
}

// As many as a comment says may be of a part only, so fewer in the whole file is what counts.
void warn_of_missing(std::string_view text, std::int64_t faces, PolygonSoup& soup) {
  const Announced most = announced_in_comments(text);
  const std::int64_t vertices = std::int64_t(soup.positions.size()),
                     triangles = std::int64_t(soup.corners.size()) - 2 * soup.polygon_count();
  const auto compare = [&](std::int64_t said, std::int64_t here, const char* what) {
    if (here < said)
      soup.warnings.push_back(
          fmt::format("a comment in the file speaks of {} {}, but there are {}: it may have been cut short",
                      said, what, here));
  };
  compare(most.vertices, vertices, "vertices");
  compare(most.faces, faces, "faces");
  compare(most.triangles, triangles, "triangles");

  const int last_used =
      soup.corners.empty() ? -1 : *std::max_element(soup.corners.begin(), soup.corners.end());
  if (last_used >= 0 && last_used + 1 < vertices)
    soup.warnings.push_back(
        fmt::format("no face names any of the last {} of {} vertices: the file may have been cut short",
                    vertices - last_used - 1, vertices));
}

}  // namespace

PolygonSoup read_obj(std::string_view text, const std::string& file) {
  PolygonSoup soup;
  TextScanner scanner(text, file, '#');
  int too_small = 0, first_too_small = 0, free_form = 0, material = -1;
  std::map<std::string, int> material_named;
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.next_word();
    if (keyword == "v") {
      const double x = scanner.next_number("x"), y = scanner.next_number("y"), z = scanner.next_number("z");
      soup.add_position({x, y, z});  // a weight or a color may follow
      if (const std::optional<Vec3> color = read_color(scanner)) {
        soup.vertex_colors.resize(soup.positions.size() - 1, Vec3::Ones());
        soup.vertex_colors.push_back(*color);
      }
    } else if (keyword == "vt") {
      soup.uvs.push_back(read_uv(scanner));
    } else if (keyword == "usemtl") {
      const auto [at, fresh] =
          material_named.try_emplace(std::string(scanner.rest_of_line()), int(soup.materials.size()));
      if (fresh) soup.materials.push_back({.name = at->first});
      material = at->second;
    } else if (keyword == "mtllib") {
      soup.material_files.emplace_back(scanner.rest_of_line());
    } else if (keyword == "f" || keyword == "fo") {
      const int begin = int(soup.corners.size());
      for (std::string_view word = scanner.next_word(); !word.empty(); word = scanner.next_word()) {
        if (word == "\\") {  // the face goes on in the next line
          if (!scanner.next_line()) scanner.complain("the face goes on in a line that is not there");
        } else {
          soup.add_corner(vertex_of(word, scanner, soup.positions.size()));
          soup.corner_uv.push_back(
              int(std::min<std::int64_t>(uv_of(word, soup.uvs.size()), std::numeric_limits<int>::max())));
        }
      }
      if (int(soup.corners.size()) - begin >= 3) {
        soup.end_polygon();
        soup.polygon_material.push_back(material);
      } else {
        soup.corners.resize(std::size_t(begin));
        soup.corner_uv.resize(std::size_t(begin));
        if (too_small++ == 0) first_too_small = scanner.line();
      }
    } else if (keyword == "curv" || keyword == "surf") {
      ++free_form;
    }
  }
  if (too_small > 0)
    soup.warnings.push_back(fmt::format(
        "{} face(s) with fewer than 3 corners left out (the first in line {})", too_small, first_too_small));
  if (free_form > 0)
    soup.warnings.push_back(
        fmt::format("{} free-form curves and surfaces were left out: export them as triangles", free_form));
  soup.require_indices(file);
  require_uvs(soup);
  if (!soup.vertex_colors.empty()) soup.vertex_colors.resize(soup.positions.size(), Vec3::Ones());
  warn_of_missing(text, soup.polygon_count() + too_small, soup);
  if (scanner.ends_within_a_word()) soup.warnings.push_back(last_word_may_be_cut);
  return soup;
}

}  // namespace limber::meshing::detail
