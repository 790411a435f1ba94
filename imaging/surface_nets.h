// Surfaces of the labels of a scan: closed, smooth, and apart where they share a boundary. docs/imaging.md
#pragma once

#include "core/mesh.h"
#include "imaging/label_map.h"

namespace limber::imaging {

struct SurfaceNetOptions {
  double gap = 0.2;  // between surfaces of labels that share a boundary; of the shortest voxel edge, 0 … 0.6
  int rounds = 10;   // of smoothing, 0 … 1000; 0: the voxels' own faces
  double min_island = 8;  // voxels; smaller pieces of a label are left out
};

struct LabelSurface {
  SurfaceMesh surface;  // closed, each edge of two triangles, each vertex one fan; metres; empty: no piece is
                        // left
  std::int64_t voxels = 0;          // of the label, without what was left out
  int islands_dropped = 0;          // pieces smaller than min_island
  std::int64_t voxels_dropped = 0;  // in those
};

// One surface for each row of map.labels that is asked for, in that order. All are made of the same smoothed
// boundaries, whichever are asked for, so those of neighbours do not overlap.
// Gibson, Constrained elastic surface nets, 1998; Frisken, SurfaceNets for multi-label segmentations, 2022.
// Throws InputError for options out of range, a row that is not there, and a label with more than 2^30
// vertices.
std::vector<LabelSurface> surfaces_of(const LabelMap&, const std::vector<int>& rows,
                                      const SurfaceNetOptions& = {});

}  // namespace limber::imaging
