#include "tools/check_cage/files.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

namespace check {
namespace {

std::string whole(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  if (!in) throw FileError(file + ": cannot be read");
  return std::move(out).str();
}

std::string ending_of(const std::string& file) {
  std::string ending = file.substr(std::min(file.size(), file.rfind('.')));
  for (char& c : ending) c = char(std::tolower(c));
  return ending;
}

// Words of a text, and the lines they stand on.
class Words {
 public:
  Words(const std::string& file, const std::string& text, std::size_t begin = 0)
      : file_(file), text_(text), at_(begin) {}

  // The next word of any line, past comments that begin with '#'; empty at the end.
  std::string_view next() {
    for (;;) {
      while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
      if (at_ >= text_.size()) return {};
      if (text_[at_] != '#') break;
      skip_line();
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return std::string_view(text_).substr(begin, at_ - begin);
  }
  // The next word of this line; empty at its end.
  std::string_view next_of_line() {
    while (at_ < text_.size() && text_[at_] != '\n' && std::isspace(static_cast<unsigned char>(text_[at_])))
      ++at_;
    return at_ < text_.size() && text_[at_] != '\n' ? next() : std::string_view{};
  }
  void skip_line() { at_ = std::min(text_.find('\n', at_), text_.size()); }

  template <class Number>
  Number number(std::string_view word) const {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      throw FileError(file_ + ": '" + std::string(word) + "' is no number, byte " + std::to_string(at_));
    return value;
  }
  int integer() { return number<int>(next()); }
  double real() { return number<double>(next()); }
  Point point() {
    const double x = real(), y = real();
    return {x, y, real()};
  }
  int count() {
    const int n = integer();
    if (n < 0 || std::size_t(n) > text_.size()) throw FileError(file_ + ": a count of " + std::to_string(n));
    return n;
  }

 private:
  const std::string& file_;
  const std::string& text_;
  std::size_t at_;
};

// Polygon → triangles by clipping ears in the plane across the axis along which its Newell normal is longest.
void add_polygon(const std::vector<Point>& points, std::vector<int> corners,
                 std::vector<Triangle>& triangles) {
  std::array<double, 3> normal{};
  for (std::size_t i = 0; i < corners.size() && corners.size() > 3; ++i) {
    const Point &p = points[std::size_t(corners[i])],
                &q = points[std::size_t(corners[(i + 1) % corners.size()])];
    for (std::size_t k = 0; k < 3; ++k)
      normal[k] += (p[(k + 1) % 3] - q[(k + 1) % 3]) * (p[(k + 2) % 3] + q[(k + 2) % 3]);
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  const double side = normal[axis] < 0 ? -1 : 1;
  const auto turn = [&](int a, int b, int c) {
    const Point &p = points[std::size_t(a)], &q = points[std::size_t(b)], &r = points[std::size_t(c)];
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    return side * ((q[u] - p[u]) * (r[v] - p[v]) - (q[v] - p[v]) * (r[u] - p[u]));
  };
  while (corners.size() > 3) {
    const std::size_t n = corners.size();
    std::size_t ear = 1;  // where no corner is an ear (the polygon crosses itself), any will do
    for (std::size_t i = 0; i < n; ++i) {
      const int a = corners[(i + n - 1) % n], b = corners[i], c = corners[(i + 1) % n];
      const bool empty = std::none_of(corners.begin(), corners.end(), [&](int p) {
        return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
      });
      if (turn(a, b, c) > 0 && empty) {
        ear = i;
        break;
      }
    }
    triangles.push_back({corners[(ear + n - 1) % n], corners[ear], corners[(ear + 1) % n]});
    corners.erase(corners.begin() + std::ptrdiff_t(ear));
  }
  if (corners.size() == 3) triangles.push_back({corners[0], corners[1], corners[2]});
}

void check_rows(const std::string& file, const auto& elements, std::size_t points) {
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (int v : elements[e])
      if (v < 0 || std::size_t(v) >= points)
        throw FileError(file + ": element " + std::to_string(e) + " names vertex " + std::to_string(v) +
                        " of " + std::to_string(points));
}

struct Polygons {
  std::vector<Point> points;
  std::vector<std::vector<int>> faces;
  std::vector<int> shell_from_face;  // OBJ: how many g or o lines came before
};

Polygons read_off(const std::string& file, const std::string& text) {
  Words words(file, text);
  const std::string_view magic = words.next();
  if (!magic.ends_with("OFF")) throw FileError(file + ": does not begin with OFF");
  const int vertices = words.count(), faces = words.count();
  words.integer();  // edges
  Polygons mesh;
  for (int v = 0; v < vertices; ++v) {
    mesh.points.push_back(words.point());
    words.skip_line();  // colours, normals
  }
  for (int f = 0; f < faces; ++f) {
    std::vector<int> face(std::size_t(words.count()));
    for (int& v : face) v = words.integer();
    mesh.faces.push_back(std::move(face));
    words.skip_line();
  }
  return mesh;
}

Polygons read_obj(const std::string& file, const std::string& text) {
  Words words(file, text);
  Polygons mesh;
  int groups = 0;
  for (std::string_view key = words.next(); !key.empty(); key = words.next()) {
    if (key == "v") {
      mesh.points.push_back(words.point());
    } else if (key == "g" || key == "o") {
      ++groups;
    } else if (key == "f") {
      std::vector<int> face;
      for (std::string_view word = words.next_of_line(); !word.empty(); word = words.next_of_line()) {
        const int v = words.number<int>(word.substr(0, word.find('/')));
        face.push_back(v < 0 ? int(mesh.points.size()) + v : v - 1);
      }
      mesh.faces.push_back(std::move(face));
      mesh.shell_from_face.push_back(groups);
    }
    words.skip_line();
  }
  return mesh;
}

struct Property {
  std::string name, type, count_type;  // count_type is empty where it is no list
};

// The next value of a PLY, as its type says.
class PlyValues {
 public:
  PlyValues(const std::string& file, const std::string& text, std::size_t begin, const std::string& format)
      : file_(file), text_(text), at_(begin), words_(file, text, begin), ascii_(format == "ascii") {
    swapped_ = (format == "binary_big_endian") != (std::endian::native == std::endian::big);
  }
  double next(const std::string& type) {
    if (ascii_) return words_.real();
    if (type == "char" || type == "int8") return raw<std::int8_t>();
    if (type == "uchar" || type == "uint8") return raw<std::uint8_t>();
    if (type == "short" || type == "int16") return raw<std::int16_t>();
    if (type == "ushort" || type == "uint16") return raw<std::uint16_t>();
    if (type == "int" || type == "int32") return raw<std::int32_t>();
    if (type == "uint" || type == "uint32") return raw<std::uint32_t>();
    if (type == "float" || type == "float32") return raw<float>();
    if (type == "double" || type == "float64") return raw<double>();
    throw FileError(file_ + ": PLY type " + type);
  }

 private:
  template <class Value>
  Value raw() {
    if (text_.size() - at_ < sizeof(Value)) throw FileError(file_ + ": ends early");
    char bytes[sizeof(Value)];
    std::memcpy(bytes, text_.data() + at_, sizeof(Value));
    if (swapped_) std::reverse(bytes, bytes + sizeof(Value));
    at_ += sizeof(Value);
    Value value;
    std::memcpy(&value, bytes, sizeof(Value));
    return value;
  }
  const std::string& file_;
  const std::string& text_;
  std::size_t at_;
  Words words_;
  bool ascii_, swapped_;
};

Polygons read_ply(const std::string& file, const std::string& text) {
  std::istringstream header(text.substr(0, std::min<std::size_t>(text.size(), 1 << 16)));
  std::string line, format;
  struct Element {
    std::string name;
    std::size_t count;
    std::vector<Property> properties;
  };
  std::vector<Element> elements;
  if (!text.starts_with("ply")) throw FileError(file + ": does not begin with ply");
  while (std::getline(header, line) && !line.starts_with("end_header")) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "format") words >> format;
    if (key == "element") {
      elements.emplace_back();
      words >> elements.back().name >> elements.back().count;
    }
    if (key == "property" && !elements.empty()) {
      Property p;
      words >> p.type;
      if (p.type == "list") words >> p.count_type >> p.type;
      words >> p.name;
      elements.back().properties.push_back(p);
    }
  }
  if (!header) throw FileError(file + ": has no end_header");
  for (const Element& element : elements)
    if (element.count > text.size() || element.properties.empty())
      throw FileError(file + ": " + std::to_string(element.count) + " of " + element.name);
  PlyValues values(file, text, std::size_t(header.tellg()), format);
  Polygons mesh;
  for (const Element& element : elements)
    for (std::size_t i = 0; i < element.count; ++i) {
      Point point{};
      for (const Property& p : element.properties) {
        if (p.count_type.empty()) {
          const double value = values.next(p.type);
          if (p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z')
            point[std::size_t(p.name[0] - 'x')] = value;
          continue;
        }
        const double corners = values.next(p.count_type);
        if (!(corners >= 0 && corners <= double(text.size())))
          throw FileError(file + ": a face of " + std::to_string(corners) + " corners");
        std::vector<int> face(std::size_t(corners), 0);
        for (int& v : face) v = int(values.next(p.type));
        if (element.name == "face" && p.name.starts_with("vertex_ind")) mesh.faces.push_back(std::move(face));
      }
      if (element.name == "vertex") mesh.points.push_back(point);
    }
  return mesh;
}

Polygons read_stl(const std::string& file, const std::string& text) {
  Polygons mesh;
  const auto add = [&](const Point& p) {
    if (mesh.points.size() % 3 == 0) mesh.faces.emplace_back();
    mesh.faces.back().push_back(int(mesh.points.size()));
    mesh.points.push_back(p);
  };
  std::uint32_t count = 0;
  if (text.size() >= 84) std::memcpy(&count, text.data() + 80, 4);
  if (text.size() >= 84 && text.size() == 84 + 50 * std::size_t(count)) {
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t corner = 0; corner < 3; ++corner) {
        float p[3];
        std::memcpy(p, text.data() + 84 + 50 * t + 12 * (corner + 1), 12);
        add({p[0], p[1], p[2]});
      }
    return mesh;
  }
  Words words(file, text);
  for (std::string_view word = words.next(); !word.empty(); word = words.next())
    if (word == "vertex") add(words.point());
  return mesh;
}

Polygons read_polygons(const std::string& file) {
  const std::string text = whole(file), ending = ending_of(file);
  Polygons mesh = ending == ".off"   ? read_off(file, text)
                  : ending == ".obj" ? read_obj(file, text)
                  : ending == ".ply" ? read_ply(file, text)
                  : ending == ".stl" ? read_stl(file, text)
                                     : throw FileError(file + ": is no .off, .obj, .ply or .stl");
  check_rows(file, mesh.faces, mesh.points.size());
  for (const Point& p : mesh.points)
    for (double x : p)
      if (!std::isfinite(x)) throw FileError(file + ": has a coordinate that is not finite");
  return mesh;
}

// Only the points that the triangles name, and one for all at the same place.
Surface welded(const Surface& surface, double scale) {
  Surface out;
  std::map<Point, int> row_of;
  for (Triangle t : surface.triangles) {
    for (int& v : t) {
      Point p = surface.points[std::size_t(v)];
      for (double& x : p) x = x * scale + 0.0;  // no negative zero
      const auto [found, is_new] = row_of.try_emplace(p, int(out.points.size()));
      if (is_new) out.points.push_back(p);
      v = found->second;
    }
    out.triangles.push_back(t);
  }
  return out;
}

TetMesh read_gmsh(const std::string& file, const std::string& text) {
  Words words(file, text);
  TetMesh mesh;
  std::map<int, int> row_of;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "$MeshFormat" && (!words.next().starts_with("2") || words.next() != "0"))
      throw FileError(file + ": is not Gmsh 2 ASCII");
    if (word == "$Nodes")
      for (int n = words.count(); n > 0; --n) {
        row_of[words.integer()] = int(mesh.points.size());
        mesh.points.push_back(words.point());
      }
    if (word == "$Elements")
      for (int n = words.count(); n > 0; --n) {
        words.integer();
        const int type = words.integer();
        for (int tags = words.integer(); tags > 0; --tags) words.integer();
        constexpr int linear_tet = 4;
        if (type == linear_tet) {
          Tet t;
          for (int& v : t) {
            const auto found = row_of.find(words.integer());
            v = found == row_of.end() ? -1 : found->second;
          }
          mesh.tets.push_back(t);
        }
        words.skip_line();
      }
  }
  return mesh;
}

