#include "limber/detail/body/write_robot.h"

#include <fmt/format.h>

#include <cctype>

#include "core/mesh_files.h"

namespace limber::detail {

namespace {

std::string hull_file(int hull) { return fmt::format("hulls/hull_{:03}.obj", hull); }

// The model's file without its ending, in letters that every reader of XML names takes.
std::string name_of(const PreparedBody& body) {
  std::string name = fs::path(body.report.model).stem().string();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name.empty() ? "body" : name;
}

std::string words_of(const Vec3& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }

Json json_of(const MassProperties& m, double density) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) {
    const Vec3 row = density * m.inertia_m5.row(i);
    rows.push_back({row.x(), row.y(), row.z()});
  }
  return {{"volume_m3", m.volume_m3},
          {"mass_kg", density * m.volume_m3},
          {"center_m", {m.center_m.x(), m.center_m.y(), m.center_m.z()}},
          {"inertia_kg_m2", rows}};
}

}  // namespace

BodyMass mass_of(const PreparedBody& body) {
  if (is_closed(body.surface.triangles))
    if (const MassProperties m = mass_properties(body.surface.positions, body.surface.triangles);
        m.volume_m3 > 0)
      return {m, true};
  return {mass_properties(body.cage), false};
}

std::vector<MassProperties> mass_of_each(const std::vector<ConvexShell>& shells) {
  std::vector<MassProperties> masses;
  for (const ConvexShell& shell : shells) masses.push_back(mass_properties(shell.vertices, shell.triangles));
  return masses;
}

std::vector<std::string> write_hulls(const PreparedBody& body, const BodyMass& whole,
                                     const std::vector<ConvexShell>& shells, double density,
                                     const fs::path& folder) {
  Json json{{"density_kg_m3", density}, {"of", whole.of_model ? "model" : "cage"}};
  json["whole"] = json_of(whole.of, density);
  json["cage"] = json_of(mass_properties(body.cage), density);
  std::vector<std::string> written{"mass.json"};
  make_folder(folder / "hulls");
  for (const ConvexShell& shell : shells) {
    const std::string file = hull_file(int(written.size()) - 1);
    write_obj(folder / file, SurfaceMesh{shell.vertices, shell.triangles});
    Json hull = json_of(whole.hulls[written.size() - 1], density);
    hull["file"] = file;
    json["hulls"].push_back(hull);
    written.push_back(file);
  }
  write_json(folder / "mass.json", json);
  return written;
}

void write_urdf(const fs::path& path, const PreparedBody& body, const BodyMass& whole, double density) {
  const MassProperties& m = whole.of;
  const Eigen::Matrix3d i = density * m.inertia_m5;
  std::string xml = fmt::format(
      "<?xml version=\"1.0\"?>\n<robot name=\"{0}\">\n<link name=\"{0}\">\n<inertial>\n<origin "
      "xyz=\"{1}\"/>\n"
      "<mass value=\"{2}\"/>\n<inertia ixx=\"{3}\" ixy=\"{4}\" ixz=\"{5}\" iyy=\"{6}\" iyz=\"{7}\" "
      "izz=\"{8}\"/>\n</inertial>\n<visual>\n<geometry><mesh "
      "filename=\"surface.obj\"/></geometry>\n</visual>\n",
      name_of(body), words_of(m.center_m), density * m.volume_m3, i(0, 0), i(0, 1), i(0, 2), i(1, 1), i(1, 2),
      i(2, 2));
  for (int hull = 0; hull < int(whole.hulls.size()); ++hull)
    xml += fmt::format("<collision>\n<geometry><mesh filename=\"{}\"/></geometry>\n</collision>\n",
                       hull_file(hull));
  write_file(path, xml + "</link>\n</robot>\n");
}

