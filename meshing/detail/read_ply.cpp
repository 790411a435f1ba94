#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "core/error.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/detail/text_scanner.h"

namespace limber::meshing::detail {

namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Form { ascii, little, big };

struct Property {
  std::string name;
  Type type;                        // of the value, or of the list's members
  std::optional<Type> length_type;  // lists only
};
struct Element {
  std::string name;
  std::int64_t count;
  std::vector<Property> properties;
};
struct Header {
  Form form = Form::ascii;
  std::vector<Element> elements;
  std::size_t bytes = 0;  // of the header itself
};

Type type_named(std::string_view name, const TextScanner& scanner) {
  static constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                         {"uchar", "uint8"},
                                                                         {"short", "int16"},
                                                                         {"ushort", "uint16"},
                                                                         {"int", "int32"},
                                                                         {"uint", "uint32"},
                                                                         {"float", "float32"},
                                                                         {"double", "float64"}}};
  for (std::size_t i = 0; i < names.size(); ++i)
    if (name == names[i][0] || name == names[i][1]) return Type(i);
  scanner.complain(fmt::format("\"{}\" is not a type of PLY", name.substr(0, 40)));
}

Header read_header(std::string_view bytes, const std::string& file) {
  Header header;
  std::size_t end = bytes.find("\nend_header");
  if (end == std::string_view::npos) end = bytes.find("\rend_header");
  if (end == std::string_view::npos)
    throw InputError(file + ": the PLY header has no end_header: the file is cut short or damaged");
  end = bytes.find_first_of("\r\n", end + 1);
  if (end == std::string_view::npos) end = bytes.size();
  header.bytes = std::min(bytes.size(), end + (bytes.substr(end, 2) == "\r\n" ? 2 : 1));

  TextScanner scanner(bytes.substr(0, header.bytes), file, 0);
  bool form_seen = false;
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.next_word();
    if (keyword == "format") {
      const std::string_view form = scanner.next_word();
      form_seen = true;
      if (form == "ascii")
        header.form = Form::ascii;
      else if (form == "binary_little_endian")
        header.form = Form::little;
      else if (form == "binary_big_endian")
        header.form = Form::big;
      else
        scanner.complain(fmt::format("\"{}\" is not a format of PLY", form.substr(0, 40)));
    } else if (keyword == "element") {
      const std::string name(scanner.next_word());
      const std::int64_t count = scanner.next_integer("number of elements");
      if (count < 0) scanner.complain("a negative number of elements");
      header.elements.push_back({name, count, {}});
    } else if (keyword == "property") {
      if (header.elements.empty()) scanner.complain("a property before the first element");
      std::string_view type = scanner.next_word();
      std::optional<Type> length_type;
      if (type == "list") {
        length_type = type_named(scanner.next_word(), scanner);
        type = scanner.next_word();
      }
      const Type value_type = type_named(type, scanner);
      header.elements.back().properties.push_back(
          {std::string(scanner.next_word()), value_type, length_type});
    }
  }
  if (!form_seen) throw InputError(file + ": the PLY header does not say its format");
  return header;
}

// Hands out one value after the other, from text or from bytes.
class Values {
 public:
  Values(std::string_view body, Form form, const std::string& file)
      : body_(body), scanner_(body, file, 0), file_(file), form_(form) {}

  double next(Type type) { return form_ == Form::ascii ? next_word() : next_binary(type); }
  // In text, an element begins a line; what the header does not explain at the end of the line before is left
  // out.
  void begin(const std::string& element, std::int64_t index, std::int64_t count) {
    element_ = &element, index_ = index, count_ = count;
    if (form_ != Form::ascii) return;
    if (!scanner_.next_word().empty()) ++overfull_lines_;
    scanner_.next_line();
  }
  bool binary() const { return form_ != Form::ascii; }
  int overfull_lines() const { return overfull_lines_; }
  bool last_word_may_be_cut() {
    return form_ == Form::ascii && !scanner_.next_line() && scanner_.ends_within_a_word();
  }
  [[noreturn]] void complain(const std::string& what) const {
    throw InputError(fmt::format("{}: {} {} of {}: {}", file_, *element_, index_, count_, what));
  }

