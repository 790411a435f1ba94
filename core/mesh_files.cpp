#include "core/mesh_files.h"

#include <bit>
#include <charconv>
#include <cstring>
#include <optional>

#include "core/error.h"

namespace limber {

namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

std::string_view shortened(std::string_view word) { return word.substr(0, 40); }

// Walks through a text by white-space-separated words and remembers the line for complaints.
class Words {
 public:
  Words(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  std::string_view line() {  // the next line without its end; throws at the end of the file
    if (at_ >= text_.size()) fail("the file ends too early");
    const auto end = std::min(text_.find('\n', at_), text_.size());
    std::string_view result = text_.substr(at_, end - at_);
    at_ = end + 1, ++line_number_;
    if (!result.empty() && result.back() == '\r') result.remove_suffix(1);
    return result;
  }
  bool done() const { return at_ >= text_.size(); }
  std::size_t offset() const { return std::min(at_, text_.size()); }

  std::string_view word() {
    while (at_ < text_.size() && is_space(text_[at_])) line_number_ += text_[at_++] == '\n';
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    if (begin == at_) fail("the file ends too early");
    return text_.substr(begin, at_ - begin);
  }

  template <class T>
  T number() {
    const std::string_view text = word();
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
      fail(fmt::format("\"{}\" is not a number of the kind wanted here", shortened(text)));
    // A number at the very end of the file may have lost digits: our writers end each file with a line end.
    if (at_ >= text_.size()) fail("the file ends in the middle of a line");
    return value;
  }

  void expect(std::string_view wanted) {
    if (const auto got = word(); got != wanted)
      fail(fmt::format("found \"{}\" where {} belongs", shortened(got), wanted));
  }

  // Of a file that is something else altogether nothing is quoted: whoever named it (a scene may come from
  // afar) is not to learn what it holds.
  void expect_start(std::string_view wanted, const char* kind) const {
    if (!text_.starts_with(wanted))
      throw InputError(
          fmt::format("{}: is not {}, which begins with \"{}\"; name another file", file_, kind, wanted));
  }

  [[noreturn]] void fail(std::string_view why) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line_number_, why));
  }

  // Refuses counts that the rest of the file cannot hold, before memory is asked for.
  Eigen::Index count(std::size_t min_bytes_each) {
    const auto n = number<std::int64_t>();
    if (n < 0 || std::uint64_t(n) > (text_.size() - offset()) / min_bytes_each + 1)
      fail(fmt::format("a count of {} is more than the file can hold; it may be cut short", n));
    return Eigen::Index(n);
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  int line_number_ = 1;
};

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const auto begin = line.find_first_not_of(" \t");
    if (begin == line.npos) return words;
    line.remove_prefix(begin);
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

void append_point(std::string& text, const char* prefix, const auto& row) {
  fmt::format_to(std::back_inserter(text), "{}{:.17g} {:.17g} {:.17g}\n", prefix, row(0), row(1), row(2));
}

}  // namespace

void write_ply(const fs::path& path, const SurfaceMesh& mesh) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double "
      "y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.positions.rows(), mesh.triangles.rows());
  const std::size_t header = text.size(), points = std::size_t(mesh.positions.size()) * sizeof(double);
  const std::size_t face = 1 + 3 * sizeof(int);
  text.resize(header + points + face * std::size_t(mesh.triangles.rows()));
  if (points > 0) std::memcpy(text.data() + header, mesh.positions.data(), points);
  char* out = text.data() + header + points;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f, out += face) {
    *out = 3;
    std::memcpy(out + 1, mesh.triangles.data() + 3 * f, 3 * sizeof(int));
  }
  write_file(path, text);
}

SurfaceMesh read_ply(const fs::path& path) { return ply_from(read_file(path), path); }

