#include "tests/fuzz/targets.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>

#include "core/contact_shape_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/mesh_files.h"
#include "core/npz.h"
#include "ffd/binding_file.h"
#include "imaging/surface_nets.h"
#include "meshing/detail/polygon_soup.h"
#include "meshing/import.h"
#include "plan/plan_file.h"
#include "scenes/models.h"
#include "scenes/problems.h"
#include "scenes/scene.h"
#include "scenes/shapes.h"
#include "tests/core/deflated_zip.h"
#include "tests/core/temporary_folder.h"
#include "tests/fuzz/edits.h"
#include "tests/fuzz/folder.h"

namespace limber::fuzz {

namespace {

// ── things to write seeds from
// ────────────────────────────────────────────────────────────────────────────────

const TemporaryFolder& folder() {
  static const TemporaryFolder made;
  return made;
}

TetMesh cage() {
  TetMesh mesh{Points(5, 3), Tets(2, 4)};
  mesh.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25, 0.25, -1;
  mesh.tets << 0, 1, 2, 3, 0, 2, 1, 4;
  return mesh;
}

SurfaceMesh surface() {
  const TetMesh mesh = cage();
  return {0.25 * mesh.positions, boundary_triangles(mesh.tets)};
}

ConvexShell shell() {
  const TetMesh mesh = cage();
  return {mesh.positions.topRows(4), boundary_triangles(mesh.tets.topRows(1))};
}

plan::Plan small_plan() {
  const State state{3, {0, 0, 0, 1, 2, 3}, {0, 0, 0, 0, 0, 1}};
  plan::Plan made;
  made.tree.states.push_back(state);
  made.tree.states.push_back(state, 0);
  made.tree.parents = {-1, 0};
  made.tree.controls = {Control{}, Control{}};
  made.tree.centers.push_back({0, 0, 0});
  made.tree.centers.push_back({1, 0, 0});
  made.tree.iterations = {0, 1};
  made.trajectory.controls = {Control{}};
  made.trajectory.frames = {state, state};
  made.trajectory.end = state;
  made.settings.goal.radius_m = 1;
  return made;
}

// By a box on the way to a ball, with a branch that leads nowhere, in steps of 0.1 s.
plan::Plan plan_with_legs() {
  const auto state = [](std::int64_t step) {
    return State{step, {0, 0, 0.1f * float(step), 1, 2, 3}, {0, 0, 1, 0, 0, 1}};
  };
  plan::Plan made;
  made.tree.add(state(0), -1, Control{}, -1, {0, 0, 0});
  const Control push{
      .manipulation = Manipulation::control_point, .force_n = {0, 0, 2}, .node = 1, .steps = 4};
  const Control pull{
      .manipulation = Manipulation::interpolation, .target_m = {0, 0, 1}, .max_force_n = 5, .steps = 6};
  made.tree.add(state(4), 0, push, 0, {0, 0, 0.4f});
  made.tree.add(state(8), 1, push, 2, {0, 0, 0.8f});
  made.tree.add(state(10), 1, pull, 3, {0, 0, 1});
  made.settings.via = {{{{0, 0, 0.4}, 1, Box{{-1, -1, 0}, {1, 1, 0.5}}}, true}};
  made.settings.goal = {{0, 0, 1}, 0.5};
  made.settings.frames_per_second = made.trajectory.frames_per_second = 5;
  made.legs = {{0, 0}, {1, 1}};
  made.goal_node = made.best_node = 3;
  made.ending = plan::Ending::goal;
  made.statistics.iterations = 4;
  made.trajectory.controls = {push, pull};
  made.trajectory.controls.back().steps += 2, made.trajectory.settle_steps = 2;
  for (int step = 0; step <= 12; step += 2) made.trajectory.frames.push_back(state(step));
  made.trajectory.end = state(12);
  return made;
}

template <class Write>
std::string written(const char* name, Write write) {
  write(folder() / name);
  return read_file(folder() / name);
}

// Not by write_file, which waits for the disk.
fs::path file_of(std::string_view bytes, const char* name) {
  std::ofstream(folder() / name, std::ios::binary) << bytes;
  return folder() / name;
}

// ── .npz by its entries: checksums would stop a fuzzer at the door
// ────────────────────────────────────────────────

// One entry after the other: its name, a line end, two bytes of size, its content.
std::string packed(const std::string& npz_bytes) {
  const Npz npz = read_npz(file_of(npz_bytes, "packed.npz"));
  std::string bytes;
  const auto append = [&](const std::string& name, std::string_view content) {
    bytes += name + '\n';
    bytes += char(content.size() & 255);
    bytes += char(content.size() >> 8);
    bytes += content;
  };
  for (const auto& [name, text] : npz.texts) append(name, text);
  for (const auto& [name, array] : npz.arrays) append(name + ".npy", npy_file(array));
  return bytes;
}

fs::path npz_of(std::string_view bytes) {
  Npz npz;
  while (!bytes.empty()) {
    const std::size_t name_end = std::min(bytes.find('\n'), bytes.size());
    const std::string name(bytes.substr(0, name_end));
    bytes.remove_prefix(std::min(name_end + 1, bytes.size()));
    if (bytes.size() < 2) break;
    const std::size_t size =
        std::size_t((unsigned char)bytes[0]) + 256 * std::size_t((unsigned char)bytes[1]);
    bytes.remove_prefix(2);
    const bool plain = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 127; });
    if (plain && !name.empty()) npz.texts[name] = std::string(bytes.substr(0, size));
    bytes.remove_prefix(std::min(size, bytes.size()));
  }
  write_npz(folder() / "entries.npz", npz);
  return folder() / "entries.npz";
}