 private:
  double next_word() {
    std::string_view word = scanner_.next_word();
    while (word.empty()) {
      if (!scanner_.next_line()) complain("the file ends here, it is cut short");
      word = scanner_.next_word();
    }
    double value = 0;
    if (!parse_number(word, value)) complain(fmt::format("\"{}\" is not a number", word.substr(0, 40)));
    return value;
  }
  double next_binary(Type type) {
    switch (type) {
      case Type::i8:
        return read<std::int8_t>();
      case Type::u8:
        return read<std::uint8_t>();
      case Type::i16:
        return read<std::int16_t>();
      case Type::u16:
        return read<std::uint16_t>();
      case Type::i32:
        return read<std::int32_t>();
      case Type::u32:
        return read<std::uint32_t>();
      case Type::f32:
        return read<float>();
      case Type::f64:
        return read<double>();
    }
    complain("a type that is none");
  }
  template <class T>
  double read() {
    if (body_.size() - at_ < sizeof(T)) complain("the file ends here, it is cut short");
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), body_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    if (form_ == Form::big) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return double(value);
  }

  std::string_view body_;
  TextScanner scanner_;
  const std::string& file_;
  Form form_;
  std::size_t at_ = 0;
  const std::string* element_ = nullptr;
  std::int64_t index_ = 0, count_ = 0;
  int overfull_lines_ = 0;
};

std::int64_t list_length(const Property& property, Values& values) {
  const double length = values.next(*property.length_type);
  if (!(length >= 0 && length < 1e15 && length == std::floor(length)))
    values.complain(fmt::format("a list \"{}\" of {} members", property.name, length));
  return std::int64_t(length);
}

int vertex_number(double value, Values& values) {
  if (!(std::abs(value) < std::numeric_limits<int>::max() && value == std::floor(value)))
    values.complain(fmt::format("{} is not the number of a vertex", value));
  return int(value);
}

// Stanford's tristrips: …, −1 between strips; every second triangle of a strip is turned.
void add_strips(const std::vector<int>& strip_vertices, PolygonSoup& soup) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i < strip_vertices.size(); ++i) {
    if (strip_vertices[i] == -1) {
      begin = i + 1;
    } else if (i >= begin + 2) {
      const bool turned = (i - begin) % 2 == 1;
      soup.add_corner(strip_vertices[i - 2]);
      soup.add_corner(strip_vertices[turned ? i : i - 1]);
      soup.add_corner(strip_vertices[turned ? i - 1 : i]);
      soup.end_polygon();
    }
  }
}

// Which of the three parts of a color a property is, −1: none. Whole numbers count from 0 to their largest.
int color_channel(const Property& property) {
  constexpr std::array<std::array<std::string_view, 2>, 3> names{
      {{"red", "diffuse_red"}, {"green", "diffuse_green"}, {"blue", "diffuse_blue"}}};
  for (int c = 0; c < 3; ++c)
    for (const std::string_view name : names[std::size_t(c)])
      if (property.name == name && !property.length_type) return c;
  return -1;
}
double full_scale(Type type) {
  switch (type) {
    case Type::i8:
      return 127;
    case Type::u8:
      return 255;
    case Type::i16:
      return 32767;
    case Type::u16:
      return 65535;
    case Type::i32:
      return 2147483647;
    case Type::u32:
      return 4294967295;
    case Type::f32:
    case Type::f64:
      return 1;
  }
  return 1;
}

