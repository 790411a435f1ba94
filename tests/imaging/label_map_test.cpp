// The same voxels, whatever file they come in; and what is no label map is told of.
#include "imaging/label_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>

#include "core/error.h"
#include "core/random.h"
#include "tests/core/temporary_folder.h"
#include "tests/imaging/made_maps.h"

namespace limber::imaging {
namespace {

LabelMap some_map() {
  LabelMap map;
  map.size = {5, 4, 3};
  map.labels = {0, 3, 7, 900};
  map.names.assign(4, "");
  Rng rng(11, 0);
  for (int v = 0; v < 60; ++v) map.material.push_back(std::uint16_t(rng.below(4)));
  map.axes_m << 0, -0.0005, 0, 0.001, 0, 0.0002, 0, 0, 0.00125;
  map.origin_m = Vec3(0.125, -0.25, 0.0625);
  return map;
}

void expect_same(const LabelMap& a, const LabelMap& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.material, b.material);
  EXPECT_LT((a.axes_m - b.axes_m).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((a.origin_m - b.origin_m).cwiseAbs().maxCoeff(), 1e-8);
}

template <class T>
std::string bytes_of(const LabelMap& map, bool big) {
  std::string bytes;
  for (const std::uint16_t row : map.material) {
    const T value = T(map.labels[row]);
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    if (big != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
    bytes.append(raw.data(), raw.size());
  }
  return bytes;
}

class LabelMaps : public testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& content) const {
    std::ofstream(folder / name, std::ios::binary) << content;
    return (folder / name).string();
  }
  // What the user is told of a file.
  std::string complaint(const std::string& name, const std::string& content) const {
    try {
      read_label_map(file(name, content));
    } catch (const InputError& error) {
      return error.what();
    }
    return "taken";
  }
  std::string nifti() const {
    write_nifti(folder / "some.nii", some_map());
    return read_file(folder / "some.nii");
  }
  template <class T>
  static std::string with(std::string bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
  }
  TemporaryFolder folder;
};

TEST_F(LabelMaps, NiftiIsReadAsItWasWritten) {
  const LabelMap map = some_map();
  for (const char* name : {"a.nii", "a.nii.gz"}) {
    write_nifti(folder / name, map);
    EXPECT_TRUE(is_label_map(folder / name));
    expect_same(read_label_map(folder / name), map);
  }
  EXPECT_FALSE(is_label_map(file("a.obj", "v 0 0 0\n")));
}

// The header of version 2 and of the other byte order, made of that of version 1 field by field.
TEST_F(LabelMaps, NiftiOfEitherVersionAndByteOrder) {
  const LabelMap map = some_map();
  const std::string one = nifti();
  const auto get = [&](auto value, std::size_t at) {
    std::memcpy(&value, one.data() + at, sizeof value);
    return value;
  };
  for (const bool second : {false, true})
    for (const bool big : {false, true}) {
      std::string head(second ? 544 : 352, '\0');
      const auto put = [&](std::size_t at, auto value) {
        std::array<char, sizeof value> raw;
        std::memcpy(raw.data(), &value, sizeof value);
        if (big) std::reverse(raw.begin(), raw.end());
        std::copy(raw.begin(), raw.end(), head.begin() + std::ptrdiff_t(at));
      };
      if (second) {
        put(0, std::int32_t(540)), std::memcpy(head.data() + 4, "n+2", 3);
        put(12, std::int16_t(4)), put(168, std::int64_t(544));
        for (std::size_t d = 0; d < 8; ++d) put(16 + 8 * d, std::int64_t(get(std::int16_t(), 40 + 2 * d)));
        put(348, std::int32_t(1)), put(500, std::int32_t(2));
        for (std::size_t r = 0; r < 3; ++r)
          for (std::size_t c = 0; c < 4; ++c)
            put(400 + 32 * r + 8 * c, double(get(0.f, 280 + 16 * r + 4 * c)));
      } else {
        put(0, std::int32_t(348)), std::memcpy(head.data() + 344, "n+1", 3), head[123] = 2;
        for (std::size_t d = 0; d < 8; ++d) put(40 + 2 * d, get(std::int16_t(), 40 + 2 * d));
        put(70, std::int16_t(4)), put(108, 352.f), put(254, std::int16_t(1));
        for (std::size_t c = 0; c < 12; ++c) put(280 + 4 * c, get(0.f, 280 + 4 * c));
      }
      expect_same(read_label_map(file("b.nii", head + bytes_of<std::int16_t>(map, big))), map);
    }
}

// Of all 48 ways in which i, j and k may run along the three axes: by the quaternion, or by the matrix.
TEST_F(LabelMaps, EveryOrientationPutsVoxelsWhereTheyAre) {
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      LabelMap map = some_map();
      for (int d = 0; d < 3; ++d)
        map.axes_m.col(d) =
            (signs >> d & 1 ? -1 : 1) * (0.001 + 0.0005 * d) * identity.col(order[std::size_t(d)]);
      write_nifti(folder / "c.nii", map);
      const LabelMap by_matrix = read_label_map(folder / "c.nii");
      expect_same(by_matrix, map);
      // The same by the quaternion: axes in NIfTI's frame, x to the right and y to the front.
      Eigen::Matrix3d turn = Eigen::DiagonalMatrix<double, 3>(-1, -1, 1) * map.axes_m;
      for (int d = 0; d < 3; ++d) turn.col(d).normalize();
      const bool mirrored = turn.determinant() < 0;
      if (mirrored) turn.col(2) *= -1;
      Eigen::Quaterniond q(turn);
      if (q.w() < 0) q.coeffs() *= -1;
      std::string bytes = read_file(folder / "c.nii");
      bytes = with(bytes, 254, std::int16_t(0)), bytes = with(bytes, 252, std::int16_t(1));
      bytes = with(bytes, 76, mirrored ? -1.f : 1.f);
      bytes = with(bytes, 256, float(q.x())), bytes = with(bytes, 260, float(q.y()));
      bytes = with(bytes, 264, float(q.z()));
      const Vec3 place = Vec3(-1000 * map.origin_m.x(), -1000 * map.origin_m.y(), 1000 * map.origin_m.z());
      for (std::size_t d = 0; d < 3; ++d) bytes = with(bytes, 268 + 4 * d, float(place[Eigen::Index(d)]));
      const LabelMap by_quaternion = read_label_map(file("d.nii", bytes));
      EXPECT_LT((by_quaternion.axes_m - map.axes_m).cwiseAbs().maxCoeff(), 1e-9) << signs;
      EXPECT_LT((by_quaternion.origin_m - map.origin_m).cwiseAbs().maxCoeff(), 1e-8);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

std::string nrrd_head(const std::string& type, const std::string& more) {
  return "NRRD0004\n# made by a test\ntype: " + type +
         "\ndimension: 3\nsizes: 5 4 3\nspace directions: (0,1,0) (-0.5,0,0) (0,0.2,1.25)\n"
         "space origin: (125,-250,62.5)\n" +
         more + "\n";
}

TEST_F(LabelMaps, NrrdOfAnyTypeIsTheSameMap) {
  const LabelMap map = some_map();
  const std::string lps = "space: left-posterior-superior\nencoding: raw\n";
  expect_same(read_label_map(file(
                  "a.nrrd", nrrd_head("short", lps + "endian: big\n") + bytes_of<std::int16_t>(map, true))),
              map);
  expect_same(read_label_map(file("a.nrrd", nrrd_head("unsigned int", lps + "endian: little\n") +
                                                bytes_of<std::uint32_t>(map, false))),
              map);
  expect_same(read_label_map(file(
                  "a.nrrd", nrrd_head("double", lps + "endian: little\n") + bytes_of<double>(map, false))),
              map);
  // The data beside the head, and names as 3D Slicer writes them.
  file("voxels.raw", bytes_of<std::int64_t>(map, false));
  const LabelMap beside = read_label_map(file(
      "a.nhdr", nrrd_head("int64", lps + "endian: little\ndata file: voxels.raw\nSegment0_Name:=liver: left\n"
                                         "Segment0_LabelValue:=7\n")));
  expect_same(beside, map);
  EXPECT_EQ(beside.names[2], "liver: left");
  EXPECT_EQ(row_of_label(beside, "liver: left", "a"), 2);
  EXPECT_EQ(row_of_label(beside, "900", "a"), 3);
  EXPECT_THROW(row_of_label(beside, "8", "a"), InputError);
  EXPECT_THROW(row_of_label(beside, "", "a"), InputError);
  // From right-anterior-superior.
  LabelMap turned = map;
  turned.axes_m.topRows<2>() *= -1, turned.origin_m.head<2>() *= -1;
  expect_same(
      read_label_map(file("a.nrrd", nrrd_head("short", "space: RAS\nencoding: raw\nendian: little\n") +
                                        bytes_of<std::int16_t>(map, false))),
      turned);
}

TEST_F(LabelMaps, WhatIsNoLabelMapIsToldOf) {
  const std::string good = nifti();
  const auto says = [&](const std::string& name, const std::string& bytes, const char* words) {
    const std::string told = complaint(name, bytes);
    EXPECT_NE(told.find(words), told.npos) << "\"" << words << "\" is not in: " << told;
  };
  EXPECT_EQ(complaint("g.nii", good), "taken");
  for (const std::size_t size : {std::size_t(0), std::size_t(100), std::size_t(346)})
    says("a.nii", good.substr(0, size), "neither a NIfTI nor");
  says("a.nii", good.substr(0, 347), "within its header");
  says("a.nii", good.substr(0, 400), "cut short");
  says("a.nii", with(good, 40, std::int16_t(2)), "2 dimensions");
  says("a.nii", with(with(good, 40, std::int16_t(4)), 48, std::int16_t(2)), "2 volumes");
  says("a.nii", with(good, 42, std::int16_t(-5)), "from 1 to 65535");
  says("a.nii", with(good, 42, std::int16_t(32000)), "cut short");
  says("a.nii",
       with(with(with(good, 42, std::int16_t(32000)), 44, std::int16_t(32000)), 46, std::int16_t(32000)),
       "resample");
  says("a.nii", with(good, 70, std::int16_t(32)), "no labels");
  says("a.nii", with(good, 112, 2.5f), "scaled");
  says("a.nii", with(good, 108, 1e9f), "begin at byte");
  says("a.nii", with(good, 108, NAN), "begin at byte");
  says("a.nii", with(good, 280, NAN), "span no volume");
  says("a.nii", with(with(good, 280, 0.f), 284, 0.f), "span no volume");
  std::string empty = good;
  std::fill(empty.begin() + 352, empty.end(), '\0');
  says("a.nii", empty, "nothing is labelled");
  write_nifti(folder / "p.nii.gz", some_map());
  const std::string packed = read_file(folder / "p.nii.gz");
  says("a.nii.gz", packed.substr(0, packed.size() / 2), "compressed data");

  const std::string lps = "space: LPS\nencoding: raw\nendian: little\n";
  const std::string voxels = bytes_of<std::int16_t>(some_map(), false);
  says("a.nrrd", nrrd_head("short", lps) + voxels.substr(2), "cut short");
  says("a.nrrd", nrrd_head("block", lps) + voxels, "a.nrrd:3: type");
  says("a.nrrd", nrrd_head("short", "space: up\nencoding: raw\nendian: little\n") + voxels,
       "a.nrrd:8: space");
  says("a.nrrd", nrrd_head("short", "encoding: bzip2\nendian: little\n") + voxels, "a.nrrd:8: encoding");
  says("a.nrrd", nrrd_head("short", "encoding: raw\n") + voxels, "no field \"endian\"");
  says("a.nrrd", nrrd_head("short", lps + "byte skip: -1\n") + voxels, "byte skip");
  says("a.nhdr", nrrd_head("short", lps + "data file: ../../etc/passwd\n"), "outside its folder");
  says("a.nhdr", nrrd_head("short", lps + "data file: /etc/passwd\n"), "outside its folder");
  says("a.nhdr", nrrd_head("short", lps + "data file: none.raw\n"), "none.raw");
  says("a.nrrd", "NRRD0004\ntype: short\nnonsense\n\n", "a.nrrd:3");
  std::string halves = bytes_of<double>(some_map(), false);
  const double half = 0.5;
  std::memcpy(halves.data() + 80, &half, 8);
  says("a.nrrd", nrrd_head("double", lps) + halves, "voxel 10 is 0.5");
}

}  // namespace
}  // namespace limber::imaging
