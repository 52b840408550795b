// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "label_layout.hpp"
#include "label_plate.hpp"
#include "label_store.hpp"

namespace process_visualizer::displays {
namespace {

using visualization_msgs::Marker;

constexpr Size kView{1000, 800};
constexpr Size kPlate{120, 40};
constexpr float kPictures_s = 1.0F / 30;

Rect rectOf(const LabelBox& box, Point offset) {
  return {
      {box.anchor.x + offset.x - box.size.width / 2, box.anchor.y + offset.y - box.size.height / 2},
      box.size};
}

bool overlap(const Rect& a, const Rect& b) {
  return a.corner.x < b.corner.x + b.size.width && b.corner.x < a.corner.x + a.size.width &&
         a.corner.y < b.corner.y + b.size.height && b.corner.y < a.corner.y + a.size.height;
}

bool isInView(const Rect& rect) {
  return rect.corner.x >= 0 && rect.corner.y >= 0 &&
         rect.corner.x + rect.size.width <= kView.width + 0.01F &&
         rect.corner.y + rect.size.height <= kView.height + 0.01F;
}

std::vector<LabelBox> randomBoxes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> x(0, kView.width), y(0, kView.height), size(30, 150);
  std::vector<LabelBox> boxes(count);
  for (LabelBox& box : boxes) box = {{x(random), y(random)}, {size(random), 40}, {}};
  return boxes;
}

TEST(LabelLayout, APlateAloneIsAtItsAnchor) {
  const auto offsets = chooseOffsets({{{500, 400}, kPlate, {}}}, {}, kView);
  EXPECT_FLOAT_EQ(offsets.at(0).x, 0);
  EXPECT_FLOAT_EQ(offsets.at(0).y, 0);
}

TEST(LabelLayout, PlatesDoNotOverlap) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto boxes = randomBoxes(20, seed);
    const auto offsets = chooseOffsets(boxes, {}, kView);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_FALSE(overlap(rectOf(boxes[i], offsets[i]), rectOf(boxes[j], offsets[j])))
            << "seed " << seed << ": " << i << " and " << j;
    }
  }
}

TEST(LabelLayout, PlatesOfOnePlaceDoNotOverlap) {
  const std::vector<LabelBox> boxes(8, {{500, 400}, kPlate, {}});
  const auto offsets = chooseOffsets(boxes, {}, kView);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_FALSE(overlap(rectOf(boxes[i], offsets[i]), rectOf(boxes[j], offsets[j])));
  }
}

TEST(LabelLayout, WidePlatesDoNotOverlap) {
  std::vector<LabelBox> boxes;
  for (const float x : {100.0F, 300.0F, 600.0F, 700.0F, 900.0F, 500.0F})
    boxes.push_back({{x, 100 + x / 10}, {900, 60 + x / 20}, {}});
  const auto offsets = chooseOffsets(boxes, {}, kView);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_FALSE(overlap(rectOf(boxes[i], offsets[i]), rectOf(boxes[j], offsets[j])));
  }
}

TEST(LabelLayout, PlatesStayInTheView) {
  for (const Point anchor : {Point{-50, 400}, Point{1040, 400}, Point{3, 3}, Point{500, 850}}) {
    const LabelBox box{anchor, kPlate, {}};
    EXPECT_TRUE(isInView(rectOf(box, chooseOffsets({box}, {}, kView).at(0))));
  }
}

TEST(LabelLayout, WhatHasToBeSeenIsInTheView) {
  const Size view{800, 600};
  const Point inside = anchorOrTop(Point{100, 200}, view);
  EXPECT_EQ(inside.x, 100);
  EXPECT_EQ(inside.y, 200);
  for (const std::optional<Point>& outside :
       {std::optional<Point>(), std::optional<Point>({400, -90}), std::optional<Point>({900, 1})}) {
    const Point place = anchorOrTop(outside, view);
    EXPECT_EQ(place.x, 400);
    EXPECT_GT(place.y, 0);
    EXPECT_LT(place.y, 100);
  }
}