TetMesh read_medit(const std::string& file, const std::string& text) {
  Words words(file, text);
  TetMesh mesh;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "Vertices")
      for (int n = words.count(); n > 0; --n) {
        mesh.points.push_back(words.point());
        words.integer();
      }
    if (word == "Tetrahedra")
      for (int n = words.count(); n > 0; --n) {
        Tet t;
        for (int& v : t) v = words.integer() - 1;
        words.integer();
        mesh.tets.push_back(t);
      }
  }
  return mesh;
}

TetMesh read_tetgen(const std::string& ele_file) {
  const std::string node_file = ele_file.substr(0, ele_file.size() - 4) + ".node";
  const std::string nodes = whole(node_file), elements = whole(ele_file);
  TetMesh mesh;
  Words words(node_file, nodes);
  const int points = words.count();
  int first = 0;
  words.skip_line();
  for (int i = 0; i < points; ++i) {
    const int number = words.integer();
    if (i == 0) first = number;
    mesh.points.push_back(words.point());
    words.skip_line();
  }
  Words tets(ele_file, elements);
  const int count = tets.count();
  tets.skip_line();
  for (int i = 0; i < count; ++i) {
    tets.integer();
    Tet t;
    for (int& v : t) v = tets.integer() - first;
    tets.skip_line();
    mesh.tets.push_back(t);
  }
  return mesh;
}

}  // namespace

