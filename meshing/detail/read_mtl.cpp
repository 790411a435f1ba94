#include <map>

#include "core/error.h"
#include "meshing/detail/companions.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

constexpr std::uintmax_t max_bytes = 16 << 20;

// How many words follow an option of a map at least; numbers after -o, -s and -t may be up to three.
int words_after(std::string_view option) {
  if (option == "-mm") return 2;
  return option == "-o" || option == "-s" || option == "-t" ? 3 : 1;
}

// The path of a map: what is left of the line after its options. `shifted`: they move or scale the image.
std::string path_of_map(TextScanner& scanner, bool& shifted) {
  std::string_view word = scanner.next_word();
  while (word.size() > 1 && word[0] == '-') {
    const bool moves = word == "-o" || word == "-s";
    const double usual = word == "-s" ? 1 : 0;
    const int words = words_after(word);
    double value = 0;
    word = scanner.next_word();
    for (int i = 0; i < words && !word.empty(); ++i) {
      const bool is_number = parse_number(word, value);
      if (words == 3 && !is_number) break;
      shifted = shifted || (moves && is_number && value != usual);
      word = scanner.next_word();
    }
  }
  std::string path(word);
  if (const std::string_view rest = scanner.rest_of_line(); !rest.empty()) path.append(1, ' ').append(rest);
  return path;
}

// Of one file, into those materials that the model uses. sRGB, as most programs write and read Kd.
void read_mtl(std::string_view text, const std::string& file, PolygonSoup& soup,
              const std::map<std::string, int>& material_named, std::vector<bool>& defined) {
  TextScanner scanner(text, file, '#');
  SurfaceMaterial* material = nullptr;
  bool shifted = false;
  const auto read_image = [&](int& image) {
    if (const std::string path = path_of_map(scanner, shifted); !path.empty())
      image = soup.add_image({.path = path, .bytes = {}});
  };
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.next_word();
    if (keyword == "newmtl") {
      const auto at = material_named.find(std::string(scanner.rest_of_line()));
      material = nullptr;
      if (at == material_named.end()) continue;
      material = &soup.materials[std::size_t(at->second)];
      defined[std::size_t(at->second)] = true;
    } else if (!material) {
      continue;
    } else if (keyword == "Kd") {
      Vec3 color;
      bool good = true;
      for (int c = 0; c < 3; ++c) good = good && parse_number(scanner.next_word(), color[c]);
      if (good) material->color = color.unaryExpr([](double c) { return linear_from_srgb(c); });
    } else if (keyword == "map_Kd") {
      read_image(material->image);
    } else if (keyword == "norm" || keyword == "map_Bump" || keyword == "map_bump" || keyword == "bump") {
      read_image(material->normal_image);
    }
  }
  if (shifted)
    soup.warnings.push_back(
        fmt::format("{}: images that are shifted or scaled by -o or -s are shown without that", file));
}

}  // namespace

void read_materials(const fs::path& model, PolygonSoup& soup) {
  std::map<std::string, int> material_named;
  for (const SurfaceMaterial& m : soup.materials) material_named.emplace(m.name, int(material_named.size()));
  std::vector<bool> defined(soup.materials.size(), false);
  for (const std::string& file : soup.material_files) {
    const Companion found = read_companion(model, file, max_bytes);
    if (found.bytes)
      read_mtl(without_byte_order_mark(*found.bytes), file, soup, material_named, defined);
    else
      soup.warnings.push_back("materials: " + found.complaint);
  }
  for (int& m : soup.polygon_material)
    if (m >= 0 && !defined[std::size_t(m)]) m = -1;
  for (SurfaceMaterial& m : soup.materials)
    if (m.image >= 0 && m.color.isZero()) m.color.setOnes();  // some programs write no color beside an image
}

}  // namespace limber::meshing::detail