SurfaceMesh ply_from(const std::string& text, const fs::path& path) {
  Words words(text, path.string());
  const auto header = [&](std::string_view wanted) {
    if (const auto got = words.line(); got != wanted)
      words.fail(fmt::format("found \"{}\" where \"{}\" belongs; only limber's own PLY files are read here",
                             shortened(got), wanted));
  };
  const auto count = [&](std::string_view prefix, std::size_t bytes_each) {
    const auto line = words.line();
    std::int64_t n = -1;
    if (line.starts_with(prefix)) std::from_chars(line.data() + prefix.size(), line.data() + line.size(), n);
    if (n < 0 || std::uint64_t(n) > text.size() / bytes_each)
      words.fail(
          fmt::format("\"{}\" where \"{}N\" belongs, N being what the file can hold; it may be cut short",
                      shortened(line), prefix));
    return Eigen::Index(n);
  };
  words.expect_start("ply\n", "a PLY file of limber's");
  header("ply"), header("format binary_little_endian 1.0");
  SurfaceMesh mesh;
  mesh.positions.resize(count("element vertex ", 24), 3);
  header("property double x"), header("property double y"), header("property double z");
  mesh.triangles.resize(count("element face ", 13), 3);
  header("property list uchar int vertex_indices"), header("end_header");
  const std::size_t points = std::size_t(mesh.positions.size()) * sizeof(double),
                    faces = 13 * std::size_t(mesh.triangles.rows());
  if (text.size() != words.offset() + points + faces)
    throw InputError(
        fmt::format("{}: holds {} bytes after its header where {} belong; it was cut short or changed",
                    path.string(), text.size() - words.offset(), points + faces));
  const char* in = text.data() + words.offset();
  if (points > 0) std::memcpy(mesh.positions.data(), in, points);
  in += points;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f, in += 13) {
    if (*in != 3)
      throw InputError(fmt::format("{}: face {} has {} vertices; only triangles are read here", path.string(),
                                   f, int(*in)));
    std::memcpy(mesh.triangles.data() + 3 * f, in + 1, 12);
  }
  validate(mesh, path.string());
  return mesh;
}

namespace {

// What a reader can check the rest by.
std::string shells_header(const std::vector<ConvexShell>& shells) {
  Eigen::Index vertices = 0, triangles = 0;
  for (const ConvexShell& shell : shells)
    vertices += shell.vertices.rows(), triangles += shell.triangles.rows();
  return fmt::format("# {} convex shells, {} vertices, {} triangles\n", shells.size(), vertices, triangles);
}

}  // namespace

void write_obj(const fs::path& path, const std::vector<ConvexShell>& shells) {
  std::string text = shells_header(shells);
  Eigen::Index first = 1;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    fmt::format_to(std::back_inserter(text), "g shell_{}\n", s);
    for (const auto row : shells[s].vertices.rowwise()) append_point(text, "v ", row);
    for (const auto row : shells[s].triangles.rowwise())
      fmt::format_to(std::back_inserter(text), "f {} {} {}\n", first + row(0), first + row(1),
                     first + row(2));
    first += shells[s].vertices.rows();
  }
  write_file(path, text + "# end\n");
}

void write_obj(const fs::path& path, const SurfaceMesh& mesh) {
  std::string text;
  for (const auto row : mesh.positions.rowwise()) append_point(text, "v ", row);
  for (const auto row : mesh.triangles.rowwise())
    fmt::format_to(std::back_inserter(text), "f {} {} {}\n", row(0) + 1, row(1) + 1, row(2) + 1);
  write_file(path, text + "# end\n");
}