void write_sdf(const fs::path& path, const PreparedBody& body, const BodyMass& whole, double density) {
  const MassProperties& m = whole.of;
  const Eigen::Matrix3d i = density * m.inertia_m5;
  std::string xml = fmt::format(
      "<?xml version=\"1.0\"?>\n<sdf version=\"1.7\">\n<model name=\"{0}\">\n<link "
      "name=\"{0}\">\n<inertial>\n"
      "<pose>{1} 0 0 0</pose>\n<mass>{2}</mass>\n<inertia>\n<ixx>{3}</ixx><ixy>{4}</ixy><ixz>{5}</ixz>"
      "<iyy>{6}</iyy><iyz>{7}</iyz><izz>{8}</izz>\n</inertia>\n</inertial>\n<visual name=\"surface\">\n"
      "<geometry><mesh><uri>surface.obj</uri></mesh></geometry>\n</visual>\n",
      name_of(body), words_of(m.center_m), density * m.volume_m3, i(0, 0), i(0, 1), i(0, 2), i(1, 1), i(1, 2),
      i(2, 2));
  for (int hull = 0; hull < int(whole.hulls.size()); ++hull)
    xml += fmt::format(
        "<collision name=\"hull_{:03}\">\n<geometry><mesh><uri>{}</uri></mesh></geometry>\n</collision>\n",
        hull, hull_file(hull));
  write_file(path, xml + "</link>\n</model>\n</sdf>\n");
}

void write_mjcf(const fs::path& path, const PreparedBody& body, const BodyMass& whole, double density) {
  const MassProperties& m = whole.of;
  const Eigen::Matrix3d i = density * m.inertia_m5;
  // What is seen need not be closed, nor weigh anything.
  std::string
      assets = "<mesh name=\"surface\" file=\"surface.obj\" inertia=\"shell\"/>\n",
      geoms =
          "<geom type=\"mesh\" mesh=\"surface\" contype=\"0\" conaffinity=\"0\" group=\"2\" mass=\"0\"/>\n";
  for (int hull = 0; hull < int(whole.hulls.size()); ++hull) {
    assets += fmt::format("<mesh name=\"hull_{:03}\" file=\"{}\"/>\n", hull, hull_file(hull));
    geoms += fmt::format("<geom type=\"mesh\" mesh=\"hull_{:03}\" group=\"3\" mass=\"{}\"/>\n", hull,
                         density * whole.hulls[std::size_t(hull)].volume_m3);
  }
  write_file(
      path, fmt::format("<mujoco model=\"{0}\">\n<!-- What the body weighs stands in inertial. The mass of a "
                        "hull is that of the hull by itself, and hulls overlap. "
                        "-->\n<asset>\n{1}</asset>\n<worldbody>\n<body name=\"{0}\">\n"
                        "<freejoint/>\n<inertial pos=\"{2}\" mass=\"{3}\" fullinertia=\"{4} {5} {6} {7} "
                        "{8} {9}\"/>\n{10}</body>\n</worldbody>\n</mujoco>\n",
                        name_of(body), assets, words_of(m.center_m), density * m.volume_m3, i(0, 0), i(1, 1),
                        i(2, 2), i(0, 1), i(0, 2), i(1, 2), geoms));
}

void write_mjcf_flex(const fs::path& path, const PreparedBody& body, const BodyMass& whole, double density) {
  std::string points, tets;
  for (const auto& p : body.cage.positions.rowwise()) points += words_of(p) + "\n";
  for (const auto& t : body.cage.tets.rowwise()) tets += fmt::format("{} {} {} {}\n", t[0], t[1], t[2], t[3]);
  const double size = bounding_box(body.cage.positions).size().maxCoeff();
  write_file(path,
             fmt::format("<mujoco>\n<!-- No material is known here: set young, poisson and damping. -->\n"
                         "<worldbody>\n<flexcomp name=\"{}\" type=\"direct\" dim=\"3\" mass=\"{}\" "
                         "radius=\"{}\" point=\"{}\" element=\"{}\">\n<contact selfcollide=\"none\" "
                         "internal=\"false\"/>\n<elasticity young=\"5e4\" poisson=\"0.3\" "
                         "damping=\"1e-4\"/>\n</flexcomp>\n</worldbody>\n</mujoco>\n",
                         name_of(body), density * whole.of.volume_m3, 0.005 * size, points, tets));
}

}  // namespace limber::detail
