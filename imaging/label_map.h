// Voxels with labels, as the segmentation of a scan has them. docs/imaging.md
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/types.h"

namespace limber::imaging {

// In the frame of bodies: x to the body's left, y to its back, z up, metres.
struct LabelMap {
  std::array<int, 3> size{};                             // voxels along i, j and k
  std::vector<std::uint16_t> material;                   // of each voxel, i quickest: a row of `labels`
  std::vector<std::int64_t> labels{0};                   // row 0 is label 0, nothing; the others ascend
  std::vector<std::string> names{""};                    // of each label; empty where the file names none
  Eigen::Matrix3d axes_m = Eigen::Matrix3d::Identity();  // columns: a step along i, along j, along k
  Vec3 origin_m = Vec3::Zero();                          // the middle of voxel (0 0 0)
  std::vector<std::string> notes;                        // what the file left open and was taken to be

  std::int64_t voxels() const { return std::int64_t(size[0]) * size[1] * size[2]; }
  int at(int i, int j, int k) const {
    return material[std::size_t(i + std::int64_t(size[0]) * (j + std::int64_t(size[1]) * k))];
  }
  double voxel_volume_m3() const { return std::abs(axes_m.determinant()); }
};

// Whether its first bytes are those of a NIfTI or NRRD file, compressed or not. False where it cannot be
// read.
bool is_label_map(const fs::path&);

// NIfTI-1 and -2 (.nii, .nii.gz) and NRRD (.nrrd, .nhdr with its data beside it; raw or gzip), whole numbers
// in any type and byte order, any spacing and orientation. What a file is, its content says.
// Throws InputError, with what is wrong and where: no such file, cut short, of other sizes than it says, more
// than 2^31 voxels, numbers that are no labels, axes in one plane.
LabelMap read_label_map(const fs::path&);

// The row of `labels` that a word means: a label's number, or its name; throws InputError telling those that
// are there.
int row_of_label(const LabelMap&, const std::string& word, const std::string& file);

// A NIfTI-1 file, gzipped where its name ends in .gz: for tests, and for who has surfaces and wants voxels.
void write_nifti(const fs::path&, const LabelMap&);

}  // namespace limber::imaging
