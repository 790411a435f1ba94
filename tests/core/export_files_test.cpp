// Each file is read back by a few lines that know the format and nothing of the writer.
#include "core/export_files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>

#include "tests/core/temporary_folder.h"

namespace limber {
namespace {

TetMesh two_tets() {
  TetMesh mesh{Points(5, 3), Tets(2, 4)};
  mesh.positions << 0, 0, 0, 1.0 / 3, 0, 0, 0, M_PI, 0, 0, -1e-7, 0.1, 0.2, 0.2, -1e5;
  mesh.tets << 0, 1, 2, 3, 0, 2, 1, 4;
  return mesh;
}

template <class T>
std::vector<T> numbers(const std::string& text) {
  std::istringstream in(text);
  std::vector<T> values;
  for (std::string word; in >> word;) values.push_back(T(std::stod(word)));
  EXPECT_TRUE(in.eof());
  return values;
}

Points points_of(const std::vector<double>& values) {
  return Eigen::Map<const Points>(values.data(), Eigen::Index(values.size()) / 3, 3);
}

struct Vtu {
  std::string parents;  // of the arrays, as "Piece/Points Piece/Cells …", in order of the file
  std::map<std::string, std::string> text, attributes;  // by Name
};

// Checks on the way that every element is closed, and in its order.
Vtu parse_vtu(const std::string& xml) {
  Vtu vtu;
  std::vector<std::string> open;
  std::string name, attributes;
  std::size_t at = xml.find("?>") + 2, text_begin = 0;
  while ((at = xml.find('<', at)) != xml.npos) {
    const std::size_t end = xml.find('>', at);
    const std::string tag = xml.substr(at + 1, end - at - 1), word = tag.substr(0, tag.find(' '));
    if (tag[0] == '/') {
      EXPECT_FALSE(open.empty());
      if (open.empty()) return vtu;
      EXPECT_EQ(open.back(), tag.substr(1));
      open.pop_back();
      if (tag == "/DataArray") {
        vtu.text[name] = xml.substr(text_begin, at - text_begin);
        vtu.attributes[name] = attributes;
        vtu.parents += open.back() + "/" + name + " ";
      }
    } else {
      open.push_back(word);
      if (const auto n = tag.find("Name=\""); n != tag.npos)
        name = tag.substr(n + 6, tag.find('"', n + 6) - n - 6);
      attributes = tag, text_begin = end + 1;
    }
    at = end;
  }
  EXPECT_TRUE(open.empty());
  return vtu;
}

TEST(ExportFiles, VtuHoldsTetsWithTheirData) {
  const TemporaryFolder folder;
  const TetMesh mesh = two_tets();
  write_vtu(folder / "a.vtu", mesh.positions, mesh.tets,
            {{"w", std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9, 0.1}, 2}},
            {{"shell", std::vector<int>{7, -1}}});
  const std::string xml = read_file(folder / "a.vtu");
  EXPECT_NE(xml.find("NumberOfPoints=\"5\" NumberOfCells=\"2\""), xml.npos);
  Vtu vtu = parse_vtu(xml);
  EXPECT_EQ(vtu.parents,
            "PointData/w CellData/shell Points/Points Cells/connectivity Cells/offsets Cells/types ");
  EXPECT_EQ(points_of(numbers<double>(vtu.text["Points"])), mesh.positions);
  EXPECT_EQ(numbers<int>(vtu.text["connectivity"]), (std::vector{0, 1, 2, 3, 0, 2, 1, 4}));
  EXPECT_EQ(numbers<int>(vtu.text["offsets"]), (std::vector{4, 8}));
  EXPECT_EQ(numbers<int>(vtu.text["types"]), (std::vector{10, 10}));
  EXPECT_EQ(numbers<int>(vtu.text["shell"]), (std::vector{7, -1}));
  EXPECT_EQ(numbers<double>(vtu.text["w"]).back(), 0.1);
  EXPECT_NE(vtu.attributes["w"].find("NumberOfComponents=\"2\""), std::string::npos);
  EXPECT_NE(vtu.attributes["shell"].find("type=\"Int32\""), std::string::npos);
}

TEST(ExportFiles, VtuHoldsTriangles) {
  const TemporaryFolder folder;
  const TetMesh mesh = two_tets();
  const Triangles boundary = boundary_triangles(mesh.tets);
  write_vtu(folder / "a.vtu", mesh.positions, boundary, {}, {});
  Vtu vtu = parse_vtu(read_file(folder / "a.vtu"));
  EXPECT_EQ(numbers<int>(vtu.text["connectivity"]),
            std::vector<int>(boundary.data(), boundary.data() + boundary.size()));
  EXPECT_EQ(numbers<int>(vtu.text["types"]), std::vector<int>(std::size_t(boundary.rows()), 5));
}

// Of an array in the bytes behind the XML: a head of four numbers, then one compressed block.
template <class T>
std::vector<T> appended(const std::string& file, const std::string& name) {
  const std::size_t tag = file.find("Name=\"" + name + "\""), offset = file.find("offset=\"", tag);
  const std::string mark = "<AppendedData encoding=\"raw\">\n_";
  const char* at = file.data() + file.find(mark) + mark.size() + std::stoul(file.substr(offset + 8));
  std::uint64_t head[4];
  std::memcpy(head, at, sizeof head);
  EXPECT_EQ(head[0], 1);
  EXPECT_EQ(head[2], 0);
  std::vector<T> values(head[1] / sizeof(T));
  uLongf size = head[1];
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(values.data()), &size,
                       reinterpret_cast<const Bytef*>(at + sizeof head), head[3]),
            Z_OK);
  EXPECT_EQ(size, head[1]);
  return values;
}