// ── seeds of the formats that others write
// ────────────────────────────────────────────────────────────────────────

const std::vector<std::string> obj_seeds{
    "# 4 vertices\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0 1\nv 0 1.5e-1 0 0.1 0.2 0.3\nv 0 0 -1\nvt 0 0\nvn "
    "0 "
    "0 1\ng a\nusemtl m\ns 1\nf 1/1/1 2//1 3/1\nf 1 2 4\nf -4 -1 -2\nf 2 3 \\\n 4\nl 1 2\np 1\n",
    "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 1 0\nv 0 2 0\nf 1 2 3 4 5\ncurv 0 1 1 2\n"};
const std::vector<std::string> off_seeds{
    "OFF\n# made\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3 255 0 0\n3 2 0 3\n",
    "STCNOFF 5 1 0\n0 0 0 1\n2 0 0\n2 2 0\n1 1 0\n0 2 0\n5 0 1 2 3 4\n"};
const std::vector<std::string> stl_seeds{
    "solid a\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n "
    "endloop\nendfacet\n"
    "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 0 1 endloop endfacet\nendsolid a\n"};

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string binary_stl() {
  std::string bytes = "solid, or so this says";
  bytes.resize(80, ' ');
  const SurfaceMesh mesh = surface();
  append(bytes, std::uint32_t(mesh.triangles.rows()));
  for (const auto triangle : mesh.triangles.rowwise()) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.f);
    for (const int v : triangle)
      for (const double x : mesh.positions.row(v)) append(bytes, float(x));
    append(bytes, std::uint16_t(0));
  }
  return bytes;
}

constexpr const char* vertex_properties = "property float x\nproperty float y\nproperty float z\n";

std::string ascii_ply() {
  return std::string("ply\nformat ascii 1.0\ncomment made\nelement vertex 4\nproperty uchar red\n") +
         vertex_properties +
         "element face 2\nproperty list uchar int vertex_indices\nproperty float quality\nelement edge 1\n"
         "property int vertex1\nend_header\n"
         "9 0 0 0\n9 1 0 0\n9 0 1 0\n9 0 0 1\n3 0 1 2 0.5\n4 0 1 2 3 1\n7\n";
}

std::string strip_ply() {
  return std::string("ply\nformat ascii 1.0\nelement vertex 4\n") + vertex_properties +
         "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
         "0 0 0\n1 0 0\n0 1 0\n1 1 0\n6 0 1 2 3 -1 2\n";
}

std::string big_endian_ply() {
  std::string bytes = std::string("ply\nformat binary_big_endian 1.0\nelement vertex 3\n") +
                      vertex_properties +
                      "element face 1\nproperty list uchar ushort vertex_index\nend_header\n";
  bytes += std::string("\0\0\0\0\0\0\0\0\0\0\0\0", 12);
  bytes += std::string("\x3f\x80\0\0\0\0\0\0\0\0\0\0", 12);
  bytes += std::string("\0\0\0\0\x3f\x80\0\0\0\0\0\0", 12);
  return bytes + std::string("\3\0\0\0\1\0\2", 7);
}

