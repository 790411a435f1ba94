// The ranges of depths and colours, which hold for the whole film so that one level means one thing in all
// frames, and what is told of the passes beside them (passes.json; docs/files.md). Others that draw the same
// moment (tools/compare_films) find cameras and light there, too.
#include <algorithm>
#include <limits>

#include "fem/observe.h"
#include "limber/detail/film/node_values.h"
#include "limber/detail/film/shot.h"

namespace limber::detail {

// Nearest and farthest corner of the stage along the view, over all frames: in there all that is seen has its
// depth.
void Shot::measure_depths() {
  near_m_ = std::numeric_limits<double>::infinity(), far_m_ = 0;
  for (int f = 0; f < frames(); ++f) {
    const render::Camera camera = camera_of(f);
    const Vec3 view = (camera.target - camera.eye).normalized();
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner =
          look_.stage.lower + Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(look_.stage.size());
      near_m_ = std::min(near_m_, view.dot(corner - camera.eye));
      far_m_ = std::max(far_m_, view.dot(corner - camera.eye));
    }
  }
  near_m_ = std::max(near_m_, 0.0), far_m_ = std::max(far_m_, near_m_ + 1e-3);
}

Json Shot::key_of_passes() const {
  std::vector<std::string> objects{""};
  for (const auto* bodies : {&scene_.bodies, &scene_.scenery})
    for (const scenes::BodySpec& body : *bodies) objects.push_back(body.name);
  for (const scenes::LigamentSpec& ligament : scene_.ligaments) objects.push_back(ligament.name);
  Json key{{"depth_m", {near_m_, far_m_}}, {"objects", objects}};
  if (scene_.film.color_by != scenes::ColorBy::body)
    key["scalar"] = {{"of", caption_of(scene_.film.color_by)}, {"range", {low_, high_}}};
  const auto list = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  for (int f = 0; f < frames(); ++f) {
    key["contacts"].push_back(contacts_in_picture(f));
    Json names = Json::array();
    for (const Name& name : names_at(f))
      names.push_back({name.words, name.body + 1, name.end.x(), name.end.y(), name.share});
    if (!names_.empty()) key["labels"].push_back(std::move(names));
    const render::Camera camera = camera_of(f);
    key["cameras"].push_back({{"eye_m", list(camera.eye)},
                              {"target_m", list(camera.target)},
                              {"up", list(camera.up.normalized())},
                              {"fov_deg", camera.fov_deg}});
  }
  key["light"] = {{"toward_key", list(look_.toward_key.normalized())},
                  {"key", list(look_.key_light)},
                  {"key_size_deg", look_.key_size_deg},
                  {"sky", list(look_.sky_light)},
                  {"zenith_srgb", list(look_.background_top_srgb)},
                  {"horizon_srgb", list(look_.background_bottom_srgb)},
                  {"ground_srgb", list(look_.ground_srgb)},
                  {"ground_m", look_.ground_height_m ? Json(*look_.ground_height_m) : Json()}};
  return key;
}

// Of the stored frame that is shown, or was last; none under cards.
// [x, y (pixels), depth (m), force (N), who touches: its number as in the object pass, 0 for a wall]
Json Shot::contacts_in_picture(int frame) const {
  const render::Camera camera = camera_of(frame);
  Json contacts = Json::array();
  if (card_of(frame)) return contacts;
  for (const fem::ContactForce& touch : touches_[std::size_t(moment_of(frame))]) {
    if (!touches_robot(touch)) continue;
    const Vec3 pixel = render::pixel_from_world(camera, touch.place_m, look_.width, look_.height);
    const int toucher = touch.body == world_.robot ? touch.other : touch.body;
    contacts.push_back({pixel.x(), pixel.y(), pixel.z(), touch.force_n.norm(), toucher + 1});
  }
  return contacts;
}

// From 0 on; a change of volume goes both ways, and 0 stands in the middle. The range of the whole motion,
// where the scene gives none.
void Shot::measure_colors() {
  if (scene_.film.color_range) {
    low_ = (*scene_.film.color_range)[0], high_ = (*scene_.film.color_range)[1];
    return;
  }
  double least = 0, most = 0;
  for (const State& state : plan_.trajectory.frames)
    for (const double value : node_values(world_, state, scene_.film.color_by))
      least = std::min(least, value), most = std::max(most, value);
  const bool both_ways = scene_.film.color_by == scenes::ColorBy::volume;
  high_ = std::max({most, both_ways ? -least : 0.0, 1e-6});
  low_ = both_ways ? -high_ : 0;
}

}  // namespace limber::detail
