// What one camera sees of a planned motion: from the number of a frame to a picture, by any worker alike.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "fem/observe.h"
#include "limber/detail/film/film_time.h"
#include "limber/detail/film/pane.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/detail/world/scene_world.h"
#include "limber/film.h"
#include "render/annotate.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/label_places.h"
#include "render/renderer.h"

namespace limber::detail {

// What is written of a frame.
struct Output {
  int bits = 8;                     // a channel, 8 or 16
  std::vector<std::string> passes;  // of pass_names
  bool occlusion = true;            // what cages hide of one another's sky; false where none are made yet
};
// Raised when the same film comes out otherwise, so that it is painted anew (a test holds one by the other).
inline constexpr int picture_generation = 16;

struct Picture {
  std::variant<render::Image8, render::Raster8, render::Raster16> frame;
  std::map<std::string, std::variant<render::Raster8, render::Raster16>> passes;  // docs/files.md
};

std::string length_words(double length_m);  // "20 cm"
// Throws InputError when the film's caption has letters that there is no picture of.
void require_letters(const scenes::FilmSpec&);

class Shot {
 public:
  // The folder's plan and bodies as they are; `scene` with the film and the cameras wanted. Throws InputError
  // naming the cameras there are, when `camera` is none of them; or saying what cannot be drawn together.
  Shot(const scenes::Scene& scene, const std::string& camera, const plan::Plan&, const fem::World&,
       const std::vector<PreparedBody>&, const std::vector<SurfaceMesh>& scenery, std::pair<int, int> size_px,
       const Output& = {});

  int frames() const;
  // Of the motion, when a frame of the film shows it.
  double time_s(int frame) const;
  // Frames before the motion, and those of it; what is left over comes after it.
  int frames_before() const { return before_; }
  int frames_of_motion() const { return of_motion_; }
  FilmTime time_told() const;
  // {"depth_m": [near, far], "objects": ["", NAME…], "scalar": {…}, "contacts": […]}: what the levels of the
  // passes mean, and where in the pictures the robot is touched. docs/files.md.
  Json key_of_passes() const;
  // The names that a frame shows: what is written, where, and where its line ends; `share`, 0 < … ≤ 1, is how
  // much of it is seen while it comes or goes.
  struct Name {
    std::string words;
    int body;  // of bodies and, after those, of scenery
    render::LabelPlace place;
    Eigen::Vector2d end;
    double share;
  };
  std::vector<Name> names_at(int frame) const;
  // Of all that the picture depends on.
  std::string hash_of(int frame) const;

  // A drawing context and the surfaces that it moves. Each worker has its own.
  class Painter {
   public:
    explicit Painter(const Shot&);
    ~Painter();
    Picture paint(int frame);

   private:
    struct View;
    render::Image8 without_words(int frame, render::Passes*);
    render::Image8 annotated(render::Image8, int frame) const;
    render::Image8 with_card(int frame, render::Passes*);
    const Shot& shot_;
    std::vector<std::unique_ptr<View>> views_;  // from left to right
    std::unique_ptr<Painter> inset_;
    // While a card is shown the motion stands still: its picture without and with words, and what the card
    // makes of it.
    const scenes::CardSpec* card_of_ = nullptr;
    render::Image8 bare_, still_, card_;
  };