std::vector<std::string> ply_seeds() {
  return {ascii_ply(), strip_ply(), big_endian_ply(),
          written("surface.ply", [](const fs::path& p) { write_ply(p, surface()); })};
}

// All at once; the importer must tell what they are. The first byte says how the file is named.
constexpr std::array<const char*, 5> model_names{"model.obj", "model.off", "model.ply", "model.stl", "model"};

std::vector<std::string> model_seeds() {
  std::vector<std::string> seeds;
  const std::array<std::vector<std::string>, 4> own{
      obj_seeds, off_seeds, ply_seeds(), {stl_seeds[0], binary_stl()}};
  for (std::size_t i = 0; i < own.size(); ++i)
    for (const std::string& seed : own[i])
      for (const std::size_t name : {i, std::size_t(4)}) seeds.push_back(char('0' + name) + seed);
  return seeds;
}

void read_model(std::string_view bytes) {
  if (bytes.empty()) return;
  const char* name = model_names[std::size_t((unsigned char)bytes[0] - '0') % model_names.size()];
  const meshing::ImportedModel model = meshing::import_model(file_of(bytes.substr(1), name));
  validate(model.surface, "what import_model gives");
  for (const meshing::Defect* none : {&model.left.degenerate_faces, &model.left.duplicate_faces,
                                      &model.left.isolated_vertices, &model.left.non_finite_vertices})
    LIMBER_CHECK(none->count == 0, none->places.front());
  meshing::to_json(model).dump();
}

imaging::LabelMap small_label_map() {
  imaging::LabelMap map;
  map.size = {3, 2, 2}, map.labels = {0, 2, 9}, map.names.assign(3, "");
  map.material = {0, 1, 2, 2, 1, 1, 0, 0, 1, 2, 2, 0};
  map.axes_m *= 0.001;
  return map;
}

std::vector<std::string> label_map_seeds() {
  const auto nifti = [](const char* name) {
    return written(name, [](const fs::path& p) { imaging::write_nifti(p, small_label_map()); });
  };
  const std::string nrrd =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nspace: RAS\nspace directions: (1,0,0) (0,1,0) "
      "(0,0.1,1)\nspace origin: (1,2,3)\nencoding: raw\nSegment0_Name:=liver\nSegment0_LabelValue:=2\n\n";
  return {nifti("a.nii"), nifti("a.nii.gz"), nrrd + std::string("\0\2\2\0\2\3\3\0\0\2\2\2", 12)};
}

void read_label_map(std::string_view bytes) {
  const imaging::LabelMap map = imaging::read_label_map(file_of(bytes, "a.nii"));
  LIMBER_CHECK(std::int64_t(map.material.size()) == map.voxels(), map.material.size());
  if (map.voxels() > 5000) return;
  std::vector<int> rows;
  for (int row = 1; row < int(std::min<std::size_t>(map.labels.size(), 5)); ++row) rows.push_back(row);
  for (const imaging::LabelSurface& one : imaging::surfaces_of(map, rows, {.min_island = 0}))
    validate(one.surface, "what surfaces_of gives");
}

// A head, an empty line, and the file beside it that has the voxels.
std::vector<std::string> label_map_head_seeds() {
  const std::string head =
      "NRRD0004\ntype: ushort\nendian: little\ndimension: 3\nsizes: 3 2 1\nspacings: 1 1 2\nencoding: raw\n"
      "data file: a.raw\n\n";
  const std::string voxels("\0\0\1\0\2\0\2\0\1\0\0\0", 12);
  std::string skipping = head;
  skipping.insert(skipping.find("data file"), "byte skip: 0\nline skip: 0\n");
  return {head + voxels, skipping + voxels};
}

void read_label_map_head(std::string_view bytes) {
  const std::size_t end = std::min(bytes.find("\n\n"), bytes.size());
  file_of(bytes.substr(std::min(end + 2, bytes.size())), "a.raw");
  const imaging::LabelMap map =
      imaging::read_label_map(file_of(std::string(bytes.substr(0, end)) + "\n", "a.nhdr"));
  LIMBER_CHECK(std::int64_t(map.material.size()) == map.voxels(), map.material.size());
}