void read_vertices(const Element& element, Values& values, PolygonSoup& soup, const std::string& file) {
  const std::array<std::string_view, 3> axes{"x", "y", "z"};
  for (const std::string_view axis : axes)
    if (std::none_of(element.properties.begin(), element.properties.end(),
                     [&](const Property& p) { return p.name == axis && !p.length_type; }))
      throw InputError(fmt::format("{}: the vertices of this PLY have no property \"{}\"", file, axis));
  std::vector<int> channel_of;  // of each property
  for (const Property& property : element.properties) channel_of.push_back(color_channel(property));
  const auto has = [&](int c) { return std::count(channel_of.begin(), channel_of.end(), c) == 1; };
  const bool colored = has(0) && has(1) && has(2);
  for (std::int64_t v = 0; v < element.count; ++v) {
    values.begin(element.name, v, element.count);
    Vec3 position = Vec3::Zero(), color = Vec3::Ones();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      if (property.length_type) {
        for (std::int64_t n = list_length(property, values); n > 0; --n) values.next(property.type);
        continue;
      }
      const double value = values.next(property.type);
      if (channel_of[i] >= 0) color[channel_of[i]] = linear_from_srgb(value / full_scale(property.type));
      for (int axis = 0; axis < 3; ++axis)
        if (property.name == axes[axis]) position[axis] = value;
    }
    soup.add_position(position);
    if (colored) soup.vertex_colors.push_back(color);
  }
  if (values.binary() &&
      std::all_of(element.properties.begin(), element.properties.end(), [&](const Property& p) {
        return p.type == Type::f32 || std::find(axes.begin(), axes.end(), p.name) == axes.end();
      }))
    soup.note_single_precision();
}

void read_faces(const Element& element, Values& values, PolygonSoup& soup) {
  const bool strips = element.name == "tristrips";
  int too_small = 0;
  for (std::int64_t f = 0; f < element.count; ++f) {
    values.begin(element.name, f, element.count);
    for (const Property& property : element.properties) {
      const bool is_corners =
          property.length_type && (property.name == "vertex_indices" || property.name == "vertex_index");
      std::vector<int> members;
      for (std::int64_t i = property.length_type ? list_length(property, values) : 1; i > 0; --i) {
        const double value = values.next(property.type);
        if (is_corners) members.push_back(vertex_number(value, values));
      }
      if (!is_corners) continue;
      if (strips) {
        add_strips(members, soup);
      } else if (members.size() < 3) {
        ++too_small;
      } else {
        for (const int vertex : members) soup.add_corner(vertex);
        soup.end_polygon();
      }
    }
  }
  if (too_small > 0)
    soup.warnings.push_back(fmt::format("{} face(s) with fewer than 3 corners left out", too_small));
}

void skip(const Element& element, Values& values) {
  for (std::int64_t i = 0; i < element.count; ++i) {
    values.begin(element.name, i, element.count);
    for (const Property& property : element.properties)
      for (std::int64_t n = property.length_type ? list_length(property, values) : 1; n > 0; --n)
        values.next(property.type);
  }
}

}  // namespace

PolygonSoup read_ply(std::string_view bytes, const std::string& file) {
  const Header header = read_header(bytes, file);
  PolygonSoup soup;
  Values values(bytes.substr(header.bytes), header.form, file);
  for (const Element& element : header.elements) {
    if (element.name == "vertex")
      read_vertices(element, values, soup, file);
    else if (element.properties.empty() && element.count > 0)
      throw InputError(
          fmt::format("{}: the element \"{}\" of this PLY has no properties", file, element.name));
    else if (element.name == "face" || element.name == "tristrips")
      read_faces(element, values, soup);
    else
      skip(element, values);
  }
  if (values.overfull_lines() > 0)
    soup.warnings.push_back(
        fmt::format("{} lines hold more numbers than the PLY header explains; the rest of each was left out",
                    values.overfull_lines()));
  if (values.last_word_may_be_cut()) soup.warnings.push_back(last_word_may_be_cut);
  soup.require_indices(file);
  return soup;
}

}  // namespace limber::meshing::detail
