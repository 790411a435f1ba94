#include "core/contact_shape_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/json.h"
#include "core/npz.h"
#include "tests/core/temporary_folder.h"

namespace limber {
namespace {

TetMesh cage() {
  TetMesh mesh{Points(5, 3), Tets(2, 4)};
  mesh.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25, 0.25, -1;
  mesh.tets << 0, 1, 2, 3, 0, 2, 1, 4;
  return mesh;
}

SurfaceMesh shrunk_surface() { return {0.25 * cage().positions, boundary_triangles(cage().tets)}; }

ContactShape shape() {
  ContactShape s;
  s.field.lower_m = {-0.1, 1.0 / 3, 1e-7};
  s.field.cell_m = 0.1;
  s.field.nodes = {2, 3, 4};
  s.field.unit_m = 1e-5 / 3;
  for (int i = 0; i < 24; ++i) s.field.values.push_back(std::int16_t(-32'000 + 2'500 * i));
  s.samples = {Points(3, 3), Eigen::VectorXi(3), Weights(3, 4), Eigen::VectorXd(3)};
  s.samples.positions_m << 0.1, 0.2, 0.3, 0, 0, 0, 0.1, 0.1, -0.2;
  s.samples.tet_from_sample << 0, 1, 1;
  s.samples.weights << 0.4, 0.1, 0.2, 0.3, 1, 0, 0, 0, 1.5, 0.5, -0.75, -0.25;
  s.samples.area_m2 << 0.1, 0.2, 1e-12;
  s.min_weight = Weights::Constant(2, 4, 2);
  s.min_weight.row(0) << 0.1, 0, 0.2, 0;
  return s;
}

TEST(ContactShapeFile, ReadsBackWhatItWrote) {
  const TemporaryFolder folder;
  for (const bool usable : {true, false}) {
    ContactShape written = shape();
    written.usable = usable;
    if (!usable) written.samples = {Points(0, 3), Eigen::VectorXi(0), Weights(0, 4), Eigen::VectorXd(0)};
    write_contact_shape(folder / "contact.npz", written, shrunk_surface(), cage());
    const ContactShape read = read_contact_shape(folder / "contact.npz", shrunk_surface(), cage());
    EXPECT_EQ(read.usable, usable);
    EXPECT_EQ(read.field.lower_m, written.field.lower_m);
    EXPECT_EQ(read.field.cell_m, written.field.cell_m);
    EXPECT_EQ(read.field.nodes, written.field.nodes);
    EXPECT_EQ(read.field.unit_m, written.field.unit_m);
    EXPECT_EQ(read.field.values, written.field.values);
    EXPECT_EQ(read.samples.positions_m, written.samples.positions_m);
    EXPECT_EQ(read.samples.tet_from_sample, written.samples.tet_from_sample);
    EXPECT_EQ(read.samples.weights, written.samples.weights);
    EXPECT_EQ(read.samples.area_m2, written.samples.area_m2);
    EXPECT_EQ(read.min_weight, written.min_weight);
  }
}

// At a node the field is what is stored there, between them linear along each axis.
TEST(ContactShapeFile, AFieldIsTrilinear) {
  const DistanceField field = shape().field;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 2; ++i)
        EXPECT_NEAR(field.at(field.lower_m + 0.1 * Vec3(i, j, k)),
                    field.unit_m * field.values[std::size_t((k * 3 + j) * 2 + i)], 1e-12);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 from = field.lower_m + 0.1 * Vec3(0.3, 0.6, 0.2), to = from;
    to[axis] = field.lower_m[axis] + 0.1 * 0.9;
    EXPECT_NEAR(field.at(0.5 * (from + to)), 0.5 * (field.at(from) + field.at(to)), 1e-12);
  }
}

TEST(ContactShapeFile, EveryTruncatedPrefixIsAnInputError) {
  const TemporaryFolder folder;
  write_contact_shape(folder / "contact.npz", shape(), shrunk_surface(), cage());
  const std::string whole = read_file(folder / "contact.npz");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::ofstream(folder / "cut", std::ios::binary) << whole.substr(0, size);
    EXPECT_THROW(read_contact_shape(folder / "cut", shrunk_surface(), cage()), InputError)
        << size << " bytes";
  }
}

TEST(ContactShapeFile, WhatContradictsItselfIsAnInputErrorThatSaysWhatToDo) {
  const TemporaryFolder folder;
  const fs::path path = folder / "contact.npz";
  const auto refused = [&](const std::string& because) {
    try {
      read_contact_shape(path, shrunk_surface(), cage());
      ADD_FAILURE() << "read in spite of: " << because;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(because), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("limber prepare"), std::string::npos) << error.what();
    }
  };
  const auto with = [&](const std::string& because, const std::function<void(ContactShape&)>& change) {
    ContactShape changed = shape();
    change(changed);
    write_contact_shape(path, changed, shrunk_surface(), cage());
    refused(because);
  };
  with("names tet 2", [](auto& s) { s.samples.tet_from_sample[2] = 2; });
  with("names tet -1", [](auto& s) { s.samples.tet_from_sample[0] = -1; });
  with("order of tets", [](auto& s) { s.samples.tet_from_sample[0] = 1, s.samples.tet_from_sample[1] = 0; });
  with("sum to", [](auto& s) { s.samples.weights(1, 2) += 1e-3; });
  with("sample_weights holds", [](auto& s) { s.samples.weights(1, 2) = std::nan(""); });
  with("sample_positions_m holds", [](auto& s) { s.samples.positions_m(1, 2) = INFINITY; });
  with("stands for", [](auto& s) { s.samples.area_m2[1] = 0; });
  with("least_weight of tet 1", [](auto& s) { s.min_weight(1, 1) = -0.5; });
  with("least_weight of tet 0", [](auto& s) { s.min_weight(0, 1) = 3; });
  with("least_weight has", [](auto& s) { s.min_weight = Weights::Zero(3, 4); });
  with("cell_m", [](auto& s) { s.field.cell_m = 0; });
  with("unit_m", [](auto& s) { s.field.unit_m = -1; });
  with("lower_m", [](auto& s) { s.field.lower_m[1] = 1e300; });
  with("has no samples", [](auto& s) {
    s.samples = {Points(0, 3), Eigen::VectorXi(0), Weights(0, 4), Eigen::VectorXd(0)};
  });
  with("nodes along an axis", [](auto& s) { s.field.nodes = {1, 1, 24}; });

  write_contact_shape(path, shape(), shrunk_surface(), cage());
  Npz file = read_npz(path);
  file.arrays["sample_areas_m2"] = NpyArray::of_matrix(Eigen::VectorXd(Eigen::VectorXd::Ones(2)));
  write_npz(path, file);
  refused("sample_areas_m2 has another shape");
  file = read_npz(path);
  file.texts["meta.json"] = "{\"format\": \"limber contact 0\"}";
  write_npz(path, file);
  refused("format");
  file.texts["meta.json"] = "{}";
  write_npz(path, file);
  refused("meta.json");

  SurfaceMesh other = shrunk_surface();
  other.positions(0, 0) += 1e-3;
  write_contact_shape(path, shape(), other, cage());
  refused("another surface");
  TetMesh other_cage = cage();
  other_cage.positions(0, 0) -= 1e-3;
  write_contact_shape(path, shape(), shrunk_surface(), other_cage);
  refused("another cage");
}

}  // namespace
}  // namespace limber