const char* scene_seed() {
  return R"(name = "a"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
[[bodies]]
name = "ball"
role = "robot"
model = { sphere = { diameter_m = 0.5 } }
cage = { tets = 300 }
material = { youngs_modulus_pa = 6e3, density_kg_m3 = 100 }
pose = { position_m = [0.5, 1, 1] }
color = "#e08e45"
[[bodies]]
name = "plate"
role = "obstacle"
model = { plate = { size_m = [0.2, 2, 2], hole = { shape = "round", size_m = 0.4 } } }
cage = { tets = 400 }
material = { youngs_modulus_pa = 3e3, density_kg_m3 = 100 }
pose = { position_m = [2, 1, 1] }
fixed = "walls"
[goal]
center_of_mass_m = [3, 1, 1]
radius_m = 0.25
[planner]
preset = "paper"
weights = { body = 0.8, control_point = 0.1, interpolation = 0.1 }
max_force_n = 200
[camera]
keyframes = [{ at = 0, eye_m = [0, 0, 9], target_m = [1, 1, 1] }]
)";
}

std::string nested(int depth, std::string_view opening, std::string_view closing) {
  std::string text;
  for (int i = 0; i < depth; ++i) text += opening;
  text += '1';
  for (int i = 0; i < depth; ++i) text += closing;
  return text;
}

std::vector<std::string> hostile_scenes() {
  std::string key = "a";
  for (int i = 1; i < 20000; ++i) key += ".a";
  return {key + " = 1\n", "[" + key + "]\n", "x = " + nested(20000, "[", "]"),
          "x = " + nested(200, "{ a.b.c.d = ", " }")};
}

// Whoever changes a plan can write its hashes, too.
std::vector<std::string> hostile_plans() {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
  const auto fps = [](double value) {
    return [value](plan::Plan& p) { p.settings.frames_per_second = p.trajectory.frames_per_second = value; };
  };
  std::vector<std::string> files;
  for (const std::function<void(plan::Plan&)>& change : std::vector<std::function<void(plan::Plan&)>>{
           fps(0), fps(-1), fps(1e9), fps(1e-300),
           [](plan::Plan& p) { p.trajectory.controls[0].steps = most; },
           [](plan::Plan& p) { p.trajectory.controls[0].node = -7; },
           [](plan::Plan& p) { p.trajectory.controls[0].force_n.x() = nan; },
           [](plan::Plan& p) { p.trajectory.frames[0].positions[0] = nan; },
           [](plan::Plan& p) { p.tree.centers.x[0] = nan; },
           [](plan::Plan& p) { p.trajectory.frames.clear(); },
           [](plan::Plan& p) { p.statistics.iterations = std::int64_t(1) << 62; }}) {
    plan::Plan bad = small_plan();
    change(bad);
    files.push_back(packed(written("bad.npz", [&](const fs::path& p) { plan::write_plan(p, bad, {}); })));
  }
  Npz deep = read_npz(folder() / "plan.npz");
  deep.texts["meta.json"] = nested(10000, "[", "]");
  files.push_back(packed(written("bad.npz", [&](const fs::path& p) { write_npz(p, deep); })));
  return files;
}

std::vector<std::string> hostile_cages() {
  std::vector<std::string> files{"root:x:0:0:root:/root:/bin/sh\n"};
  for (const std::string element : {"4 2 -2147483648 1 1 2 3 4", "4 2 1 1 -2147483648 2 3 4"})
    files.push_back(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
        "$EndNodes\n$Elements\n1\n1 " +
        element + "\n$EndElements\n");
  return files;
}

std::vector<std::string> hostile_archives() {
  const std::vector<float> zeros(20'000'000, 0.f);
  std::string lies = npy_file(NpyArray::of<float>(std::span(zeros).first(4), {4}));
  lies.replace(lies.find("(4,)"), 4, "(9,)");
  return {deflated_zip("a.npy", npy_file(NpyArray::of<float>(zeros, {std::int64_t(zeros.size())}))),
          deflated_zip("a.npy", lies)};
}

// ── good files that a script changes where hashes and seals do not stop it: edits.h
// ──────────────────────────

const std::string no_edit(3, '\0');  // shorter than any

void read_changed(const std::string& npz, std::string_view bytes, bool seal,
                  const std::function<void(const fs::path&)>& read) {
  Npz file = read_npz(file_of(npz, "good.npz"));
  Script script(bytes);
  edit(file, script);
  if (seal) file.texts["hash.txt"] = hex(hash_of(file, "hash.txt")) + "\n";
  write_npz(folder() / "changed.npz", file);
  read(folder() / "changed.npz");
}

