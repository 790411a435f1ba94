#include "meshing/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "core/error.h"
#include "meshing/detail/looks.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"
#include "meshing/detail/triangulate.h"
#include "meshing/repair.h"

namespace limber::meshing {

using detail::PolygonSoup;

namespace {

// ── what a file is
// ────────────────────────────────────────────────────────────────────────────────────────────────

enum class Format { obj, off, ply, stl_text, stl_binary, other };

struct Recognized {
  Format format;
  const char* name;
  const char* extension;
};

std::string lower_case_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return extension;
}

bool is_off_keyword(std::string_view word) {
  return word.ends_with("OFF") && word.find_first_not_of("STCNn4OF") == std::string_view::npos;
}

// A header that says "solid" proves nothing: binary writers put it there too. The size does.
bool has_size_of_binary_stl(std::string_view bytes) {
  if (bytes.size() < 84) return false;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + 80, 4);
  return bytes.size() == 84 + 50 * std::uint64_t(triangles);
}

bool is_text(std::string_view bytes) { return bytes.substr(0, 4096).find('\0') == std::string_view::npos; }

// The first line that is none of the words which OBJ files begin with decides; so does a first vertex.
bool looks_like_obj(std::string_view bytes, const std::string& file) {
  if (!is_text(bytes)) return false;
  constexpr std::array<std::string_view, 9> openings{"mtllib", "usemtl", "o", "g", "s", "vn", "vt", "f", "l"};
  detail::TextScanner scanner(bytes.substr(0, 100'000), file, '#');
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.next_word();
    double x = 0;
    if (keyword == "v") return detail::parse_number(scanner.next_word(), x);
    if (std::find(openings.begin(), openings.end(), keyword) == openings.end()) return false;
  }
  return false;
}

Recognized recognize(std::string_view bytes, const fs::path& path) {
  constexpr Recognized obj{Format::obj, "OBJ", ".obj"}, off{Format::off, "OFF", ".off"},
      ply{Format::ply, "PLY", ".ply"}, stl_text{Format::stl_text, "ASCII STL", ".stl"},
      stl_binary{Format::stl_binary, "binary STL", ".stl"}, other{Format::other, "", ""};
  const std::string file = path.filename().string(), extension = lower_case_extension(path);
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return ply;
  if (has_size_of_binary_stl(bytes)) return stl_binary;
  detail::TextScanner scanner(is_text(bytes) ? bytes : std::string_view(), file, '#');
  if (scanner.next_line()) {
    const std::string_view first_word = scanner.next_word();
    if (is_off_keyword(first_word)) return off;
    if (first_word == "solid" || first_word == "SOLID") return stl_text;
  }
  if (extension == ".obj") return obj;
  if (extension == ".off") return off;
  if (extension == ".ply") return ply;
  if (extension == ".stl" && !looks_like_obj(bytes, file)) return stl_binary;
  if ((extension == ".stl" || extension.empty() || extension == ".txt") && looks_like_obj(bytes, file))
    return obj;
  return other;
}

PolygonSoup read_soup(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    throw InputError(fmt::format("{}: is not a file; give the path of a model", path.string()));
  const std::string bytes = detail::without_byte_order_mark(read_file(path)), file = path.filename().string();
  if (bytes.empty()) throw InputError(file + ": the file is empty");
  const Recognized kind = recognize(bytes, path);
  PolygonSoup soup;
  switch (kind.format) {
    case Format::obj:
      soup = detail::read_obj(bytes, file);
      detail::read_materials(path, soup);
      break;
    case Format::off:
      soup = detail::read_off(bytes, file);
      break;
    case Format::ply:
      soup = detail::read_ply(bytes, file);
      break;
    case Format::stl_text:
      soup = detail::read_stl_text(bytes, file);
      break;
    case Format::stl_binary:
      soup = detail::read_stl_binary(bytes, file);
      break;
    case Format::other:
      return detail::read_by_assimp(path);
  }
  const std::string extension = lower_case_extension(path);
  if (!extension.empty() && extension != kind.extension)
    soup.warnings.push_back(
        fmt::format("the file is named \"{}\" but holds {}: read as such", extension, kind.name));
  return soup;
}

// ── from what it says to what can be computed with
// ────────────────────────────────────────────────────────────────

constexpr double largest_coordinate = 1e30, smallest_diagonal_m = 1e-30;
constexpr double max_rounding = 1e-5;  // of the diagonal, without a word

void require_valid(const ImportOptions& options) {
  if (!(std::isfinite(options.scale) && options.scale > 0))
    throw InputError(fmt::format("scale {}: must be a number above 0 (metres a file unit)", options.scale));
  if (!(options.weld_tolerance >= 0 && options.weld_tolerance < 0.1))
    throw InputError(
        fmt::format("weld tolerance {}: must be from 0 to 0.1 of the diagonal", options.weld_tolerance));
}

Points placed(const std::vector<Vec3>& positions, const ImportOptions& options) {
  Points rows(Eigen::Index(positions.size()), 3);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Vec3& p = positions[v];
    rows.row(Eigen::Index(v)) = options.scale * (options.y_up ? Vec3(p.x(), -p.z(), p.y()) : p);
  }
  return rows;
}