 private:
  struct Push {
    int first_stored;  // of the frames that it lasts
    Control control;
  };
  // Frames are those of the film but where they are called stored: of the plan.
  int stored() const { return int(plan_.trajectory.frames.size()); }
  State state_at(int frame) const {
    return detail::state_at(plan_.trajectory.frames, world_.dt_s, moment_of(frame));
  }
  double moment_of(int frame) const { return moments_[std::size_t(frame)].at; }
  void lay_out_time();
  int index_in_motion(int frame) const { return std::clamp(frame - before_, 0, of_motion_ - 1); }
  // How much of a card is over a frame, 0 … 1.
  double card_share(int frame) const;
  const scenes::CardSpec* card_of(int frame) const;  // none: nullptr
  void find_controls();
  // At a stored frame.
  Control control_at(int stored) const;
  void find_touches();
  void find_panes();
  double shown(const std::vector<double>& of_stored, int frame) const;
  bool touches_robot(const fem::ContactForce& touch) const {
    return (touch.body == world_.robot) != (touch.other == world_.robot);
  }
  std::vector<double> contact_shares() const;  // a stored frame
  // Of a body and a wall that touch at some time.
  struct PaneOf {
    int body;
    Wall wall;
    std::vector<double> shown;  // 0 … 1 a stored frame
  };
  render::Camera camera_of(int frame) const;
  Box box_of_motion() const;
  // What the camera is to hold: of the subjects, or, if there are none, of all bodies and the bounds where
  // they are drawn.
  Points outline_of_motion(const std::vector<int>& subjects) const;
  void lay_out_camera(double aspect);
  void check() const;
  void place_words();
  void place_names();
  std::vector<Eigen::Vector4d> places_taken() const;  // by other words than names
  void place_inset();
  Eigen::Vector4d place_of_inset(render::Corner) const;
  // How many of some places in each box, one a corner (pixels: left, top, right, bottom), are on bodies, over
  // the film.
  std::array<int, 4> hidden_by(const std::array<Eigen::Vector4d, 4>& boxes) const;
  Json contacts_in_picture(int frame) const;
  std::string clock_at(int frame) const;
  double pixels_a_metre(const render::Camera&) const;  // at the distance of what it looks at
  void measure_depths();
  void measure_colors();
  void measure_forces();
  void find_tree();
  // Arrows of a frame, rows 2i and 2i + 1 their ends; always the same number, those of no force without
  // length: the control's push, what each body does to the robot and last the walls, each force of the world.
  Points arrows_at(int frame) const;
  bool shows_own_colors(std::size_t body) const;
  // The planes that cut a body, or what of the scenery follows the bodies, in the picture.
  std::vector<render::Plane> cuts_of(int body) const;
  Points arrows_at_stored(int stored) const;
  bool acts(const fem::Force&, int stored) const;  // in some step of those from this frame to the next
  std::uint64_t hash_of_look() const;

  const scenes::Scene& scene_;
  const scenes::CameraSpec* camera_ = nullptr;
  const plan::Plan& plan_;
  const fem::World& world_;
  const std::vector<PreparedBody>& bodies_;
  const std::vector<SurfaceMesh>& scenery_;
  Output output_;
  std::vector<std::vector<std::shared_ptr<const render::Image8>>>
      images_;                           // a body, where it shows its own colors
  render::RenderSettings look_;          // of one view
  std::vector<render::CameraKey> path_;  // over the share of the film
  Points followed_m_;                    // (frames × 3) the way of the body that the camera follows, or none
  struct Labeling;
  std::vector<std::vector<Name>> names_;  // a frame; empty: the film has no labels
  double letter_px_ = 0;                  // of names
  render::CaptionLook words_;             // where the words stand, and on what
  double scale_m_ = 0;                    // what the bar of length is long
  double low_ = 0, high_ = 1;             // of the bar of colours
  double near_m_ = 0, far_m_ = 1;         // depths of all that is ever seen
  double strongest_push_n_ = 0, arrow_m_per_n_ = 0, arrow_radius_m_ = 0;
  std::vector<Moment> moments_;  // a frame
  int before_ = 0, of_motion_ = 1;
  std::unique_ptr<scenes::Scene> inset_scene_;
  std::unique_ptr<Shot> inset_;
  render::Corner inset_corner_ = render::Corner::top_right;
  std::vector<Push> pushes_;
  std::vector<PaneOf> panes_;
  std::vector<std::vector<fem::ContactForce>> touches_;  // a stored frame; empty where nothing asks for them
  Points way_m_, tree_m_;                                // ends of lines
  std::uint64_t look_hash_ = 0;
};

}  // namespace limber::detail