TEST(LabelLayout, APlateAvoidsAnArrow) {
  const Obstacle arrow{{{480, 390}, {60, 20}}, 400};
  const LabelBox box{{500, 400}, kPlate, {}};
  const Rect rect = rectOf(box, chooseOffsets({box}, {arrow}, kView).at(0));
  EXPECT_FALSE(overlap(rect, arrow.rect));
}

TEST(LabelLayout, AnObstacleIsNotWorthALongWay) {
  const Obstacle large{{{100, 100}, {800, 600}}, 20};
  const Point offset = chooseOffsets({{{500, 400}, kPlate, {}}}, {large}, kView).at(0);
  EXPECT_FLOAT_EQ(std::hypot(offset.x, offset.y), 0);
}

TEST(LabelLayout, APlaceThatIsHardlyBetterIsNotTaken) {
  const LabelBox box{{500, 400}, kPlate, Point{0, -20}};
  EXPECT_FLOAT_EQ(chooseOffsets({box}, {}, kView).at(0).y, -20);
  const LabelBox far{{500, 400}, kPlate, Point{0, -80}};
  EXPECT_FLOAT_EQ(chooseOffsets({far}, {}, kView).at(0).y, 0);
}

TEST(LabelLayout, TheSameSceneGivesTheSamePlaces) {
  const auto boxes = randomBoxes(30, 7);
  const auto one = chooseOffsets(boxes, {}, kView), other = chooseOffsets(boxes, {}, kView);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    EXPECT_FLOAT_EQ(one[i].x, other[i].x);
    EXPECT_FLOAT_EQ(one[i].y, other[i].y);
  }
}

/// Two plates that pass each other as two robots do, with the trembling of measured positions.
TEST(LabelLayout, NoPlateJumps) {
  LabelLayout layout;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> tremble(-1.5F, 1.5F);
  std::vector<Rect> last;
  for (int picture = 0; picture < 300; ++picture) {
    const auto x = static_cast<float>(2 * picture);
    const std::vector<LabelLayout::Plate> plates{{"a", {200 + x, 400 + tremble(random)}, kPlate},
                                                 {"b", {800 - x, 410 + tremble(random)}, kPlate}};
    const auto rects = layout.place(plates, {}, kView, kPictures_s);
    for (std::size_t i = 0; i < last.size(); ++i) {
      EXPECT_LT(
          std::hypot(rects[i].corner.x - last[i].corner.x, rects[i].corner.y - last[i].corner.y),
          30);
    }
    last = rects;
  }
}

TEST(LabelLayout, APlateThatWasGoneBeginsAnew) {
  LabelLayout layout;
  const std::vector<LabelLayout::Plate> both{{"a", {500, 400}, kPlate}, {"b", {500, 400}, kPlate}};
  EXPECT_NE(layout.place(both, {}, kView, 0).at(1).corner.y, 380);
  layout.place({}, {}, kView, 0);
  EXPECT_FLOAT_EQ(layout.place({both[1]}, {}, kView, 0).at(0).corner.y, 380);
}

TEST(LabelLayout, AnewIsWhereItWouldBeWithoutAPast) {
  LabelLayout fresh, layout;
  const std::vector<LabelLayout::Plate> plates{{"a", {500, 400}, kPlate},
                                               {"b", {520, 410}, kPlate}};
  const auto expected = fresh.place(plates, {}, kView, kPictures_s);
  layout.place({{"b", {520, 410}, kPlate}}, {}, kView, kPictures_s);
  layout.place(plates, {{{{440, 380}, {120, 40}}, 200}}, kView, kPictures_s);
  layout.place(plates, {}, kView, kPictures_s, true);
  const auto found = layout.place(plates, {}, kView, 10);
  for (std::size_t i = 0; i < plates.size(); ++i) {
    EXPECT_NEAR(found[i].corner.x, expected[i].corner.x, 0.5F);
    EXPECT_NEAR(found[i].corner.y, expected[i].corner.y, 0.5F);
  }
}