// Vertices that no place can be given to become not-a-number, whole.
Defect blank_out_unusable(Points& positions) {
  Defect unusable;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    if (positions.row(v).allFinite() && positions.row(v).cwiseAbs().maxCoeff() <= largest_coordinate)
      continue;
    if (++unusable.count <= 5)
      unusable.places.push_back(
          fmt::format("vertex {} ({} {} {})", v, positions(v, 0), positions(v, 1), positions(v, 2)));
    positions.row(v).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return unusable;
}

struct Triangulated {
  Triangles triangles;
  std::vector<detail::TriangleOrigin> origins;  // a triangle
  Defect n_gons;
  int lost_faces = 0;  // with a corner that has no place
};

Triangulated triangulated(const PolygonSoup& soup, const Points& positions) {
  Triangulated result;
  std::vector<std::array<int, 3>> of_polygon;  // places of its corners
  for (int i = 0; i < soup.polygon_count(); ++i) {
    const std::span<const int> corners(soup.corners.data() + soup.first_corner[i],
                                       std::size_t(soup.first_corner[i + 1] - soup.first_corner[i]));
    if (std::any_of(corners.begin(), corners.end(), [&](int v) { return !positions.row(v).allFinite(); })) {
      ++result.lost_faces;
      continue;
    }
    if (corners.size() > 3 && ++result.n_gons.count <= 5)
      result.n_gons.places.push_back(fmt::format("face {} with {} corners", i, corners.size()));
    of_polygon.clear();
    if (corners.size() == 3) {
      of_polygon.push_back({0, 1, 2});
    } else {
      Points places(std::ssize(corners), 3);
      std::vector<int> all(corners.size());
      for (std::size_t c = 0; c < corners.size(); ++c)
        places.row(Eigen::Index(c)) = positions.row(corners[c]), all[c] = int(c);
      detail::triangulate(places, all, of_polygon);
    }
    const int first = soup.first_corner[i];
    for (const auto& [a, b, c] : of_polygon) result.origins.push_back({i, {first + a, first + b, first + c}});
  }
  result.triangles.resize(std::ssize(result.origins), 3);
  for (std::size_t t = 0; t < result.origins.size(); ++t)
    for (int c = 0; c < 3; ++c)
      result.triangles(Eigen::Index(t), c) = soup.corners[result.origins[t].corners[std::size_t(c)]];
  return result;
}

// Makes triangles name the representatives; notes vertices that fall together, and those in no face.
void weld_vertices(SurfaceMesh& mesh, double tolerance_m, Defect& duplicate, Defect& isolated) {
  const std::vector<int> representative = weld(mesh.positions, tolerance_m);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) mesh.triangles(t, c) = representative[mesh.triangles(t, c)];
  std::vector<char> used(representative.size(), false);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) used[mesh.triangles(t, c)] = true;
  const auto note = [&](Defect& defect, int v) {
    if (++defect.count <= 5)
      defect.places.push_back(fmt::format("vertex {} at ({:.6g} {:.6g} {:.6g})", v, mesh.positions(v, 0),
                                          mesh.positions(v, 1), mesh.positions(v, 2)));
  };
  for (int v = 0; v < int(representative.size()); ++v) {
    if (!mesh.positions.row(v).allFinite()) continue;
    if (representative[v] != v)
      note(duplicate, v);
    else if (!used[v])
      note(isolated, v);
  }
}

