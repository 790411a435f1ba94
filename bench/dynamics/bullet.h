// The same block in Bullet's deformables (Debian's libbullet-dev), where it was found at configuration.
#pragma once

#include <memory>

#include "core/mesh.h"
#include "fem/world.h"

namespace limber::bench {

bool has_bullet();

// A soft body of Bullet: Neo-Hookean with Lamé's numbers of the material, in free space.
class BulletBody {
 public:
  BulletBody(const TetMesh&, const fem::Material&, double stretch, bool implicit);
  ~BulletBody();
  void step(double dt_s, int steps);
  double height_m() const;  // along z: to see that it moves, and is still there

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::bench
