// camera, [[cameras]] and film: from where the motion is seen, and how it is told. Meaning:
// docs/rendering.md. What would only come to light when a film is painted is refused here: letters that
// cannot be seen, a range of colours that is empty, pictures that exclude one another, an inset of a camera
// that is not there.
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "core/words.h"
#include "scenes/detail/scene_parts.h"
#include "scenes/detail/typed_reads.h"

namespace limber::scenes {

namespace {

CameraSpec read_camera(const Node& table, const Scene& scene, const std::string& name) {
  CameraSpec camera;
  camera.name = name;
  camera.direction = direction(table, "direction", "camera.direction");
  camera.fov_deg = number(table, "fov_deg");
  camera.turn_deg = number(table, "turn_deg");
  for (const Node& node : list(table, "keyframes")) {
    const Keyframe frame{number(node, "at"), vector(node, "eye_m"), vector(node, "target_m")};
    if (!camera.keyframes.empty() && frame.at <= camera.keyframes.back().at)
      complain(child(node, "at"),
               fmt::format("keyframe at {} does not come after the one at {}; put them in order", frame.at,
                           camera.keyframes.back().at));
    if (frame.eye_m == frame.target_m)
      complain(child(node, "target_m"), "the camera looks at the place where it is; move target_m or eye_m");
    camera.keyframes.push_back(frame);
  }
  camera.fill = number(table, "fill");
  if (const Node* follow = table.find("follow")) camera.follow = body_called(*follow, scene, "follow");
  if (const Node* subject = table.find("subject")) {
    if (const Array* bodies = subject->array())
      for (const Node& body : *bodies) camera.subjects.push_back(body_called(body, scene, "subject"));
    else
      camera.subjects = {body_called(*subject, scene, "subject")};
    if (camera.follow >= 0 || !camera.keyframes.empty())
      complain(*subject, "a camera with follow or keyframes frames no subject; remove one of them");
  }
  return camera;
}

}  // namespace

// The table `camera` is the first, called main. Names differ in more than capitals, for they name files.
std::vector<CameraSpec> read_cameras(const Node& root, const Scene& scene) {
  std::vector<CameraSpec> cameras{read_camera(child(root, "camera"), scene, "main")};
  for (const Node& table : list(root, "cameras")) {
    const std::string& name = text(table, "name");
    for (const CameraSpec& other : cameras)
      if (same_but_for_case(other.name, name))
        complain(child(table, "name"),
                 fmt::format(
                     "two cameras are called \"{}\" (\"main\" is the table camera){}; give each its own name",
                     name, other.name == name ? "" : ", but for capitals"));
    cameras.push_back(read_camera(table, scene, name));
  }
  return cameras;
}

void check_inset(const Node& film, const Scene& scene) {
  if (!scene.film.inset) return;
  std::vector<std::string> names;
  for (const CameraSpec& camera : scene.cameras) names.push_back(camera.name);
  if (std::find(names.begin(), names.end(), scene.film.inset->camera) == names.end())
    complain(child(child(film, "inset"), "camera"),
             fmt::format("film.inset.camera: the scene has no camera \"{}\"; there are: {}",
                         scene.film.inset->camera, fmt::join(names, ", ")));
}

namespace {

// Of bodies and, after those, of scenery.
int seen_called(const Node& node, const std::string& name, const Scene& scene, const char* key) {
  std::vector<std::string> names;
  for (const auto* bodies : {&scene.bodies, &scene.scenery})
    for (const BodySpec& body : *bodies) names.push_back(body.name);
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) {
    const std::string meant = nearest(name, names);
    complain(node, fmt::format("{}: the scene has no body \"{}\"; {}", key, name,
                               meant.empty() ? fmt::format("there are: {}", fmt::join(names, ", "))
                                             : fmt::format("did you mean \"{}\"?", meant)));
  }
  return int(at - names.begin());
}

// lung_left is "Left lung", vertebrae_L5 "Vertebrae L5".
std::string called(const std::string& name) {
  std::string words = name;
  std::replace(words.begin(), words.end(), '_', ' ');
  for (const std::string side : {" left", " right"})
    if (words.ends_with(side) && words.size() > side.size())
      words = side.substr(1) + " " + words.substr(0, words.size() - side.size());
  words[0] = char(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

}  // namespace

void read_labels(const Node& film, Scene& scene) {
  const Node& node = child(film, "labels");
  std::vector<LabelSpec>& labels = scene.film.labels;
  constexpr std::size_t longest = 60;  // bytes
  const auto add = [&](const Node& where, const std::string& name, const std::string& words) {
    const int body = seen_called(where, name, scene, "film.labels");
    if (std::any_of(labels.begin(), labels.end(), [&](const LabelSpec& l) { return l.body == body; }))
      complain(where, fmt::format("film.labels names {} twice; leave one out", name));
    const auto unseen = [](unsigned char c) { return c < ' ' || c == 127; };
    if (words.find_first_not_of(' ') == words.npos || std::any_of(words.begin(), words.end(), unseen))
      complain(where, fmt::format("film.labels: the name of {} is empty, or has letters that cannot be seen; "
                                  "it is one line",
                                  name));
    if (words.size() > longest)
      complain(where, fmt::format("film.labels: the name of {} is longer than {} bytes; write a shorter one",
                                  name, longest));
    labels.push_back({body, words});
  };
  if (const bool* all = std::get_if<bool>(&node.value)) {
    for (const auto* bodies : {&scene.bodies, &scene.scenery})
      for (const BodySpec& body : *bodies)
        if (*all) add(node, body.name, called(body.name));
  } else if (const Array* some = node.array()) {
    for (const Node& one : *some) add(one, as_text(one), called(as_text(one)));
  } else {
    for (const Entry& entry : *node.table()) add(entry.value, entry.key, as_text(entry.value));
  }
  if (!labels.empty() && scene.film.side_by_side)
    complain(node, "film.labels have no room where film.side_by_side shows two pictures; take one of them");
}

void read_cuts(const Node& film, Scene& scene) {
  const Array& tables = list(film, "cuts");
  if (tables.size() > max_cuts)
    complain(child(film, "cuts"),
             fmt::format("film.cuts has {} planes; at most {} are cut at a time", tables.size(), max_cuts));
  for (const Node& table : tables) {
    CutSpec cut{vector(table, "point_m"), direction(table, "normal", "film.cuts.normal"), {}};
    if (const Node* named = table.find("bodies")) {
      if (named->array()->empty()) complain(*named, "film.cuts.bodies is empty; name some, or leave it out");
      for (const Node& one : *named->array())
        cut.bodies.push_back(seen_called(one, as_text(one), scene, "film.cuts.bodies"));
    } else {
      int number = 0;
      for (const auto* bodies : {&scene.bodies, &scene.scenery})
        for (const BodySpec& body : *bodies) {
          if (body.opacity < 1 || bodies == &scene.scenery) cut.bodies.push_back(number);
          ++number;
        }
      if (cut.bodies.empty())
        complain(table,
                 "film.cuts cuts scenery and bodies that are seen through, and there are none; name "
                 "bodies = [\"…\"]");
    }
    scene.film.cuts.push_back(std::move(cut));
  }
}

namespace {

ColorBy read_color_by(const std::string& word) {
  return word == "strain"        ? ColorBy::strain
         : word == "volume"      ? ColorBy::volume
         : word == "penetration" ? ColorBy::penetration
         : word == "speed"       ? ColorBy::speed
                                 : ColorBy::body;
}

// One line or several, without letters that cannot be seen.
std::vector<std::string> lines_of(const Node& node, const char* key) {
  std::vector<std::string> lines{""};
  for (const char c : as_text(node)) {
    if (c == '\n')
      lines.emplace_back();
    else if (static_cast<unsigned char>(c) < ' ' || c == 127)
      complain(node, fmt::format("{} has letters that cannot be seen", key));
    else
      lines.back() += c;
  }
  while (lines.size() > 1 && lines.back().empty()) lines.pop_back();
  if (std::all_of(lines.begin(), lines.end(),
                  [](const std::string& l) { return l.find_first_not_of(' ') == l.npos; }))
    complain(node, fmt::format("{} has no words; write some, or leave the card out", key));
  constexpr std::size_t most = 8;
  if (lines.size() > most)
    complain(node, fmt::format("{} has {} lines; at most {} fit on the picture", key, lines.size(), most));
  return lines;
}

std::optional<CardSpec> read_card(const Node& film, const char* name) {
  const Node* table = film.find(name);
  if (!table) return {};
  return CardSpec{lines_of(child(*table, "text"), fmt::format("film.{}.text", name).c_str()),
                  number(*table, "duration_s"), text(*table, "ground") == "plain"};
}

}  // namespace

FilmSpec read_film(const Node& table) {
  const Eigen::Vector2i size = vector2(table, "size_px").cast<int>(),
                        sheet = vector2(table, "sheet").cast<int>();
  FilmSpec film;
  film.width_px = size[0], film.height_px = size[1];
  film.frames_per_second = integer(table, "frames_per_second");
  film.speed = number(table, "speed");
  if (film.frames_per_second / film.speed > 10'000)
    complain(child(table, "speed"), fmt::format("film.frames_per_second over film.speed are {:g} states a "
                                                "second of motion, more than 10,000; raise speed",
                                                film.frames_per_second / film.speed));
  film.pace = named<Pace>(text(table, "pace"), {{"steady", Pace::steady}, {"contact", Pace::contact}});
  film.slowest = vector2(table, "pace_range")[0], film.quickest = vector2(table, "pace_range")[1];
  if (table.find("length_s")) film.length_s = number(table, "length_s");
  if (film.length_s && film.pace == Pace::steady)
    complain(child(table, "length_s"),
             "film.length_s needs film.pace = \"contact\"; a steady film is as long as speed makes it");
  film.end = named<FilmEnd>(text(table, "end"), {{"path", FilmEnd::path}, {"rest", FilmEnd::rest}});
  film.look = named<FilmLook>(text(table, "look"), {{"studio", FilmLook::studio},
                                                    {"dark", FilmLook::dark},
                                                    {"clinical", FilmLook::clinical},
                                                    {"paper", FilmLook::paper}});
  if (table.find("background")) film.background_srgb = as_color(text(table, "background"));
  if (table.find("ground_m")) film.ground_m = number(table, "ground_m");
  film.bounds_lines = flag(table, "bounds_lines");
  film.transparent = flag(table, "transparent");
  film.caption = text(table, "caption");
  if (std::any_of(film.caption.begin(), film.caption.end(),
                  [](unsigned char c) { return c < ' ' || c == 127; }))
    complain(child(table, "caption"), "film.caption has letters that cannot be seen; it is one line");
  film.clock = flag(table, "clock");
  film.scale_bar = flag(table, "scale_bar");
  film.color_by = read_color_by(text(table, "color_by"));
  if (table.find("color_range")) {
    film.color_range = vector2(table, "color_range");
    if (!((*film.color_range)[0] < (*film.color_range)[1]))
      complain(child(table, "color_range"),
               "both ends of film.color_range are the same; write for example [0, 0.5]");
  }
  film.cages = flag(table, "cages");
  film.forces = flag(table, "forces");
  film.path = flag(table, "path");
  film.tree = flag(table, "tree");
  film.side_by_side = flag(table, "side_by_side");
  film.panes = flag(table, "panes");
  film.outlines = flag(table, "outlines");
  if (const Node* inset = table.find("inset"))
    film.inset = InsetSpec{text(*inset, "camera"), number(*inset, "size")};
  film.title = read_card(table, "title"), film.end_card = read_card(table, "end_card");
  if (film.inset && film.side_by_side)
    complain(child(table, "inset"),
             "film.inset and film.side_by_side both show a second picture; take one of them");
  film.sheet_columns = sheet[0], film.sheet_rows = sheet[1];
  return film;
}

}  // namespace limber::scenes