TEST(ExportFiles, BinaryVtuHoldsTheSameAsFloats) {
  const TemporaryFolder folder;
  const TetMesh mesh = two_tets();
  const std::vector<float> speeds{1, 2, 3, 4, 0.1f};
  const std::uintmax_t bytes = write_binary_vtu(folder / "a.vtu", mesh.positions, mesh.tets,
                                                {{"speed", speeds}}, {{"body", std::vector<int>{7, -1}}});
  const std::string file = read_file(folder / "a.vtu");
  EXPECT_EQ(bytes, file.size());
  EXPECT_EQ(appended<float>(file, "Points"),
            std::vector<float>(mesh.positions.data(), mesh.positions.data() + mesh.positions.size()));
  EXPECT_EQ(appended<float>(file, "speed"), speeds);
  EXPECT_EQ(appended<int>(file, "body"), (std::vector{7, -1}));
  EXPECT_EQ(appended<int>(file, "connectivity"), (std::vector{0, 1, 2, 3, 0, 2, 1, 4}));
  EXPECT_EQ(appended<std::uint8_t>(file, "types"), (std::vector<std::uint8_t>{10, 10}));
}

TEST(ExportFiles, NodeAndEleCountFromZero) {
  const TemporaryFolder folder;
  const TetMesh mesh = two_tets();
  write_node_ele(folder / "a.node", mesh, {4, 2});
  std::vector<double> nodes = numbers<double>(read_file(folder / "a.node"));
  ASSERT_EQ(nodes.size(), 4 + 5 * 4);
  EXPECT_EQ(std::vector(nodes.begin(), nodes.begin() + 4), (std::vector<double>{5, 3, 0, 0}));
  for (int v = 0; v < 5; ++v) {
    EXPECT_EQ(nodes[4 + 4 * v], v);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(nodes[5 + 4 * v + k], mesh.positions(v, k));
  }
  EXPECT_EQ(numbers<int>(read_file(folder / "a.ele")),
            (std::vector{2, 4, 1, 0, 0, 1, 2, 3, 4, 1, 0, 2, 1, 4, 2}));
  write_node_ele(folder / "a.node", mesh);
  EXPECT_EQ(numbers<int>(read_file(folder / "a.ele")), (std::vector{2, 4, 0, 0, 0, 1, 2, 3, 1, 0, 2, 1, 4}));
}

TEST(ExportFiles, LegacyVtkHoldsNodesAndTets) {
  const TemporaryFolder folder;
  const TetMesh mesh = two_tets();
  write_legacy_vtk(folder / "a.vtk", mesh);
  const std::string text = read_file(folder / "a.vtk");
  const auto between = [&](const std::string& begin, const std::string& end) {
    const std::size_t from = text.find(begin) + begin.size();
    return text.substr(from, end.empty() ? text.npos : text.find(end) - from);
  };
  EXPECT_EQ(points_of(numbers<double>(between("POINTS 5 double\n", "CELLS"))), mesh.positions);
  EXPECT_EQ(numbers<int>(between("CELLS 2 10\n", "CELL_TYPES")), (std::vector{4, 0, 1, 2, 3, 4, 0, 2, 1, 4}));
  EXPECT_EQ(numbers<int>(between("CELL_TYPES 2\n", "")), (std::vector{10, 10}));
}

