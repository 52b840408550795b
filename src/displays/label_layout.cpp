// SPDX-License-Identifier: BSD-3-Clause
// Costs by which the places of label plates are chosen, and their gliding motion.

#include "label_layout.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr float kGap = 6;             ///< between two plates, px
constexpr float kPlateWeight = 5000;  ///< so high that plates overlap only if there is no room
constexpr float kBetter = 30;         ///< difference from which a place is clearly better, px
constexpr float kGlideTime = 0.12F;   ///< time constant, s
constexpr float kTop = 0.06F;         ///< place of labels at the top, relative to the view's height
constexpr int kRings = 5;
constexpr int kDirections = 12;

Rect centered(Point middle, Size size) {
  return {{middle.x - size.width / 2, middle.y - size.height / 2}, size};
}

float area(Size size) { return size.width * size.height; }

float overlap(float low_a, float length_a, float low_b, float length_b) {
  return std::min(low_a + length_a, low_b + length_b) - std::max(low_a, low_b);
}

/// The common area of two rectangles, relative to the smaller one.
float overlap(const Rect& a, const Rect& b) {
  const float width = overlap(a.corner.x, a.size.width, b.corner.x, b.size.width);
  const float height = overlap(a.corner.y, a.size.height, b.corner.y, b.size.height);
  if (width <= 0 || height <= 0) return 0;
  return width * height / std::max(std::min(area(a.size), area(b.size)), 1.0F);
}

Rect widened(const Rect& rect, float by) {
  return {{rect.corner.x - by, rect.corner.y - by},
          {rect.size.width + 2 * by, rect.size.height + 2 * by}};
}

float within(float low, float length, float room) {
  return std::max(0.0F, std::min(low, room - length));
}

Rect keptIn(Size view, Rect rect) {
  rect.corner.x = within(rect.corner.x, rect.size.width, view.width);
  rect.corner.y = within(rect.corner.y, rect.size.height, view.height);
  return rect;
}

/// Unit vectors in all directions, alternating sides, from straight up on.
std::array<Point, kDirections> directions() {
  std::array<Point, kDirections> all;
  for (int i = 0; i < kDirections; ++i) {
    const int step = (i + 1) / 2;
    const float turn = 6.2831853F * static_cast<float>(step) / kDirections;
    const float angle = 1.5707963F + (i % 2 == 0 ? turn : -turn);
    all[i] = {std::cos(angle), -std::sin(angle)};
  }
  return all;
}

/// Chooses the places of plates, one after another.
class Chooser {
 public:
  Chooser(const std::vector<Obstacle>& obstacles, Size view) : obstacles_(obstacles), view_(view) {}

  Point choose(const LabelBox& label) {
    best_cost_ = 1e30F;
    if (label.offset) consider(label, *label.offset, -kBetter);
    consider(label, {}, 0);
    for (int ring = 1; ring <= kRings; ++ring) considerRing(label, static_cast<float>(ring));
    if (platesUnder(best_) > 0) considerBesidePlates(label);
    placed_.push_back(widened(best_, kGap));
    return {best_.corner.x + best_.size.width / 2 - label.anchor.x,
            best_.corner.y + best_.size.height / 2 - label.anchor.y};
  }

 private:
  /// Considers places around the anchor, farther away sideways, as plates are wide.
  void considerRing(const LabelBox& label, float ring) {
    static const std::array<Point, kDirections> around = directions();
    const float width = ring * (label.size.width * 0.4F + kGap);
    const float height = ring * (label.size.height * 0.6F + kGap);
    for (const Point& way : around) consider(label, {way.x * width, way.y * height}, 0);
  }

  /// Considers places right above and below other plates, for crowded scenes and wide plates.
  void considerBesidePlates(const LabelBox& label) {
    for (const Rect& other : placed_) {
      const float above = other.corner.y - label.size.height / 2;
      const float below = other.corner.y + other.size.height + label.size.height / 2;
      consider(label, {0, above - label.anchor.y}, 0);
      consider(label, {0, below - label.anchor.y}, 0);
    }
  }

