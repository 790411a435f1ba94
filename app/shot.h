// What one camera sees of a planned motion: from the number of a frame to a picture, by any worker alike.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/plan_folder.h"
#include "app/scene_world.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/renderer.h"

namespace limber::app {

class Shot {
 public:
  // The folder's plan and bodies as they are; `scene` with the film and the cameras wanted. Throws InputError
  // naming the cameras there are, when `camera` is none of them.
  Shot(const scenes::Scene& scene, const std::string& camera, const plan::Plan&, const fem::World&,
       const std::vector<PreparedBody>&, const std::vector<SurfaceMesh>& scenery,
       std::pair<int, int> size_px);

  int frames() const;
  // Of all that the picture depends on.
  std::string hash_of(int frame) const;

  // A drawing context and the surfaces that it moves. Each worker has its own.
  class Painter {
   public:
    explicit Painter(const Shot&);
    ~Painter();
    render::Image8 paint(int frame);

   private:
    struct View;
    const Shot& shot_;
    std::vector<std::unique_ptr<View>> views_;  // from left to right
  };

 private:
  struct Push {
    int first_frame;  // of the frames that it lasts
    Control control;
  };
  render::Camera camera_of(int frame) const;
  Box box_of_motion() const;
  void lay_out_camera(double aspect);
  void measure_colors();
  void measure_forces();
  void find_tree();
  // Arrows of a frame, rows 2i and 2i + 1 their ends; always the same number, those of no force without
  // length.
  Points arrows_at(int frame) const;
  std::uint64_t hash_of_look() const;

  const scenes::Scene& scene_;
  const scenes::CameraSpec* camera_ = nullptr;
  const plan::Plan& plan_;
  const fem::World& world_;
  const std::vector<PreparedBody>& bodies_;
  const std::vector<SurfaceMesh>& scenery_;
  render::Look look_;                    // of one view
  std::vector<render::CameraKey> path_;  // over the share of the film
  Points followed_m_;                    // (frames × 3) the way of the body that the camera follows, or none
  double low_ = 0, high_ = 1;            // of the bar of colours
  double arrow_m_per_n_ = 0, arrow_radius_m_ = 0;
  std::vector<Push> pushes_;
  Points way_m_, tree_m_;  // ends of lines
  std::uint64_t look_hash_ = 0;
};

}  // namespace limber::app
