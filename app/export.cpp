#include "app/export.h"

#include "core/error.h"
#include "core/export_files.h"
#include "core/mesh_files.h"
#include "ffd/binding_file.h"
#include "meshing/quality.h"

namespace limber::app {

namespace {

std::vector<VtuData> cage_data(const PreparedBody& body) {
  std::vector<double> smallest, largest, volumes;
  for (Eigen::Index t = 0; t < body.cage.tets.rows(); ++t) {
    const auto p = [&](int k) { return Vec3(body.cage.positions.row(body.cage.tets(t, k))); };
    const meshing::DihedralRange range = meshing::dihedral_range(p(0), p(1), p(2), p(3));
    smallest.push_back(range.min_deg), largest.push_back(range.max_deg);
    volumes.push_back(signed_volume(p(0), p(1), p(2), p(3)));
  }
  return {{"shell", body.shell_from_tet},
          {"min_dihedral_deg", smallest},
          {"max_dihedral_deg", largest},
          {"volume_m3", volumes}};
}

std::vector<VtuData> binding_data(const ffd::Binding& b) {
  return {{"cage_tet",
           std::vector<int>(b.tet_from_vertex.data(), b.tet_from_vertex.data() + b.tet_from_vertex.size())},
          {"cage_weights", std::vector<double>(b.weights.data(), b.weights.data() + b.weights.size()), 4}};
}

}  // namespace

std::vector<std::string> export_body(const PreparedBody& body, const std::vector<std::string>& formats,
                                     const fs::path& folder) {
  std::vector<std::string> written;
  const auto name = [&](const char* file) {
    written.push_back(file);
    return folder / file;
  };
  for (const std::string& format : formats) {
    if (format == "vtu") {
      write_vtu(name("cage.vtu"), body.cage.positions, body.cage.tets, {}, cage_data(body));
      write_vtu(name("surface.vtu"), body.surface.positions, body.surface.triangles,
                binding_data(body.binding), {});
    } else if (format == "node") {
      write_node_ele(name("cage.node"), body.cage, body.shell_from_tet);
      name("cage.ele");
    } else {
      LIMBER_CHECK(format == "interp", format);
      write_veg(name("cage.veg"), body.cage, body.shell_from_tet);
      ffd::write_interp(name("surface.interp"), body.binding, body.cage.tets);
      write_obj(name("surface.obj"), body.surface);
    }
  }
  return written;
}

}  // namespace limber::app