TEST(ExportFiles, InpCountsFromOneAndHasASetForEachLabel) {
  const TemporaryFolder folder;
  TetMesh mesh = two_tets();
  mesh.tets = mesh.tets.replicate(6, 1).eval();
  std::vector<int> label(12, 3);
  label[1] = 0;
  // Abaqus' manual: a number has at most 20 characters, sign, point and exponent among them.
  mesh.positions.row(0) << -1.242659894891418e-5, -0.0009066107234928806, -1.2345678901234567e-300;
  write_inp(folder / "a.inp", mesh, label);
  std::map<std::string, std::string> sections;
  std::istringstream in(read_file(folder / "a.inp"));
  std::string section;
  for (std::string line; std::getline(in, line);)
    if (line.starts_with('*'))
      section = line;
    else if (section != "*HEADING")
      sections[section] += line + "\n";
  for (auto& [name, text] : sections) std::replace(text.begin(), text.end(), ',', ' ');
  const std::vector<double> nodes = numbers<double>(sections["*NODE"]);
  ASSERT_EQ(nodes.size(), 5 * 4);
  for (int v = 0; v < 5; ++v) {
    EXPECT_EQ(nodes[std::size_t(4 * v)], v + 1);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(nodes[std::size_t(4 * v + 1 + k)], mesh.positions(v, k),
                  v == 0 ? 1e-12 * std::abs(mesh.positions(v, k)) : 0);
  }
  std::istringstream fields(sections["*NODE"]);
  for (std::string field; fields >> field;) EXPECT_LE(field.size(), 20u) << field;
  const std::vector<int> tets = numbers<int>(sections["*ELEMENT, TYPE=C3D4, ELSET=ALL"]);
  ASSERT_EQ(tets.size(), 12 * 5);
  for (int t = 0; t < 12; ++t) {
    EXPECT_EQ(tets[std::size_t(5 * t)], t + 1);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(tets[std::size_t(5 * t + 1 + k)], mesh.tets(t, k) + 1);
  }
  EXPECT_EQ(numbers<int>(sections["*ELSET, ELSET=LABEL_0"]), (std::vector{2}));
  EXPECT_EQ(numbers<int>(sections["*ELSET, ELSET=LABEL_3"]),
            (std::vector{1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
}

TEST(ExportFiles, VegCountsFromOneAndHasASetForEachLabel) {
  const TemporaryFolder folder;
  TetMesh mesh = two_tets();
  const int many = 25;  // tets, so that a set takes several lines
  mesh.tets = mesh.tets.row(0).replicate(many, 1).eval();
  std::vector<int> label(many, 3);
  label[1] = 0;
  write_veg(folder / "a.veg", mesh, label);
  std::map<std::string, std::string> sections;
  std::istringstream in(read_file(folder / "a.veg"));
  std::string section;
  for (std::string line; std::getline(in, line);) {
    EXPECT_LT(line.size(), 1023);
    if (line.starts_with('*'))
      section = line;
    else
      sections[section] += line + "\n";
  }
  ASSERT_EQ(sections.size(), 4);
  const std::vector<double> nodes = numbers<double>(sections["*VERTICES"]);
  EXPECT_EQ(nodes.size(), 4 + 5 * 4);
  EXPECT_EQ(nodes[0], 5);
  EXPECT_EQ(std::vector(nodes.end() - 4, nodes.end()), (std::vector<double>{5, 0.2, 0.2, -1e5}));
  ASSERT_TRUE(sections["*ELEMENTS"].starts_with("TET\n25 4 0\n1 1 2 3 4\n"));
  EXPECT_EQ(sections["*SET label_0"], "2,\n\n");
  std::string set = sections["*SET label_3"];
  std::replace(set.begin(), set.end(), ',', ' ');
  std::vector<int> all{1};
  for (int t = 3; t <= many; ++t) all.push_back(t);
  EXPECT_EQ(numbers<int>(set), all);
}

}  // namespace
}  // namespace limber