std::vector<ConvexShell> read_obj_shells(const fs::path& path) {
  const std::string text = read_file(path);
  Words words(text, path.string());
  words.expect_start("# ", "limber's convex shells");
  struct Group {
    std::vector<Vec3> vertices;
    std::vector<std::array<std::int64_t, 3>> triangles;
  };
  std::vector<Group> groups;
  std::int64_t first = 1;
  bool ended = false;
  while (!words.done()) {
    const std::string_view line = words.line();
    ended = line == "# end";
    const auto parts = split(line);
    if (parts.empty() || parts[0].starts_with('#')) continue;
    if (parts[0] == "g" || parts[0] == "o") {
      if (!groups.empty()) first += std::int64_t(groups.back().vertices.size());
      groups.emplace_back();
      continue;
    }
    if (groups.empty() || parts.size() != 4 || (parts[0] != "v" && parts[0] != "f"))
      words.fail(
          fmt::format("\"{}\" is not a group, a vertex or a triangle of limber's shells", shortened(line)));
    const auto number = [&]<class T>(std::string_view part, T value) {
      const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
      if (error != std::errc() || end != part.data() + part.size())
        words.fail(fmt::format("\"{}\" is not a number", shortened(part)));
      return value;
    };
    if (parts[0] == "v")
      groups.back().vertices.emplace_back(number(parts[1], 0.0), number(parts[2], 0.0),
                                          number(parts[3], 0.0));
    else
      groups.back().triangles.push_back({number(parts[1], std::int64_t{}) - first,
                                         number(parts[2], std::int64_t{}) - first,
                                         number(parts[3], std::int64_t{}) - first});
  }
  if (!ended) words.fail("the last line is not \"# end\"; the file was cut short");
  std::vector<ConvexShell> shells(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    shells[g].vertices.resize(Eigen::Index(groups[g].vertices.size()), 3);
    for (std::size_t v = 0; v < groups[g].vertices.size(); ++v)
      shells[g].vertices.row(Eigen::Index(v)) = groups[g].vertices[v];
    shells[g].triangles.resize(Eigen::Index(groups[g].triangles.size()), 3);
    for (std::size_t f = 0; f < groups[g].triangles.size(); ++f)
      for (int i = 0; i < 3; ++i) {
        const std::int64_t index = groups[g].triangles[f][std::size_t(i)];
        if (index < 0 || index >= shells[g].vertices.rows())
          throw InputError(
              fmt::format("{}: triangle {} of shell {} names vertex {}, which is not of that shell",
                          path.string(), f, g, index));
        shells[g].triangles(Eigen::Index(f), i) = int(index);
      }
    validate(shells[g], fmt::format("{}: shell {}", path.string(), g));
  }
  if (const std::string header = shells_header(shells); !text.starts_with(header))
    throw InputError(
        fmt::format("{}: holds \"{}\" by count, but its first line says \"{}\"; it was changed or "
                    "is not limber's, write it again",
                    path.string(), header.substr(0, header.size() - 1),
                    shortened(std::string_view(text).substr(0, text.find('\n')))));
  return shells;
}

void write_msh(const fs::path& path, const TetMesh& mesh, const std::vector<int>& label) {
  LIMBER_CHECK(label.empty() || label.size() == std::size_t(mesh.tets.rows()), label.size(),
               mesh.tets.rows());
  std::string text = fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", mesh.positions.rows());
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    append_point(text, fmt::format("{} ", v + 1).c_str(), mesh.positions.row(v));
  fmt::format_to(std::back_inserter(text), "$EndNodes\n$Elements\n{}\n", mesh.tets.rows());
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
    const int tag = label.empty() ? 1 : label[std::size_t(t)] + 1;
    fmt::format_to(std::back_inserter(text), "{} 4 2 {} {} {} {} {} {}\n", t + 1, tag, tag,
                   mesh.tets(t, 0) + 1, mesh.tets(t, 1) + 1, mesh.tets(t, 2) + 1, mesh.tets(t, 3) + 1);
  }
  write_file(path, text + "$EndElements\n");
}

TetMesh read_msh(const fs::path& path, std::vector<int>* label) {
  return msh_from(read_file(path), path, label);
}

TetMesh msh_from(const std::string& text, const fs::path& path, std::vector<int>* label) {
  Words words(text, path.string());
  words.expect_start("$MeshFormat", "a Gmsh 2.2 mesh");
  words.expect("$MeshFormat"), words.expect("2.2"), words.expect("0"), words.expect("8"),
      words.expect("$EndMeshFormat");
  words.expect("$Nodes");
  TetMesh mesh;
  mesh.positions.resize(words.count(8), 3);
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v) {
    if (words.number<std::int64_t>() != v + 1)
      words.fail(fmt::format("node {} is missing or out of order", v + 1));
    for (int i = 0; i < 3; ++i) mesh.positions(v, i) = words.number<double>();
  }
  words.expect("$EndNodes"), words.expect("$Elements");
  mesh.tets.resize(words.count(18), 4);
  if (label) label->assign(std::size_t(mesh.tets.rows()), 0);
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
    words.number<std::int64_t>();
    if (words.number<int>() != 4) words.fail("only 4-node tets (element type 4) are read here");
    const int tags = words.number<int>();
    for (int i = 0; i < tags; ++i) {
      const int tag = words.number<int>();
      if (tag < 0) words.fail(fmt::format("element {} has the tag {}", t + 1, tag));
      if (label && i == 0) (*label)[std::size_t(t)] = tag - 1;
    }
    for (int i = 0; i < 4; ++i) {
      const int node = words.number<int>();
      if (node < 1) words.fail(fmt::format("element {} names node {}; they are counted from 1", t + 1, node));
      mesh.tets(t, i) = node - 1;
    }
  }
  if (words.word() != "$EndElements" || words.done())
    words.fail("the last line is not $EndElements; the file was cut short");
  validate(mesh, path.string());
  return mesh;
}

}  // namespace limber