std::string counted(std::int64_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

void require_some_triangle(const PolygonSoup& soup, const Triangulated& faces, std::int64_t unusable,
                           const std::string& file) {
  if (soup.polygon_count() == 0 && soup.positions.empty())
    throw InputError(
        fmt::format("{}: holds no faces and no points; is it an animation without a mesh, or empty?", file));
  if (soup.polygon_count() == 0)
    throw InputError(fmt::format("{}: holds no faces, only {}; points and lines alone are no surface", file,
                                 counted(std::int64_t(soup.positions.size()), "vertex", "vertices")));
  if (faces.lost_faces * 2 > soup.polygon_count())
    throw InputError(fmt::format(
        "{}: {} of {} faces have a corner that is infinite, not a number or above {:g} ({} such vertices); "
        "export the model again",
        file, faces.lost_faces, soup.polygon_count(), largest_coordinate, unusable));
}

// Removes what a surface can do without and turns the rest the right way round.
void mend(ImportedModel& model, double tolerance_m, CornerMap* corners) {
  auto& [mesh, appearance, found, left, mended, warnings] = model;
  const int collapsed = drop_collapsed(mesh, corners);
  if (collapsed > 0)
    mended.push_back(counted(collapsed, "face", "faces") + " whose corners fall together dropped");
  const int duplicates = drop_duplicates(mesh, corners);
  if (duplicates > 0)
    mended.push_back(counted(duplicates, "duplicate face", "duplicate faces") + " dropped, one of each kept");

  const Orientation orientation = orient(mesh, corners);
  if (orientation.turned_triangles > 0)
    mended.push_back(counted(orientation.turned_triangles, "triangle", "triangles") +
                     " turned to agree with their neighbours");
  if (orientation.turned_components > 0)
    mended.push_back(counted(orientation.turned_components, "component", "components") +
                     " turned inside out to face outward");
  for (const Vec3& p : orientation.inner)
    if (++found.inner_components.count <= 5)
      found.inner_components.places.push_back(fmt::format("at ({:.6g} {:.6g} {:.6g})", p.x(), p.y(), p.z()));
  if (orientation.cavities > 0)
    warnings.push_back(counted(orientation.cavities, "inner component faces", "inner components face") +
                       " inward and stays so: taken as a cavity");
  if (orientation.one_sided > 0)
    warnings.push_back(counted(orientation.one_sided, "piece is", "pieces are") +
                       " one-sided, like a Möbius strip: left as in the file");

  const Flattened flat = remove_flat(mesh, tolerance_m, corners);
  if (flat.flipped > 0)
    mended.push_back(counted(flat.flipped, "face", "faces") +
                     " without area merged into a neighbour, the surface is the same");
  if (flat.dropped > 0) mended.push_back(counted(flat.dropped, "face", "faces") + " without area dropped");
}

ImportedModel finish(const PolygonSoup& soup, const ImportOptions& options, const std::string& file) {
  require_valid(options);
  ImportedModel model;
  model.warnings = soup.warnings;
  SurfaceMesh& mesh = model.surface;

  mesh.positions = placed(soup.positions, options);
  Defect unusable = blank_out_unusable(mesh.positions);
  Triangulated faces = triangulated(soup, mesh.positions);
  require_some_triangle(soup, faces, unusable.count, file);
  mesh.triangles = std::move(faces.triangles);
  const Appearance looks = detail::appearance_of(soup, faces.origins, model.warnings);
  faces.origins = {};
  CornerMap corners;
  if (!looks.empty()) corners = same_corners(mesh.triangles.rows());
  if (unusable)
    model.warnings.push_back(
        fmt::format("{} and {} at them dropped, the first: {}",
                    counted(unusable.count, "vertex that is not finite", "vertices that are not finite"),
                    counted(faces.lost_faces, "face", "faces"), unusable.places.front()));
  if (faces.n_gons)
    model.mended.push_back(counted(faces.n_gons.count, "face", "faces") +
                           " of more than three corners cut into triangles");

  const double tolerance_m = weld_tolerance_m(mesh, options.weld_tolerance);
  Defect duplicate, isolated;
  weld_vertices(mesh, tolerance_m, duplicate, isolated);
  if (duplicate)
    model.mended.push_back(counted(duplicate.count, "vertex", "vertices") +
                           " welded to another at the same place");
  model.found = find_defects(mesh, tolerance_m);
  model.found.n_gons = std::move(faces.n_gons);
  model.found.non_finite_vertices = std::move(unusable);
  model.found.duplicate_vertices = std::move(duplicate);
  model.found.isolated_vertices = std::move(isolated);

  mend(model, tolerance_m, looks.empty() ? nullptr : &corners);
  if (mesh.triangles.rows() == 0)
    throw InputError(
        fmt::format("{}: none of its {} triangles has an area; is the model flattened, or the scale wrong?",
                    file, model.found.triangles));
  drop_unused(mesh);
  model.appearance = carried(looks, corners);
  model.appearance.drop_unused();
  if (const std::int64_t unused = model.found.isolated_vertices.count; unused > 0) {
    model.mended.push_back(counted(unused, "vertex", "vertices") + " in no face dropped");
    if (unused * 10 > model.found.vertices)
      model.warnings.push_back(
          fmt::format("{} of {} vertices are in no face: the file may have been cut short; {} triangles "
                      "were read",
                      unused, model.found.vertices, model.found.triangles));
  }
  const double diagonal_m = bounding_box(mesh.positions).diagonal();
  if (diagonal_m < smallest_diagonal_m)
    throw InputError(
        fmt::format("{}: the model is only {:.3g} m large; give a larger scale", file, diagonal_m));
  if (const double rounding_m = options.scale * soup.rounding; rounding_m > max_rounding * diagonal_m)
    model.warnings.push_back(fmt::format(
        "the file holds single precision, and lies so far from the origin that this rounds vertices by "
        "{:.1g} of the model's size: move it to the origin and export it again",
        rounding_m / diagonal_m));

  model.left = find_defects(mesh, tolerance_m);
  model.left.inner_components = model.found.inner_components;
  if (options.count_self_intersections) count_self_intersections(mesh, model.left);
  for (const std::string& sentence : sentences(model.left))
    model.warnings.push_back("left as it is: " + sentence);
  validate(mesh, file);
  return model;
}

}  // namespace