// What is read moves the surface, and that is as large as it was.
void use(const ffd::Binding& binding) {
  Points positions;
  ffd::deform(binding, cage().tets, cage().positions, positions);
  LIMBER_CHECK(positions.rows() == surface().positions.rows(), positions.rows());
}

void use(const ContactShape& shape) {
  for (Eigen::Index s = 0; s < shape.samples.positions_m.rows(); ++s)
    shape.field.at(shape.samples.positions_m.row(s));
  shape.field.at({0.3, -1e30, 0.2});
}

void read_changed_plan(std::string_view bytes) {
  Script script(bytes);
  plan::Plan changed = script.below(2) == 0 ? small_plan() : plan_with_legs();
  edit(changed, script);
  plan::write_plan(folder() / "changed.npz", changed, {});
  const plan::Plan read = plan::read_plan(folder() / "changed.npz").plan;
  plan::require_frame_times(read.trajectory, 0.1, "plan.npz");
  plan::explain(read);
}

// Who asks for all complaints gets the one that reading throws first, and none where it throws none.
scenes::Scene read_scene(const std::string& text, const std::vector<std::string>& sets = {}) {
  const std::vector<std::string> problems = scenes::problems_of(text, "scene.toml", sets);
  try {
    scenes::Scene scene = scenes::read_scene(text, "scene.toml", sets);
    LIMBER_CHECK(problems.empty(), problems.front());
    return scene;
  } catch (const InputError& error) {
    LIMBER_CHECK(!problems.empty() && problems.front() == error.what(), error.what());
    throw;
  }
}

// A scene that is taken describes bodies that can be made: those that are made fast, are.
bool is_small(const scenes::BodySpec& body) {
  constexpr double cells = 30;
  const auto few = [](const Vec3& size, double edge) { return size.maxCoeff() < cells * edge; };
  if (const auto* box = std::get_if<scenes::BoxModel>(&body.model)) return few(box->size_m, box->triangle_m);
  if (const auto* plate = std::get_if<scenes::PlateModel>(&body.model))
    return few(plate->box.size_m, plate->box.triangle_m);
  if (const auto* sphere = std::get_if<scenes::SphereModel>(&body.model))
    return few(Vec3::Constant(sphere->diameter_m), sphere->triangle_m);
  if (const auto* tube = std::get_if<scenes::TubeModel>(&body.model))
    return few(Vec3(scenes::length_m(*tube), tube->diameter_m, tube->diameter_m), tube->triangle_m);
  return false;
}

void read_changed_scene(std::string_view bytes) {
  Script script(bytes);
  const scenes::Scene scene = read_scene(scene_seed(), scene_edits({"ball", "plate"}, script));
  for (const scenes::BodySpec& body : scene.bodies) {
    if (!is_small(body)) continue;
    const SurfaceMesh made = scenes::made_surface(body).value();
    try {
      validate(made, "made model");
    } catch (const InputError& error) {
      LIMBER_CHECK(false, error.what());
    }
  }
}

std::vector<Target> changed_targets(const std::string& binding_npz, const std::string& contact_npz,
                                    const std::string& plan_npz, const std::string& legs_npz) {
  return {{"binding_changed",
           [binding_npz](auto bytes) {
             read_changed(binding_npz, bytes, false,
                          [](const fs::path& p) { use(ffd::read_binding(p, surface(), cage())); });
           },
           {no_edit}},
          {"contact_changed",
           [contact_npz](auto bytes) {
             read_changed(contact_npz, bytes, false,
                          [](const fs::path& p) { use(read_contact_shape(p, surface(), cage())); });
           },
           {no_edit}},
          {"plan_arrays_changed",
           [plan_npz, legs_npz](auto bytes) {
             Script first(bytes.substr(0, 1));
             read_changed(first.below(2) == 0 ? plan_npz : legs_npz,
                          bytes.substr(std::min<std::size_t>(1, bytes.size())), true,
                          [](const fs::path& p) { plan::explain(plan::read_plan(p).plan); });
           },
           {no_edit}},
          {"plan_changed", read_changed_plan, {no_edit}},
          {"shells_changed",
           [text = read_file(folder() / "shells.obj")](auto bytes) {
             Script script(bytes);
             read_obj_shells(file_of(edited(text, script), "changed.obj"));
           },
           {no_edit}},
          {"cage_changed",
           [text = read_file(folder() / "cage.msh")](auto bytes) {
             Script script(bytes);
             std::vector<int> label;
             validate(read_msh(file_of(edited(text, script), "changed.msh"), &label), "changed.msh");
           },
           {no_edit}},
          {"scene_changed", read_changed_scene, {no_edit}},
          {"folder_changed", meet_changed_folder, {no_edit}}};
}