  void consider(const LabelBox& label, Point offset, float extra_cost) {
    const Point middle{label.anchor.x + offset.x, label.anchor.y + offset.y};
    const Rect rect = keptIn(view_, centered(middle, label.size));
    float cost = extra_cost + std::hypot(offset.x, offset.y);
    if (cost < best_cost_) cost += platesUnder(rect);
    if (cost < best_cost_) cost += obstaclesUnder(rect);
    if (cost >= best_cost_) return;
    best_cost_ = cost;
    best_ = rect;
  }

  float platesUnder(const Rect& rect) const {
    float cost = 0;
    for (const Rect& other : placed_) cost += kPlateWeight * overlap(rect, other);
    return cost;
  }

  float obstaclesUnder(const Rect& rect) const {
    float cost = 0;
    for (const Obstacle& it : obstacles_) cost += it.weight * overlap(rect, it.rect);
    return cost;
  }

  const std::vector<Obstacle>& obstacles_;
  Size view_;
  std::vector<Rect> placed_;
  Rect best_;
  float best_cost_ = 0;
};

}  // namespace

Point anchorOrTop(const std::optional<Point>& anchor, Size view) {
  const bool is_in = anchor && anchor->x >= 0 && anchor->x <= view.width && anchor->y >= 0 &&
                     anchor->y <= view.height;
  return is_in ? *anchor : Point{view.width / 2, kTop * view.height};
}

std::vector<Point> chooseOffsets(const std::vector<LabelBox>& labels,
                                 const std::vector<Obstacle>& obstacles, Size view) {
  Chooser chooser(obstacles, view);
  std::vector<Point> offsets;
  offsets.reserve(labels.size());
  for (const LabelBox& label : labels) offsets.push_back(chooser.choose(label));
  return offsets;
}

std::vector<Rect> LabelLayout::place(const std::vector<Plate>& plates,
                                     const std::vector<Obstacle>& obstacles, Size view,
                                     float elapsed_s, bool from_scratch) {
  std::vector<LabelBox> boxes;
  for (const Plate& plate : plates) {
    const auto last = offsets_.find(plate.key);
    boxes.push_back({plate.anchor, plate.size, {}});
    if (last != offsets_.end() && !from_scratch) boxes.back().offset = last->second.chosen;
  }
  const std::vector<Point> chosen = chooseOffsets(boxes, obstacles, view);
  std::map<std::string, Offset> offsets;
  std::vector<Rect> places;
  for (std::size_t i = 0; i < plates.size(); ++i) {
    const Offset offset = glide(plates[i].key, chosen[i], elapsed_s);
    offsets[plates[i].key] = offset;
    const Point& anchor = plates[i].anchor;
    const Point middle{anchor.x + offset.shown.x, anchor.y + offset.shown.y};
    places.push_back(keptIn(view, centered(middle, plates[i].size)));
  }
  offsets_ = std::move(offsets);
  return places;
}

LabelLayout::Offset LabelLayout::glide(const std::string& key, Point chosen,
                                       float elapsed_s) const {
  const auto last = offsets_.find(key);
  if (last == offsets_.end()) return {chosen, chosen};
  const Point& shown = last->second.shown;
  const float part = 1 - std::exp(-std::max(elapsed_s, 0.0F) / kGlideTime);
  return {chosen, {shown.x + part * (chosen.x - shown.x), shown.y + part * (chosen.y - shown.y)}};
}

namespace {

constexpr float kMinRest = 0.25F;  ///< s
constexpr float kTremble = 1.5F;   ///< px; a resting robot trembles a little

}  // namespace

bool Stillness::begins(const std::map<std::string, Point>& points, float elapsed_s) {
  if (!isAtRest(points)) {
    rest_ = points;
    rest_s_ = 0;
    has_begun_ = false;
    return false;
  }
  rest_s_ += elapsed_s;
  const bool begins = !has_begun_ && rest_s_ >= kMinRest;
  has_begun_ = has_begun_ || begins;
  return begins;
}

bool Stillness::isAtRest(const std::map<std::string, Point>& points) const {
  return std::equal(
      points.begin(), points.end(), rest_.begin(), rest_.end(), [](const auto& a, const auto& b) {
        return a.first == b.first &&
               std::hypot(a.second.x - b.second.x, a.second.y - b.second.y) <= kTremble;
      });
}

}  // namespace process_visualizer::displays
