// Where names stand beside a picture's subject: in a column on its left and one on its right, each with a
// line to what it names. For a whole shot: names stand still while what they name moves. Method:
// docs/rendering.md.
#pragma once

#include <optional>
#include <vector>

#include "core/types.h"

namespace limber::render {

struct WantedLabel {
  double width_px = 0;  // of its words
  // A moment of the shot each, as many for all labels: where its line ends; none: not to be shown.
  std::vector<std::optional<Eigen::Vector2d>> ends;
};

struct LabelRoom {
  int width = 0, height = 0;                // of the picture
  double letter_px = 0;                     // height of a capital
  Eigen::Vector4d subject = {0, 0, 0, 0};   // left, top, right, bottom: columns keep clear of it
  std::vector<Eigen::Vector4d> taken = {};  // boxes of other words
};

struct LabelPlace {
  double left_px = 0, baseline_px = 0;
  Eigen::Vector2d foot = {0, 0};       // where its line begins
  Eigen::Vector4d box = {0, 0, 0, 0};  // of the words
  bool operator==(const LabelPlace&) const = default;
};

// None for labels that are never to be shown, and, where there is no more room, for those shown least. Boxes
// are in the picture and overlap neither one another nor what is taken. Lines are as short, and cross as
// seldom, as a search of changes one by one finds. Same input, same places.
std::vector<std::optional<LabelPlace>> place_labels(const std::vector<WantedLabel>&, const LabelRoom&);

// Of two boxes (left, top, right, bottom).
bool overlap(const Eigen::Vector4d&, const Eigen::Vector4d&);

// Whether the label's line, to this end, runs through a box.
bool runs_through(const LabelPlace&, const Eigen::Vector2d& end, const Eigen::Vector4d& box);

// Whether two labels' lines cross, or one's line passes the other's words.
bool collide(const LabelPlace&, const Eigen::Vector2d& end, const LabelPlace& other,
             const Eigen::Vector2d& other_end);

}  // namespace limber::render