std::vector<Target> made_targets() {
  const std::string npz = written("binding.npz", [](const fs::path& p) {
    ffd::Binding binding{Eigen::VectorXi::Zero(5), Weights::Zero(5, 4)};
    binding.weights.col(0).setOnes();
    ffd::write_binding(p, binding, surface(), cage());
  });
  const std::string contact_npz = written("contact.npz", [](const fs::path& p) {
    ContactShape shape;
    shape.field = {Vec3::Zero(), 0.5, {2, 2, 2}, 1e-4, std::vector<std::int16_t>(8, -3)};
    shape.samples = {Points::Zero(1, 3), Eigen::VectorXi::Zero(1), Weights::Constant(1, 4, 0.25),
                     Eigen::VectorXd::Ones(1)};
    shape.min_weight = Weights::Zero(2, 4);
    write_contact_shape(p, shape, surface(), cage());
  });
  const std::string plan_npz = written("plan.npz", [](const fs::path& p) {
    plan::write_plan(p, small_plan(), {{"a", 1}});
  });
  const std::string legs_npz =
      written("legs.npz", [](const fs::path& p) { plan::write_plan(p, plan_with_legs(), {}); });
  const std::string report = written("report.json", [](const fs::path& p) {
    write_json(p, to_json(meshing::clean(surface(), {.count_self_intersections = false})));
  });
  std::vector<Target> all{
      {"obj", [](auto bytes) { meshing::detail::read_obj(bytes, "a.obj"); }, obj_seeds},
      {"off", [](auto bytes) { meshing::detail::read_off(bytes, "a.off"); }, off_seeds},
      {"ply", [](auto bytes) { meshing::detail::read_ply(bytes, "a.ply"); }, ply_seeds()},
      {"stl_text", [](auto bytes) { meshing::detail::read_stl_text(bytes, "a.stl"); }, stl_seeds},
      {"stl_binary", [](auto bytes) { meshing::detail::read_stl_binary(bytes, "a.stl"); }, {binary_stl()}},
      {"model", read_model, model_seeds()},
      {"label_map", read_label_map, label_map_seeds()},
      {"label_map_head", read_label_map_head, label_map_head_seeds()},
      {"surface",
       [](auto bytes) { limber::read_ply(file_of(bytes, "surface.ply")); },
       {written("surface.ply", [](const fs::path& p) { write_ply(p, surface()); })}},
      {"shells",
       [](auto bytes) { read_obj_shells(file_of(bytes, "shells.obj")); },
       {written("shells.obj",
                [](const fs::path& p) {
                  write_obj(p, std::vector<ConvexShell>{shell(), shell()});
                })}},
      {"cage",
       [](auto bytes) {
         std::vector<int> label;
         read_msh(file_of(bytes, "cage.msh"), &label);
       },
       {written("cage.msh",
                [](const fs::path& p) {
                  write_msh(p, cage(), {0, 7});
                })},
       hostile_cages()},
      {"npz", [](auto bytes) { read_npz(file_of(bytes, "a.npz")); }, {npz, plan_npz}, hostile_archives()},
      {"binding", [](auto bytes) { ffd::read_binding(npz_of(bytes), surface(), cage()); }, {packed(npz)}},
      {"contact",
       [](auto bytes) { read_contact_shape(npz_of(bytes), surface(), cage()); },
       {packed(contact_npz)}},
      {"plan",
       [](auto bytes) { plan::read_plan(npz_of(bytes)); },
       {packed(plan_npz), packed(legs_npz)},
       hostile_plans()},
      {"json",
       [](auto bytes) { read_json(file_of(bytes, "a.json")).dump(); },
       {report},
       {nested(200000, "[", "]"), nested(200000, "{\"a\":", "}")}},
      {"scene", [](auto bytes) { read_scene(std::string(bytes)); }, {scene_seed()}, hostile_scenes()}};
  for (Target& target : changed_targets(npz, contact_npz, plan_npz, legs_npz))
    all.push_back(std::move(target));
  return all;
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> made = made_targets();
  return made;
}

}  // namespace limber::fuzz
