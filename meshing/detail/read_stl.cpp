#include <algorithm>
#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

constexpr std::size_t header_bytes = 84, facet_bytes = 50;

std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return lower;
}

}  // namespace

PolygonSoup read_stl_text(std::string_view text, const std::string& file) {
  PolygonSoup soup;
  TextScanner scanner(text, file, 0);
  int corners = -1;  // −1: not inside a facet
  bool inside_solid = false;
  while (scanner.next_line()) {
    // Some programs put several statements in a line.
    for (std::string word = lower_case(scanner.next_word()); !word.empty();
         word = lower_case(scanner.next_word())) {
      if (word == "solid" || word == "endsolid") {
        if (corners >= 0) scanner.complain("a solid begins or ends inside a facet");
        inside_solid = word == "solid";
        break;  // the rest of the line is its name
      } else if (word == "facet") {
        if (corners >= 0) scanner.complain("a facet begins inside a facet");
        corners = 0;
        if (lower_case(scanner.next_word()) != "normal") scanner.complain("expected \"facet normal x y z\"");
        for (int i = 0; i < 3; ++i) scanner.next_number("facet normal");  // the corners' order says it better
      } else if (word == "vertex") {
        if (corners < 0) scanner.complain("a vertex outside a facet");
        const double x = scanner.next_number("x"), y = scanner.next_number("y"), z = scanner.next_number("z");
        soup.add_corner(soup.add_position({x, y, z}));
        ++corners;
      } else if (word == "endfacet") {
        if (corners < 3) scanner.complain("the facet ends before its third vertex");
        soup.end_polygon();
        corners = -1;
      } else if (word != "outer" && word != "loop" && word != "endloop") {
        scanner.complain(fmt::format("\"{}\" is not a word of STL", word.substr(0, 40)));
      }
    }
  }
  if (corners >= 0)
    scanner.complain(fmt::format("the file ends inside facet {}: it is cut short", soup.polygon_count()));
  if (inside_solid)
    soup.warnings.push_back(
        fmt::format("there is no \"endsolid\" after the last of {} facets: the file may have been cut short",
                    soup.polygon_count()));
  return soup;
}

PolygonSoup read_stl_binary(std::string_view bytes, const std::string& file) {
  PolygonSoup soup;
  if (bytes.size() < header_bytes)
    throw InputError(
        fmt::format("{}: {} bytes are too few for an STL file, it is cut short", file, bytes.size()));
  std::uint32_t announced = 0;
  std::memcpy(&announced, bytes.data() + 80, 4);
  const std::size_t room = (bytes.size() - header_bytes) / facet_bytes;
  const std::size_t rest = (bytes.size() - header_bytes) % facet_bytes;
  if (announced > room && rest != 0)
    throw InputError(fmt::format(
        "{}: the STL header announces {} triangles, but the file ends inside triangle {}: it is cut short",
        file, announced, room));
  if (announced > room)
    soup.warnings.push_back(
        fmt::format("the STL header announces {} triangles, the file holds {}: those were read; if the "
                    "number is not just wrong, the "
                    "file was cut short",
                    announced, room));
  if (announced < room || (announced == room && rest != 0))
    soup.warnings.push_back(
        fmt::format("the STL header announces {} triangles; the {} bytes after them were not read", announced,
                    bytes.size() - header_bytes - announced * facet_bytes));
  const std::size_t triangles = std::min<std::size_t>(announced, room);
  for (std::size_t t = 0; t < triangles; ++t) {
    float corners[9];  // after 12 bytes of normal
    std::memcpy(corners, bytes.data() + header_bytes + facet_bytes * t + 12, sizeof corners);
    for (int c = 0; c < 3; ++c)
      soup.add_corner(soup.add_position({corners[3 * c], corners[3 * c + 1], corners[3 * c + 2]}));
    soup.end_polygon();
  }
  soup.note_single_precision();
  return soup;
}

}  // namespace limber::meshing::detail
