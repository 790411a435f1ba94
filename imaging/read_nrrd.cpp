// NRRD: a head of lines "field: value", an empty line, the voxels (teem.sourceforge.net/nrrd/format.html).
#include <charconv>
#include <map>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "imaging/detail/raw_voxels.h"

namespace limber::imaging::detail {

namespace {

constexpr std::size_t longest_head = std::size_t(1) << 24;

struct Head {
  std::map<std::string, std::string> fields;  // and pairs "key:=value", by the key
  std::map<std::string, int> line;
  std::size_t end = 0;  // where the voxels begin
};

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r"), end = text.find_last_not_of(" \t\r");
  return begin == text.npos ? "" : text.substr(begin, end - begin + 1);
}

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return text;
}

Head head_of(const std::string& bytes, const std::string& file) {
  Head head;
  int number = 0;
  for (std::size_t at = 0;;) {
    ++number;
    const std::size_t end = bytes.find('\n', at);
    if (end == bytes.npos) {  // a header with its data elsewhere may end so
      head.end = bytes.size();
      if (at > longest_head) throw InputError(fmt::format("{}: its head has no end", file));
      return head;
    }
    if (end > longest_head) throw InputError(fmt::format("{}: its head has no end", file));
    const std::string line = trimmed(bytes.substr(at, end - at));
    at = end + 1;
    if (line.empty()) {
      head.end = at;
      return head;
    }
    if (number == 1 || line.front() == '#') continue;
    const std::size_t pair = line.find(":="), colon = line.find(": ");
    std::string key, value;
    if (pair != line.npos && (colon == line.npos || pair < colon))
      key = trimmed(line.substr(0, pair)), value = trimmed(line.substr(pair + 2));
    else if (const std::size_t at_colon = line.find(':'); at_colon != line.npos)
      key = lower(trimmed(line.substr(0, at_colon))), value = trimmed(line.substr(at_colon + 1));
    else
      throw InputError(fmt::format("{}:{}: \"{:.60}\" is no field of a NRRD head", file, number, line));
    head.fields[key] = value, head.line[key] = number;
  }
}

class Fields {
 public:
  Fields(const Head& head, const std::string& file) : head_(head), file_(file) {}
  std::optional<std::string> find(const std::string& key, const std::string& other = "") const {
    for (const std::string& name : {key, other})
      if (const auto found = head_.fields.find(name); found != head_.fields.end()) return found->second;
    return std::nullopt;
  }
  std::string at(const std::string& key) const {
    if (const std::optional<std::string> value = find(key)) return *value;
    throw InputError(fmt::format("{}: its head has no field \"{}\"", file_, key));
  }
  [[noreturn]] void complain(const std::string& key, const std::string& what) const {
    const auto line = head_.line.find(key);
    throw InputError(
        fmt::format("{}:{}: {}: {}", file_, line == head_.line.end() ? 0 : line->second, key, what));
  }
  // Numbers between blanks, brackets and commas; "none" stands for as many as are left.
  std::vector<double> numbers(const std::string& key, const std::string& text) const {
    std::string plain = text;
    for (char& c : plain)
      if (c == '(' || c == ')' || c == ',') c = ' ';
    std::istringstream words(plain);
    std::vector<double> result;
    for (std::string word; words >> word;) {
      double value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error != std::errc() || end != word.data() + word.size())
        complain(key, fmt::format("\"{:.40}\" is no number", word));
      result.push_back(value);
    }
    return result;
  }

 private:
  const Head& head_;
  const std::string& file_;
};