TEST(Stillness, BeginsOnceForEachRest) {
  Stillness stillness;
  const std::map<std::string, Point> here{{"a", {100, 100}}, {"b", {200, 100}}};
  const std::map<std::string, Point> trembling{{"a", {101, 100}}, {"b", {200, 99}}};
  const std::map<std::string, Point> there{{"a", {100, 100}}, {"b", {210, 100}}};
  const auto begun = [&](const std::map<std::string, Point>& points) {
    int count = 0;
    for (int i = 0; i < 30; ++i) count += stillness.begins(points, kPictures_s) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(begun(here), 1);
  EXPECT_EQ(begun(trembling), 0);
  EXPECT_EQ(begun(there), 1);
  EXPECT_EQ(begun({{"a", {100, 100}}}), 1);
  for (int i = 0; i < 30; ++i)
    EXPECT_FALSE(stillness.begins({{"a", {4.0F * static_cast<float>(i), 100}}}, kPictures_s));
}

TEST(LabelLayout, AViewWithoutRoomIsNoProblem) {
  const auto offsets = chooseOffsets(randomBoxes(100, 3), {}, {20, 10});
  for (const Point& it : offsets) EXPECT_TRUE(std::isfinite(it.x) && std::isfinite(it.y));
}

TEST(LabelStyle, EveryTextIsReadableOnEveryBackground) {
  for (int i = 0; i < 6 * 6 * 6; ++i) {
    const Rgb text{static_cast<float>(i % 6) / 5, static_cast<float>(i / 6 % 6) / 5,
                   static_cast<float>(i / 36) / 5};
    const PlateStyle plate = plateFor({text});
    EXPECT_GE(contrast(readableOn(plate, text), worstBackground(plate)), kReadableContrast) << i;
  }
}

TEST(LabelStyle, TextsOfOnePlateAreReadableToo) {
  const std::vector<Rgb> texts{{1, 1, 1}, {0, 0, 0.4F}, {0.5F, 0.5F, 0.5F}};
  const PlateStyle plate = plateFor(texts);
  for (const Rgb& text : texts)
    EXPECT_GE(contrast(readableOn(plate, text), worstBackground(plate)), kReadableContrast);
}

TEST(LabelStyle, AReadableColourStaysAsItIs) {
  const Rgb green{0.65F, 0.93F, 0.68F};
  EXPECT_FLOAT_EQ(readableOn(plateFor({green}), green).red, green.red);
}

TEST(LabelStyle, SizesFallGentlyBetweenTwoLimits) {
  EXPECT_EQ(fontSize(0, 1, 0), 13);
  EXPECT_EQ(fontSize(16, 1, 0), 16);
  EXPECT_EQ(fontSize(25, 1, 0), 20);
  EXPECT_EQ(fontSize(500, 1, 0), 22);
  EXPECT_EQ(fontSize(32, 2, 0), 32);
  EXPECT_EQ(fontSize(18, 1, 16), 17);
  EXPECT_EQ(fontSize(17, 1, 16), 16);
}

Marker textMarker(const std::string& name, const std::string& text, int id = 1) {
  Marker marker;
  marker.ns = name;
  marker.id = id;
  marker.type = Marker::TEXT_VIEW_FACING;
  marker.header.frame_id = "tool";
  marker.frame_locked = 1U;
  marker.pose.orientation.w = 1;
  marker.scale.z = 0.05;
  marker.color.a = 1;
  marker.text = text;
  return marker;
}

Marker arrowMarker(const std::string& name) {
  Marker marker = textMarker(name, "", 0);
  marker.type = Marker::ARROW;
  marker.scale.x = 0.2;
  marker.pose.position.y = 1;
  return marker;
}

Marker change(const std::string& name, int id, int action) {
  Marker marker;
  marker.ns = name;
  marker.id = id;
  marker.action = action;
  return marker;
}

const ros::Time kNow(100);

TEST(LabelStore, BlocksOfOnePlaceAreOneLabel) {
  LabelStore store;
  store.take(textMarker("velocity", "v 0.1 m/s\n "), kNow);
  store.take(textMarker("force", " \nF 2 N"), kNow);
  ASSERT_EQ(store.labels().size(), 1U);
  const auto& lines = store.labels()[0].lines;
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].text, "v 0.1 m/s");
  EXPECT_EQ(lines[1].text, "F 2 N");
}