Surface read_surface(const std::string& file, double scale) {
  const Polygons mesh = read_polygons(file);
  Surface surface{mesh.points, {}};
  for (const std::vector<int>& face : mesh.faces) add_polygon(surface.points, face, surface.triangles);
  if (surface.triangles.empty()) throw FileError(file + ": has no triangles");
  return welded(surface, scale);
}

TetMesh read_tets(const std::string& file) {
  const std::string ending = ending_of(file);
  TetMesh mesh = ending == ".msh"    ? read_gmsh(file, whole(file))
                 : ending == ".mesh" ? read_medit(file, whole(file))
                 : ending == ".ele"  ? read_tetgen(file)
                                     : throw FileError(file + ": is no .msh, .mesh or .ele");
  check_rows(file, mesh.tets, mesh.points.size());
  if (mesh.tets.empty()) throw FileError(file + ": has no tets");
  return mesh;
}

std::vector<Surface> read_shells(const std::string& file) {
  const Polygons mesh = read_polygons(file);
  std::map<int, Surface> shells;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const int shell = mesh.shell_from_face.empty() ? 0 : mesh.shell_from_face[f];
    add_polygon(mesh.points, mesh.faces[f], shells[shell].triangles);
  }
  std::vector<Surface> out;
  for (auto& [group, shell] : shells) {
    shell.points = mesh.points;
    out.push_back(welded(shell, 1));
  }
  if (out.empty()) throw FileError(file + ": has no shells");
  return out;
}

}  // namespace check
