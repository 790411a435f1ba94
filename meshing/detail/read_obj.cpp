#include <limits>

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

}  // namespace

PolygonSoup read_obj(std::string_view text, const std::string& file) {
  PolygonSoup soup;
  TextScanner scanner(text, file, '#');
  int too_small = 0, first_too_small = 0, free_form = 0;
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.next_word();
    if (keyword == "v") {
      const double x = scanner.next_number("x"), y = scanner.next_number("y"), z = scanner.next_number("z");
      soup.add_position({x, y, z});  // a weight or a colour may follow
    } else if (keyword == "f" || keyword == "fo") {
      const int begin = int(soup.corners.size());
      for (std::string_view word = scanner.next_word(); !word.empty(); word = scanner.next_word()) {
        if (word == "\\") {  // the face goes on in the next line
          if (!scanner.next_line()) scanner.complain("the face goes on in a line that is not there");
        } else {
          soup.add_corner(vertex_of(word, scanner, soup.positions.size()));
        }
      }
      if (int(soup.corners.size()) - begin >= 3) {
        soup.end_polygon();
      } else {
        soup.corners.resize(std::size_t(begin));
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
  return soup;
}

}  // namespace limber::meshing::detail