TEST(LabelStore, TheLinesOfATextStayTogether) {
  LabelStore store;
  store.take(textMarker("a", "1\n2"), kNow);
  store.take(textMarker("b", "3\n4"), kNow);
  std::string all;
  for (const LabelLine& line : store.labels().at(0).lines) all += line.text;
  EXPECT_EQ(all, "1234");
}

TEST(LabelStore, OtherPlacesAreOtherLabels) {
  LabelStore store;
  Marker elsewhere = textMarker("b", "b");
  elsewhere.pose.position.x = 0.1;
  Marker other_frame = textMarker("c", "c");
  other_frame.header.frame_id = "base";
  for (const Marker& it : {textMarker("a", "a"), elsewhere, other_frame}) store.take(it, kNow);
  EXPECT_EQ(store.labels().size(), 3U);
}

TEST(LabelStore, DeletionsAndLifetimes) {
  LabelStore store;
  Marker mortal = textMarker("a", "a");
  mortal.lifetime = ros::Duration(0.8);
  store.take(mortal, kNow);
  store.take(textMarker("b", "b"), kNow);
  store.expire(kNow + ros::Duration(0.7));
  EXPECT_EQ(store.labels().at(0).lines.size(), 2U);
  store.expire(kNow + ros::Duration(0.9));
  EXPECT_EQ(store.labels().at(0).lines.size(), 1U);
  store.take(change("b", 1, Marker::DELETE), kNow);
  EXPECT_TRUE(store.labels().empty());
  store.take(textMarker("c", "c"), kNow);
  store.take(change("", 0, Marker::DELETEALL), kNow);
  EXPECT_TRUE(store.labels().empty());
}

TEST(LabelStore, WhatCannotBeDrawnIsNoLabel) {
  Marker no_number = textMarker("a", "a"), blank = textMarker("a", " \n\t"),
         invisible = textMarker("a", "a"), flat = textMarker("a", "a"),
         sphere = textMarker("a", "a");
  no_number.pose.position.x = std::numeric_limits<double>::quiet_NaN();
  invisible.color.a = 0;
  flat.scale.z = 0;
  sphere.type = Marker::SPHERE;
  for (const Marker& it : {no_number, blank, invisible, flat, sphere}) {
    LabelStore store;
    store.take(textMarker("a", "before"), kNow);
    store.take(it, kNow);
    EXPECT_TRUE(store.labels().empty());
  }
}

TEST(LabelStore, TheArrowOfANumber) {
  LabelStore store;
  store.take(textMarker("force", "F 2 N"), kNow);
  EXPECT_FALSE(store.labels().at(0).lines.at(0).arrow);
  store.take(arrowMarker("force"), kNow);
  const auto arrow = store.labels().at(0).lines.at(0).arrow;
  ASSERT_TRUE(arrow);
  EXPECT_DOUBLE_EQ(arrow->tip.position.x, 0.2);
  EXPECT_DOUBLE_EQ(arrow->tip.position.y, 1);
  store.take(change("force", 0, Marker::DELETE), kNow);
  EXPECT_FALSE(store.labels().at(0).lines.at(0).arrow);
  store.take(change("force", 1, Marker::DELETE), kNow);
  EXPECT_TRUE(store.labels().empty());
}

TEST(LabelStore, AThousandLabels) {
  LabelStore store;
  for (int i = 0; i < 1000; ++i) {
    Marker marker = textMarker("n", std::string(10000, 'x'), i);
    marker.pose.position.x = i;
    store.take(marker, kNow);
  }
  EXPECT_EQ(store.labels().size(), 1000U);
}

}  // namespace
}  // namespace process_visualizer::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