Number number_of(const Fields& fields) {
  static const std::map<std::string, Number> known{{"signed char", Number::i8},
                                                   {"int8", Number::i8},
                                                   {"int8_t", Number::i8},
                                                   {"uchar", Number::u8},
                                                   {"unsigned char", Number::u8},
                                                   {"uint8", Number::u8},
                                                   {"uint8_t", Number::u8},
                                                   {"short", Number::i16},
                                                   {"short int", Number::i16},
                                                   {"signed short", Number::i16},
                                                   {"signed short int", Number::i16},
                                                   {"int16", Number::i16},
                                                   {"int16_t", Number::i16},
                                                   {"ushort", Number::u16},
                                                   {"unsigned short", Number::u16},
                                                   {"unsigned short int", Number::u16},
                                                   {"uint16", Number::u16},
                                                   {"uint16_t", Number::u16},
                                                   {"int", Number::i32},
                                                   {"signed int", Number::i32},
                                                   {"int32", Number::i32},
                                                   {"int32_t", Number::i32},
                                                   {"uint", Number::u32},
                                                   {"unsigned int", Number::u32},
                                                   {"uint32", Number::u32},
                                                   {"uint32_t", Number::u32},
                                                   {"longlong", Number::i64},
                                                   {"long long", Number::i64},
                                                   {"long long int", Number::i64},
                                                   {"signed long long", Number::i64},
                                                   {"signed long long int", Number::i64},
                                                   {"int64", Number::i64},
                                                   {"int64_t", Number::i64},
                                                   {"ulonglong", Number::u64},
                                                   {"unsigned long long", Number::u64},
                                                   {"unsigned long long int", Number::u64},
                                                   {"uint64", Number::u64},
                                                   {"uint64_t", Number::u64},
                                                   {"float", Number::f32},
                                                   {"double", Number::f64}};
  const auto found = known.find(lower(fields.at("type")));
  if (found == known.end())
    fields.complain("type", fmt::format("\"{:.40}\" are no labels; write whole numbers", fields.at("type")));
  return found->second;
}

void take_frame(const Fields& fields, LabelMap& map) {
  double unit = metres_a_millimetre;
  if (const auto units = fields.find("space units")) {
    const std::string word = lower(units->substr(0, units->find(' ')));
    if (word == "\"m\"" || word == "\"meters\"" || word == "\"metres\"")
      unit = 1;
    else if (word == "\"um\"" || word == "\"microns\"" || word == "\"µm\"")
      unit = 1e-6;
    else if (word != "\"mm\"" && word != "\"millimeters\"" && word != "\"\"")
      fields.complain("space units", fmt::format("{:.40} is none that limber knows; write \"mm\"", *units));
  }
  // To the frame of bodies: x to the left, y to the back, z up.
  Vec3 turned(unit, unit, unit);
  if (const auto space = fields.find("space")) {
    const std::string name = lower(*space);
    if (name == "right-anterior-superior" || name == "ras")
      turned = Vec3(-unit, -unit, unit);
    else if (name == "left-anterior-superior" || name == "las")
      turned = Vec3(unit, -unit, unit);
    else if (name != "left-posterior-superior" && name != "lps")
      fields.complain(
          "space",
          fmt::format("\"{:.40}\" is none that limber knows; write left-posterior-superior", *space));
  } else {
    map.notes.push_back("the file names no space: i to the left, j to the back, k up");
  }
  if (const auto directions = fields.find("space directions")) {
    std::string text = *directions;
    if (const std::size_t none = text.find("none"); none != text.npos) text.erase(none, 4);
    const std::vector<double> steps = fields.numbers("space directions", text);
    if (steps.size() != 9) fields.complain("space directions", "need three vectors of three numbers");
    for (int d = 0; d < 3; ++d)
      for (int r = 0; r < 3; ++r) map.axes_m(r, d) = turned[r] * steps[std::size_t(3 * d + r)];
  } else if (const auto spacings = fields.find("spacings")) {
    const std::vector<double> steps = fields.numbers("spacings", *spacings);
    if (steps.size() != 3) fields.complain("spacings", "need three numbers");
    for (int d = 0; d < 3; ++d) map.axes_m.col(d) = turned[d] * steps[std::size_t(d)] * Vec3::Unit(d);
  } else {
    map.notes.push_back("the file names no spacing: a millimetre");
    map.axes_m = turned.asDiagonal();
  }
  if (const auto origin = fields.find("space origin")) {
    const std::vector<double> place = fields.numbers("space origin", *origin);
    if (place.size() != 3) fields.complain("space origin", "needs three numbers");
    map.origin_m = turned.cwiseProduct(Vec3(place[0], place[1], place[2]));
  }
}