ImportedModel import_model(const fs::path& path, const ImportOptions& options) {
  const PolygonSoup soup = read_soup(path);
  ImportedModel model = finish(soup, options, path.filename().string());
  detail::read_images(path, soup, model.appearance, model.warnings);
  return model;
}

const std::vector<std::string>& model_endings() {
  static const std::vector<std::string> endings = [] {
    std::vector<std::string> all = detail::endings_of_assimp();
    all.insert(all.end(), {".obj", ".off", ".ply", ".stl"});
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }();
  return endings;
}

ImportedModel clean(const SurfaceMesh& raw, const ImportOptions& options, const std::string& what) {
  PolygonSoup soup;
  for (Eigen::Index v = 0; v < raw.positions.rows(); ++v) soup.add_position(raw.positions.row(v));
  for (Eigen::Index t = 0; t < raw.triangles.rows(); ++t) {
    for (int c = 0; c < 3; ++c) soup.add_corner(raw.triangles(t, c));
    soup.end_polygon();
  }
  soup.require_indices(what);
  return finish(soup, options, what);
}

Json to_json(const ImportedModel& model) {
  return {{"found", to_json(model.found)},
          {"left", to_json(model.left)},
          {"mended", model.mended},
          {"warnings", model.warnings}};
}

}  // namespace limber::meshing
