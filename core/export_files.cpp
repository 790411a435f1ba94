#include "core/export_files.h"

#include <zlib.h>

#include <algorithm>
#include <map>

#include "core/error.h"

namespace limber {

namespace {

// fmt's {} of a double is the shortest text that reads back as the same double.
template <class... Numbers>
void append_line(std::string& text, const Numbers&... numbers) {
  const std::size_t begin = text.size();
  ((fmt::format_to(std::back_inserter(text), "{} ", numbers)), ...);
  if (text.size() > begin) text.back() = '\n';
}

constexpr const char* vtk_type(const std::vector<int>&) { return "Int32"; }
constexpr const char* vtk_type(const std::vector<std::uint8_t>&) { return "UInt8"; }
constexpr const char* vtk_type(const std::vector<float>&) { return "Float32"; }
constexpr const char* vtk_type(const std::vector<double>&) { return "Float64"; }

// A .vtu in the making. Its numbers go into the XML as text, or behind it as bytes.
class VtuFile {
 public:
  explicit VtuFile(bool binary) : binary_(binary) {}

  template <class... Arguments>
  void xml(fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    fmt::format_to(std::back_inserter(xml_), form, std::forward<Arguments>(arguments)...);
  }
  template <class T>
  void array(const std::string& name, const std::vector<T>& values, int components) {
    xml("<DataArray type=\"{}\" Name=\"{}\"{} ", vtk_type(values), name,
        components == 1 ? "" : fmt::format(" NumberOfComponents=\"{}\"", components));
    if (binary_) {
      xml("format=\"appended\" offset=\"{}\"/>\n", bytes_.size());
      append_compressed({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
      return;
    }
    xml("format=\"ascii\">\n");
    for (std::size_t i = 0; i < values.size(); ++i)
      xml("{}{}", values[i], (i + 1) % std::size_t(components) ? ' ' : '\n');
    xml("</DataArray>\n");
  }
  void data(const char* kind, const std::vector<VtuData>& data, Eigen::Index count) {
    xml("<{}>\n", kind);
    for (const VtuData& d : data)
      std::visit(
          [&](const auto& values) {
            LIMBER_CHECK(values.size() == std::size_t(count) * std::size_t(d.components), d.name,
                         values.size(), count);
            array(d.name, values, d.components);
          },
          d.values);
    xml("</{}>\n", kind);
  }
  std::string content() const {
    return xml_ + (binary_ ? "<AppendedData encoding=\"raw\">\n_" + bytes_ + "\n</AppendedData>\n" : "") +
           "</VTKFile>\n";
  }

 private:
  // As one block: how many there are, its size, that of a last incomplete one, its size compressed.
  void append_compressed(std::string_view values) {
    uLongf size = compressBound(values.size());
    std::string compressed(size, '\0');
    const int status = compress2(reinterpret_cast<Bytef*>(compressed.data()), &size,
                                 reinterpret_cast<const Bytef*>(values.data()), values.size(), Z_BEST_SPEED);
    LIMBER_CHECK(status == Z_OK, status);
    const std::uint64_t head[] = {1, values.size(), 0, size};
    bytes_.append(reinterpret_cast<const char*>(head), sizeof head).append(compressed, 0, size);
  }

  bool binary_;
  std::string xml_, bytes_;
};

std::string vtu_content(bool binary, const Points& points, const Eigen::Ref<const Cells>& cells,
                        const std::vector<VtuData>& point_data, const std::vector<VtuData>& cell_data) {
  const Eigen::Index corners = cells.cols(), count = cells.rows();
  LIMBER_CHECK(corners == 3 || corners == 4, corners);
  VtuFile file(binary);
  file.xml(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\"{}>\n"
      "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
      binary ? " header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"" : "", points.rows(), count);
  file.data("PointData", point_data, points.rows());
  file.data("CellData", cell_data, count);
  file.xml("<Points>\n");
  if (binary)
    file.array("Points", std::vector<float>(points.data(), points.data() + points.size()), 3);
  else
    file.array("Points", std::vector<double>(points.data(), points.data() + points.size()), 3);
  file.xml("</Points>\n<Cells>\n");
  std::vector<int> connectivity, offsets;
  for (Eigen::Index c = 0; c < count; ++c) {
    for (Eigen::Index k = 0; k < corners; ++k) connectivity.push_back(cells(c, k));
    offsets.push_back(int(corners * (c + 1)));
  }
  constexpr std::uint8_t vtk_triangle = 5, vtk_tetra = 10;
  file.array("connectivity", connectivity, 1);  // VTK refuses it in rows of `corners`
  file.array("offsets", offsets, 1);
  file.array("types", std::vector(std::size_t(count), corners == 3 ? vtk_triangle : vtk_tetra), 1);
  file.xml("</Cells>\n</Piece>\n</UnstructuredGrid>\n");
  return file.content();
}

void check_label(const TetMesh& mesh, const std::vector<int>& label) {
  LIMBER_CHECK(label.empty() || label.size() == std::size_t(mesh.tets.rows()), label.size(),
               mesh.tets.rows());
}

// Tets of each label, numbered from 1.
std::map<int, std::vector<Eigen::Index>> sets_of(const std::vector<int>& label) {
  std::map<int, std::vector<Eigen::Index>> sets;
  for (std::size_t t = 0; t < label.size(); ++t) sets[label[t]].push_back(Eigen::Index(t) + 1);
  return sets;
}

// Ten a line: Vega reads lines of up to 1023 letters, Abaqus 16 numbers.
void append_set(std::string& text, const std::vector<Eigen::Index>& tets, const char* last_of_a_line) {
  for (std::size_t i = 0; i < tets.size(); ++i)
    if (i + 1 == tets.size() || (i + 1) % 10 == 0)
      fmt::format_to(std::back_inserter(text), "{}{}\n", tets[i], last_of_a_line);
    else
      fmt::format_to(std::back_inserter(text), "{}, ", tets[i]);
}

}  // namespace

void write_vtu(const fs::path& path, const Points& points, const Eigen::Ref<const Cells>& cells,
               const std::vector<VtuData>& point_data, const std::vector<VtuData>& cell_data) {
  write_file(path, vtu_content(false, points, cells, point_data, cell_data));
}

std::uintmax_t write_binary_vtu(const fs::path& path, const Points& points,
                                const Eigen::Ref<const Cells>& cells, const std::vector<VtuData>& point_data,
                                const std::vector<VtuData>& cell_data) {
  const std::string content = vtu_content(true, points, cells, point_data, cell_data);
  write_file(path, content);
  return content.size();
}

void write_pvd(const fs::path& path, const std::vector<PvdEntry>& entries) {
  std::string xml =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (const PvdEntry& entry : entries)
    fmt::format_to(std::back_inserter(xml), "<DataSet timestep=\"{}\" file=\"{}\"/>\n", entry.time_s,
                   entry.file);
  write_file(path, xml + "</Collection>\n</VTKFile>\n");
}

void write_node_ele(const fs::path& node_file, const TetMesh& mesh, const std::vector<int>& label) {
  check_label(mesh, label);
  std::string nodes = fmt::format("{} 3 0 0\n", mesh.positions.rows());
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    append_line(nodes, v, mesh.positions(v, 0), mesh.positions(v, 1), mesh.positions(v, 2));
  std::string elements = fmt::format("{} 4 {}\n", mesh.tets.rows(), label.empty() ? 0 : 1);
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t) {
    append_line(elements, t, mesh.tets(t, 0), mesh.tets(t, 1), mesh.tets(t, 2), mesh.tets(t, 3));
    if (!label.empty()) elements.back() = ' ', append_line(elements, label[std::size_t(t)]);
  }
  write_file(node_file, nodes);
  write_file(fs::path(node_file).replace_extension(".ele"), elements);
}

void write_veg(const fs::path& path, const TetMesh& mesh, const std::vector<int>& label) {
  check_label(mesh, label);
  std::string text = fmt::format("*VERTICES\n{} 3 0 0\n", mesh.positions.rows());
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    append_line(text, v + 1, mesh.positions(v, 0), mesh.positions(v, 1), mesh.positions(v, 2));
  fmt::format_to(std::back_inserter(text), "\n*ELEMENTS\nTET\n{} 4 0\n", mesh.tets.rows());
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t)
    append_line(text, t + 1, mesh.tets(t, 0) + 1, mesh.tets(t, 1) + 1, mesh.tets(t, 2) + 1,
                mesh.tets(t, 3) + 1);
  for (const auto& [name, tets] : sets_of(label)) {
    fmt::format_to(std::back_inserter(text), "\n*SET label_{}\n", name);
    append_set(text, tets, ",");
  }
  write_file(path, text);
}

void write_legacy_vtk(const fs::path& path, const TetMesh& mesh) {
  const Eigen::Index nodes = mesh.positions.rows(), tets = mesh.tets.rows();
  std::string text = fmt::format(
      "# vtk DataFile Version 3.0\nlimber cage\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", nodes);
  for (Eigen::Index v = 0; v < nodes; ++v)
    append_line(text, mesh.positions(v, 0), mesh.positions(v, 1), mesh.positions(v, 2));
  fmt::format_to(std::back_inserter(text), "CELLS {} {}\n", tets, 5 * tets);
  for (Eigen::Index t = 0; t < tets; ++t)
    append_line(text, 4, mesh.tets(t, 0), mesh.tets(t, 1), mesh.tets(t, 2), mesh.tets(t, 3));
  fmt::format_to(std::back_inserter(text), "CELL_TYPES {}\n", tets);
  for (Eigen::Index t = 0; t < tets; ++t) text += "10\n";
  write_file(path, text);
}

namespace {

// A number in a field of 20 characters, of which Abaqus and CalculiX read no more: what is longer loses
// digits.
std::string in_a_field(double value) {
  std::string text = fmt::format("{}", value);
  for (int digits = 17; text.size() > 20; --digits) text = fmt::format("{:.{}g}", value, digits);
  return text;
}

}  // namespace

void write_inp(const fs::path& path, const TetMesh& mesh, const std::vector<int>& label) {
  check_label(mesh, label);
  std::string text = "*HEADING\nlimber cage\n*NODE\n";
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    fmt::format_to(std::back_inserter(text), "{}, {}, {}, {}\n", v + 1, in_a_field(mesh.positions(v, 0)),
                   in_a_field(mesh.positions(v, 1)), in_a_field(mesh.positions(v, 2)));
  text += "*ELEMENT, TYPE=C3D4, ELSET=ALL\n";
  for (Eigen::Index t = 0; t < mesh.tets.rows(); ++t)
    fmt::format_to(std::back_inserter(text), "{}, {}, {}, {}, {}\n", t + 1, mesh.tets(t, 0) + 1,
                   mesh.tets(t, 1) + 1, mesh.tets(t, 2) + 1, mesh.tets(t, 3) + 1);
  for (const auto& [name, tets] : sets_of(label)) {
    fmt::format_to(std::back_inserter(text), "*ELSET, ELSET=LABEL_{}\n", name);
    append_set(text, tets, "");
  }
  write_file(path, text);
}

}  // namespace limber