// "Segment3_Name:=liver" and "Segment3_LabelValue:=7", as 3D Slicer writes them.
void take_names(const Head& head, LabelMap& map) {
  for (const auto& [key, name] : head.fields) {
    const std::size_t end = key.find("_Name");
    if (!key.starts_with("Segment") || end == key.npos || end + 5 != key.size()) continue;
    const auto value = head.fields.find(key.substr(0, end) + "_LabelValue");
    if (value == head.fields.end()) continue;
    for (std::size_t row = 1; row < map.labels.size(); ++row)
      if (std::to_string(map.labels[row]) == value->second) map.names[row] = name;
  }
}

std::string data_beside(const std::string& name, const fs::path& path) {
  const fs::path data = name;
  if (name.starts_with("LIST") || name.find('%') != name.npos)
    throw InputError(fmt::format("{}: its data are in several files; write them as one", path.string()));
  if (data.is_absolute() || data.lexically_normal().string().starts_with(".."))
    throw InputError(fmt::format("{}: its data file {} is outside its folder; put it beside the head",
                                 path.string(), name));
  return read_file(path.parent_path() / data);
}

}  // namespace

LabelMap read_nrrd(std::string bytes, const fs::path& path) {
  const std::string file = path.string();
  const Head head = head_of(bytes, file);
  const Fields fields(head, file);
  LabelMap map;
  RawVoxels raw;
  const std::vector<double> dimension = fields.numbers("dimension", fields.at("dimension"));
  std::vector<double> sizes = fields.numbers("sizes", fields.at("sizes"));
  if (dimension.size() != 1 || double(sizes.size()) != dimension[0])
    fields.complain("sizes",
                    fmt::format("{} numbers for {} dimensions", sizes.size(), fields.at("dimension")));
  if (sizes.size() == 4 && sizes[0] == 1) sizes.erase(sizes.begin());
  if (sizes.size() == 4 && sizes[3] == 1) sizes.pop_back();
  if (sizes.size() != 3)
    fields.complain("sizes",
                    "a label map has three dimensions and one value a voxel; segments that overlap are "
                    "written in layers, write them as one");
  for (std::size_t d = 0; d < 3; ++d) {
    if (!(sizes[d] >= 1 && sizes[d] <= 65535)) fields.complain("sizes", "each must be from 1 to 65535");
    raw.size[d] = std::int64_t(sizes[d]);
  }
  require_size(raw.size, file);
  raw.number = number_of(fields);
  if (bytes_of(raw.number) > 1) {
    const std::string endian = lower(fields.at("endian"));
    if (endian != "little" && endian != "big") fields.complain("endian", "is little or big");
    raw.big_endian = endian == "big";
  }
  for (const char* key : {"line skip", "byte skip"})
    if (const auto skip = fields.find(key, std::string(key) == "line skip" ? "lineskip" : "byteskip");
        skip && *skip != "0")
      fields.complain(key, "is not read; write the file without");
  take_frame(fields, map);

  const auto data = fields.find("data file", "datafile");
  raw.bytes = data ? data_beside(*data, path) : bytes.substr(head.end);
  bytes.clear();
  const std::string encoding = lower(fields.at("encoding"));
  const std::uint64_t needed = std::uint64_t(raw.size[0]) * std::uint64_t(raw.size[1]) *
                               std::uint64_t(raw.size[2]) * std::uint64_t(bytes_of(raw.number));
  if (encoding == "gzip" || encoding == "gz")
    raw.bytes = inflate(raw.bytes, needed, file);
  else if (encoding != "raw")
    fields.complain("encoding", fmt::format("\"{:.40}\" is not read; write raw or gzip", encoding));
  take_voxels(raw, file, map);
  take_names(head, map);
  return map;
}

}  // namespace limber::imaging::detail
