// Names beside a picture: no two overlap, no lines cross where they need not, and the same again.
#include "render/label_places.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "render/annotate.h"

namespace limber::render {
namespace {

using Vec2 = Eigen::Vector2d;

const LabelRoom room{1280, 720, 12, {400, 100, 880, 620}, {}};

std::vector<WantedLabel> at_rest(const std::vector<Vec2>& ends) {
  std::vector<WantedLabel> labels;
  for (std::size_t i = 0; i < ends.size(); ++i) labels.push_back({40.0 + 17 * double(i % 5), {ends[i]}});
  return labels;
}

bool overlap(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

void expect_well_placed(const std::vector<WantedLabel>& labels, const LabelRoom& in) {
  const auto places = place_labels(labels, in);
  for (std::size_t a = 0; a < labels.size(); ++a) {
    ASSERT_TRUE(places[a]);
    const Eigen::Vector4d& box = places[a]->box;
    EXPECT_TRUE(0 <= box[0] && 0 <= box[1] && box[2] <= in.width && box[3] <= in.height) << box.transpose();
    EXPECT_FALSE(overlap(box, in.subject));
    EXPECT_NEAR(box[2] - box[0], labels[a].width_px, 1e-9);
    for (const auto& taken : in.taken) EXPECT_FALSE(overlap(box, taken));
    for (std::size_t b = a + 1; b < labels.size(); ++b) {
      EXPECT_FALSE(overlap(box, places[b]->box));
      for (std::size_t m = 0; m < labels[a].ends.size(); ++m)
        if (labels[a].ends[m] && labels[b].ends[m]) {
          EXPECT_FALSE(collide(*places[a], *labels[a].ends[m], *places[b], *labels[b].ends[m]))
              << a << " " << b;
        }
    }
  }
  EXPECT_EQ(place_labels(labels, in), places);
}

// Wherever sixteen ends lie still in the subject.
TEST(LabelPlaces, LinesToEndsAtRestDoNotCross) {
  for (std::uint64_t round = 0; round < 30; ++round) {
    SCOPED_TRACE(round);
    Rng random(5, round);
    std::vector<Vec2> ends;
    for (int i = 0; i < 16; ++i) ends.emplace_back(random.uniform(410, 870), random.uniform(110, 610));
    expect_well_placed(at_rest(ends), room);
  }
}

TEST(LabelPlaces, OtherWordsKeepTheirPlaces) {
  LabelRoom full = room;
  full.taken = {{0, 0, 500, 150}, {0, 600, 640, 720}, {900, 300, 1280, 500}};
  std::vector<Vec2> ends;
  for (int i = 0; i < 14; ++i) ends.emplace_back(500 + 20 * i, 150 + 30 * i);
  expect_well_placed(at_rest(ends), full);
}

// One end is just below the other for seven moments and far above it for four: the shortest lines would cross
// seven times. The place is one for all moments.
TEST(LabelPlaces, OfEndsThatMoveLinesCrossSeldom) {
  std::vector<WantedLabel> labels{{50, {}}, {50, {}}};
  for (int m = 0; m < 11; ++m)
    labels[0].ends.emplace_back(Vec2(450, m < 7 ? 610 : 100)), labels[1].ends.emplace_back(Vec2(450, 600));
  const auto places = place_labels(labels, room);
  int crossed = 0;
  for (std::size_t m = 0; m < 11; ++m)
    crossed += int(collide(*places[0], *labels[0].ends[m], *places[1], *labels[1].ends[m]));
  EXPECT_LE(crossed, 4);
}

TEST(LabelPlaces, AreOnTheSideOfTheirEnds) {
  const auto places = place_labels(at_rest({{420, 300}, {860, 300}}), room);
  EXPECT_LT(places[0]->box[2], room.subject[0]);
  EXPECT_GT(places[1]->box[0], room.subject[2]);
  // Words of the left column end where it ends, those of the right begin there; lines begin between.
  const auto more = place_labels(at_rest({{420, 200}, {420, 400}, {860, 200}, {860, 400}}), room);
  EXPECT_NEAR(more[0]->box[2], more[1]->box[2], 1e-9);
  EXPECT_NEAR(more[2]->box[0], more[3]->box[0], 1e-9);
  EXPECT_GT(more[0]->foot.x(), more[0]->box[2]);
  EXPECT_LT(more[2]->foot.x(), more[2]->box[0]);
}

TEST(LabelPlaces, WhatIsNeverSeenOrHasNoRoomHasNone) {
  std::vector<WantedLabel> labels = at_rest({{420, 300}, {860, 300}});
  labels[0].ends[0].reset();
  EXPECT_FALSE(place_labels(labels, room)[0]);
  EXPECT_TRUE(place_labels(labels, room)[1]);
  EXPECT_TRUE(place_labels({}, room).empty());
  LabelRoom tiny = room;
  tiny.height = 120;
  std::vector<WantedLabel> many;
  for (int i = 0; i < 20; ++i)
    many.push_back({50, {Vec2(500, 50), i < 4 ? std::optional<Vec2>() : Vec2(510, 60)}});
  const auto places = place_labels(many, tiny);
  const auto placed =
      std::count_if(places.begin(), places.end(), [](const auto& p) { return p.has_value(); });
  EXPECT_GE(placed, 4);
  EXPECT_LT(placed, 16);
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(places[std::size_t(i)]);  // those shown least
}

// The words lie in their box, the line runs from its foot to its end, and half of both is half way.
TEST(LabelPlaces, ALabelIsDrawnWhereItStands) {
  const std::string words = "Left lung";
  WantedLabel label{width_of_words(words, room.letter_px), {Vec2(600, 300)}};
  const LabelPlace place = *place_labels({label}, room)[0];
  const Image8 before = filled(room.width, room.height, {0.5, 0.6, 0.7});
  Image8 whole = before, half = before;
  draw_label(whole, words, place, *label.ends[0], room.letter_px, false);
  draw_label(half, words, place, *label.ends[0], room.letter_px, false, 0.5);
  const Vec2 way = *label.ends[0] - place.foot;
  int in_box = 0, on_line = 0;
  for (int y = 0; y < room.height; ++y)
    for (int x = 0; x < room.width; ++x) {
      const std::size_t at = 3 * (std::size_t(y) * room.width + std::size_t(x));
      if (whole.rgb[at] == before.rgb[at] && whole.rgb[at + 1] == before.rgb[at + 1]) continue;
      const Vec2 p(x + 0.5, y + 0.5);
      const double share = std::clamp((p - place.foot).dot(way) / way.squaredNorm(), 0.0, 1.0);
      const bool box = p.x() > place.box[0] - 3 && p.x() < place.box[2] + 3 && p.y() > place.box[1] - 3 &&
                       p.y() < place.box[3] + 3,
                 line = (p - place.foot - share * way).norm() < room.letter_px;
      EXPECT_TRUE(box || line) << x << " " << y;
      in_box += int(box), on_line += int(line && whole.rgb[at] < 90);
      EXPECT_LE(std::abs(whole.rgb[at] - before.rgb[at]) + 2,
                2 * std::abs(half.rgb[at] - before.rgb[at]) + 110);
    }
  EXPECT_GT(in_box, 300);
  EXPECT_GT(on_line, 0.8 * std::abs(way.x()));
}

}  // namespace
}  // namespace limber::render
