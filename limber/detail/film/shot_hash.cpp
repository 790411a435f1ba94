// The hash of a frame: it stands in the frame's PNG, and a frame whose hash has stayed the same is not
// painted again.
//
// It is made of what the picture is made from, not of its pixels, so that it is known before anything is
// painted. What is the same for all frames is hashed once (hash_of_look). A key that is added to the film
// must be added here, too; keys that came later add nothing where they are off, so that pictures of older
// films keep their hash. `picture_generation` is raised when the painting itself changes.
#include <fmt/ranges.h>

#include "core/hash.h"
#include "core/version.h"
#include "limber/detail/film/shot.h"

namespace limber::detail {

std::uint64_t Shot::hash_of_look() const {
  const scenes::FilmSpec& film = scene_.film;
  Hasher hasher;
  hasher.text(version).value(picture_generation).value(look_.width).value(look_.height).value(int(film.look));
  if (film.background_srgb) hasher.matrix(*film.background_srgb);
  if (film.ground_m) hasher.text("ground").value(*film.ground_m);
  hasher.matrix(look_.stage.lower).matrix(look_.stage.upper).matrix(scene_.bounds_m.lower);
  hasher.matrix(scene_.bounds_m.upper);
  // These follow from the camera of the first frame, or of all: a frame's own camera does not tell them.
  hasher.matrix(look_.toward_key).value(int(words_.corner)).value(scale_m_);
  if (!output_.passes.empty()) hasher.value(near_m_).value(far_m_);
  for (const bool flag : {film.bounds_lines, film.transparent, film.clock, film.cages, film.forces, film.path,
                          film.tree, film.side_by_side, film.scale_bar})
    hasher.value(int(flag));
  if (film.outlines) hasher.text("outlines");
  for (const scenes::CutSpec& cut : film.cuts) {
    hasher.text("cut").matrix(cut.point_m).matrix(cut.normal);
    for (const int body : cut.bodies) hasher.value(body);
  }
  hasher.text(film.caption).value(int(film.color_by)).value(low_).value(high_).value(film.speed);
  hasher.value(film.frames_per_second).value(frames()).value(output_.bits);
  if (!output_.occlusion) hasher.value(0);
  hasher.value(arrow_m_per_n_).matrix(way_m_).matrix(tree_m_);
  for (const auto& [first_stored, control] : pushes_) {
    if (!film.forces) break;
    hasher.value(first_stored)
        .value(int(control.manipulation))
        .matrix(control.force_n)
        .value(control.node)
        .value(control.radius_m)
        .matrix(control.target_m)
        .value(control.max_force_n);
    if (control.second_node >= 0) hasher.value(control.second_node).matrix(control.second_force_n);
  }
  for (const fem::Force& force : world_.forces) {
    if (!film.forces) break;
    hasher.value(force.body).value(force.first_step).value(force.end_step).matrix(force.force_n);
    for (const int n : force.nodes) hasher.value(n);
  }
  const auto add_look = [&](const scenes::BodySpec& body) {
    hasher.matrix(body.color_srgb)
        .value(int(body.look))
        .value(body.opacity)
        .value(body.roughness)
        .value(body.metallic);
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    hasher.value(limber::hash_of(bodies_[b].surface)).value(limber::hash_of(bodies_[b].cage));
    hasher.value(int(bodies_[b].deformation));
    add_look(scene_.bodies[b]);
    if (!shows_own_colors(b)) continue;
    const Appearance& a = bodies_[b].appearance;
    hasher.matrix(a.uv).matrix(a.colors);
    for (const int m : a.material_from_triangle) hasher.value(m);
    for (const SurfaceMaterial& m : a.materials) hasher.matrix(m.color).value(m.image).value(m.normal_image);
    for (const ImageFile& image : a.images) hasher.text(image.bytes);
  }
  for (std::size_t s = 0; s < scenery_.size(); ++s) {
    hasher.value(limber::hash_of(scenery_[s]));
    add_look(scene_.scenery[s]);
  }
  for (const scenes::LigamentSpec& ligament : scene_.ligaments) {
    hasher.text(ligament.name).value(ligament.from).value(ligament.to).value(ligament.radius_m);
    hasher.matrix(ligament.from_m).matrix(ligament.to_m).matrix(ligament.color_srgb);
    if (ligament.diameter_m) hasher.value(*ligament.diameter_m);
  }
  return hasher.digest();
}

// The state that the frame shows, the camera, and what changes from frame to frame: card, inset, names,
// panes, pace.
std::string Shot::hash_of(int frame) const {
  const render::Camera camera = camera_of(frame);
  Hasher hasher;
  hasher.value(look_hash_)
      .value(frame)
      .value(limber::hash_of(state_at(frame)))
      .matrix(camera.eye)
      .matrix(camera.target)
      .matrix(camera.up);
  if (const scenes::CardSpec* card = card_of(frame))
    hasher.value(card_share(frame))
        .text(fmt::format("{}", fmt::join(card->lines, "\n")))
        .value(int(card->plain));
  if (inset_) hasher.text(inset_->hash_of(frame)).value(int(inset_corner_)).value(scene_.film.inset->size);
  for (const Name& name : names_at(frame))
    hasher.text(name.words)
        .value(name.place.left_px)
        .value(name.place.baseline_px)
        .matrix(name.end)
        .value(name.share);
  for (const PaneOf& pane : panes_)
    if (const double share = shown(pane.shown, frame); share > 0)
      hasher.value(pane.body).value(pane.wall.axis).value(int(pane.wall.upper)).value(share);
  if (scene_.film.pace != scenes::Pace::steady)
    hasher.value(moment_of(frame)).value(moments_[std::size_t(frame)].pace);
  return hex(hasher.value(camera.fov_deg).digest());
}

}  // namespace limber::detail
