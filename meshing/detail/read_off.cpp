#include "core/error.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

// "OFF", "COFF", "STCNOFF": what else a vertex carries comes after its coordinates, in the same line.
void require_three_coordinates(std::string_view keyword, const TextScanner& scanner) {
  const std::string_view prefix = keyword.substr(0, keyword.find("OFF"));
  if (prefix.find_first_of("4n") != std::string_view::npos)
    scanner.complain(fmt::format("{} has points of other than three coordinates", keyword));
}

}  // namespace

PolygonSoup read_off(std::string_view text, const std::string& file) {
  PolygonSoup soup;
  TextScanner scanner(text, file, '#');
  if (!scanner.next_line()) scanner.complain("an OFF file starts with the word OFF");
  TextScanner at_counts = scanner;
  const std::string_view keyword = scanner.next_word();
  if (keyword.ends_with("OFF")) {
    require_three_coordinates(keyword, scanner);
    at_counts = scanner;
    const std::string_view counts_or_kind = scanner.next_word();
    if (counts_or_kind == "BINARY")
      scanner.complain("binary OFF is not read: export the model as ASCII OFF or PLY");
    if (counts_or_kind.empty()) {
      if (!scanner.next_line()) scanner.complain("the numbers of vertices and faces are missing");
      at_counts = scanner;
    }
  }
  const std::int64_t vertices = at_counts.next_integer("number of vertices");
  const std::int64_t faces = at_counts.next_integer("number of faces");
  if (vertices < 0 || faces < 0) at_counts.complain("a negative number of vertices or faces");

  for (std::int64_t v = 0; v < vertices; ++v) {
    if (!at_counts.next_line())
      at_counts.complain(fmt::format(
          "{} vertices were announced, but the file ends after {}: it is cut short", vertices, v));
    const double x = at_counts.next_number("x"), y = at_counts.next_number("y"),
                 z = at_counts.next_number("z");
    soup.add_position({x, y, z});
  }
  int too_small = 0, first_too_small = 0;
  for (std::int64_t f = 0; f < faces; ++f) {
    if (!at_counts.next_line())
      at_counts.complain(
          fmt::format("{} faces were announced, but the file ends after {}: it is cut short", faces, f));
    const std::int64_t size = at_counts.next_integer("number of corners of a face");
    if (size < 0) at_counts.complain("a face with a negative number of corners");
    if (size < 3) {
      if (too_small++ == 0) first_too_small = at_counts.line();
      continue;
    }
    for (std::int64_t c = 0; c < size; ++c) {
      const std::int64_t vertex = at_counts.next_integer("corner of a face");
      if (vertex < 0 || vertex >= vertices)
        at_counts.complain(
            fmt::format("a face names vertex {}, but they go from 0 to {}", vertex, vertices - 1));
      soup.add_corner(int(vertex));
    }
    soup.end_polygon();
  }
  if (too_small > 0)
    soup.warnings.push_back(fmt::format(
        "{} face(s) with fewer than 3 corners left out (the first in line {})", too_small, first_too_small));
  if (at_counts.next_line())
    soup.warnings.push_back(fmt::format(
        "the file announces {} vertices and {} faces; what follows them, from line {}, was not read",
        vertices, faces, at_counts.line()));
  else if (at_counts.ends_within_a_word())
    soup.warnings.push_back(last_word_may_be_cut);
  return soup;
}

}  // namespace limber::meshing::detail
