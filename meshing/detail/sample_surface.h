// Points of a surface, denser where it bends outwards, corners and creases first, then the tips that stand
// out between these.
#pragma once

#include <vector>

#include "meshing/detail/seen_surface.h"

namespace limber::meshing::detail {

struct SampleSpacing {
  double missed_m;    // depth that may be missed between two samples of a face that bends
  double min_m;       // spacing nowhere below
  double max_m;       // nor above where the surface bends
  double max_flat_m;  // nor in flat faces
  double offset_m;    // as in seen_surface
};

struct SurfaceSample {
  Vec3 position, normal;
  double area_m2;  // of the surface that is nearer to it than to the others
};

// `seen` is of `surface`. At most `most` samples: for fewer, all spacings grow. At most `most_tips` more.
// Same input, same bytes on any number of threads. Method: docs/contact.md.
std::vector<SurfaceSample> sample_surface(const SurfaceMesh& surface, const SeenSurface& seen,
                                          const WindingNumber&, const SampleSpacing&, int most,
                                          int most_tips);

}  // namespace limber::meshing::detail
