// Mesh files for other programs. limber writes them and never reads them; in those of text each number
// has the digits that bring back the same double (but in .inp, where it has 20 characters). Which program
// reads what: docs/files.md. Each throws DiskError (core/file.h).
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/file.h"
#include "core/mesh.h"

namespace limber {

// An array of ParaView's: `components` numbers for each point or cell, one after the other.
struct VtuData {
  std::string name;  // letters, digits and _
  std::variant<std::vector<int>, std::vector<float>, std::vector<double>> values;
  int components = 1;
};

using Cells = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// VTK's XML of an unstructured grid, ASCII. cells: (n × 3) triangles or (n × 4) tets.
void write_vtu(const fs::path&, const Points&, const Eigen::Ref<const Cells>& cells,
               const std::vector<VtuData>& point_data, const std::vector<VtuData>& cell_data);

// The same with its arrays compressed behind the XML, and points as float32: a fifth of the size, for series.
// Returns the bytes written.
std::uintmax_t write_binary_vtu(const fs::path&, const Points&, const Eigen::Ref<const Cells>& cells,
                                const std::vector<VtuData>& point_data,
                                const std::vector<VtuData>& cell_data);

// ParaView's list of a series: each file as it is named from the list's own folder, with its time.
struct PvdEntry {
  double time_s;
  std::string file;
};
void write_pvd(const fs::path&, const std::vector<PvdEntry>&);

// TetGen's pair, numbered from 0: `node_file` and, beside it, the same name with .ele. `label` (per tet, may
// be empty) is the attribute of each tet.
void write_node_ele(const fs::path& node_file, const TetMesh&, const std::vector<int>& label = {});

// Vega FEM's .veg, numbered from 1: *VERTICES, *ELEMENTS TET, and a *SET label_i for each label. No *MATERIAL
// and no *REGION: Vega then takes its own defaults, and says so.
void write_veg(const fs::path&, const TetMesh&, const std::vector<int>& label = {});

// VTK's legacy format, version 3.0, ASCII: the cage as an unstructured grid.
void write_legacy_vtk(const fs::path&, const TetMesh&);

// Abaqus' .inp, numbered from 1: nodes, elements C3D4, a set ALL and one set LABEL_i for each label. No
// material, section or step.
void write_inp(const fs::path&, const TetMesh&, const std::vector<int>& label = {});

}  // namespace limber
