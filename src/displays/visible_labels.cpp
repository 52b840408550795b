// SPDX-License-Identifier: BSD-3-Clause
#include "visible_labels.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace process_visualizer::displays {
namespace {

constexpr std::size_t kMostLabels = 60;  ///< more could not be told apart
constexpr float kArrowWeight = 400;      ///< px
constexpr float kArrowWidth = 0.03F;     ///< m
constexpr float kBeside = 0.1F;          ///< of the view: what is so near its rim is still named
constexpr float kShortestLeader = 10;    ///< px
constexpr float kSameFoot = 14;          ///< px
constexpr Rgb kSharedColor{0.85F, 0.87F, 0.9F};

float distance(Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y); }

bool isIn(Size view, Point point, float beside) {
  return point.x >= -beside * view.width && point.x <= (1 + beside) * view.width &&
         point.y >= -beside * view.height && point.y <= (1 + beside) * view.height;
}

std::optional<Point> firstFootIn(Size view, const VisibleLabel& visible) {
  for (const auto& foot : visible.feet)
    if (foot && isIn(view, *foot, 0)) return foot;
  return {};
}

/// Nothing if the label is not in the picture, nor any of its arrows.
std::optional<VisibleLabel> seen(const SceneLabel& label, const ScreenProjection& projection) {
  VisibleLabel visible{&label, {}, projection.height(label.anchor, label.height_m), 0, {}};
  for (const auto& arrow : label.arrows)
    visible.feet.push_back(arrow ? projection.pixel(arrow->foot) : std::nullopt);
  const auto anchor = projection.pixel(label.anchor),
             foot = firstFootIn(projection.view(), visible);
  if (!foot && !(anchor && isIn(projection.view(), *anchor, kBeside))) return {};
  visible.anchor = anchor ? *anchor : *foot;
  return visible;
}

/// Adds a leader, unless another one leads to the same place.
void addLeader(const Leader& leader, std::vector<Leader>& leaders) {
  for (Leader& other : leaders) {
    if (distance(other.end, leader.end) > kSameFoot) continue;
    other.color = kSharedColor;
    return;
  }
  leaders.push_back(leader);
}

}  // namespace

std::vector<VisibleLabel> visibleLabels(const std::vector<SceneLabel>& labels,
                                        const ScreenProjection& projection,
                                        const Ogre::Vector3& camera) {
  std::vector<VisibleLabel> all;
  for (const SceneLabel& label : labels) {
    auto visible = seen(label, projection);
    if (!visible) continue;
    visible->distance_m = (label.anchor - camera).length();
    all.push_back(std::move(*visible));
  }
  const std::size_t count = std::min(all.size(), kMostLabels);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end(),
                    [](const auto& a, const auto& b) {
                      return std::tie(a.distance_m, a.label->key) <
                             std::tie(b.distance_m, b.label->key);
                    });
  all.resize(count);
  std::sort(all.begin(), all.end(),
            [](const auto& a, const auto& b) { return a.label->key < b.label->key; });
  return all;
}

std::vector<Obstacle> arrowObstacles(const VisibleLabel& visible,
                                     const ScreenProjection& projection) {
  std::vector<Obstacle> obstacles;
  for (std::size_t i = 0; i < visible.feet.size(); ++i) {
    const auto& arrow = visible.label->arrows[i];
    if (!visible.feet[i]) continue;
    const auto tip = projection.pixel(arrow->tip);
    const float width = projection.height(arrow->foot, kArrowWidth);
    if (!tip || width < 1) continue;
    const auto more = arrowObstacles(*visible.feet[i], *tip, width, kArrowWeight);
    obstacles.insert(obstacles.end(), more.begin(), more.end());
  }
  return obstacles;
}

std::vector<Leader> leadersOf(const VisibleLabel& visible, const Rect& plate, Size view) {
  std::vector<Leader> leaders;
  bool has_arrow = false;
  for (std::size_t i = 0; i < visible.feet.size(); ++i) {
    if (!visible.feet[i]) continue;
    has_arrow = true;
    const Point foot = *visible.feet[i];
    if (isIn(view, foot, 0))
      addLeader({nearestPoint(plate, foot), foot, visible.label->lines[i].color}, leaders);
  }
  if (!has_arrow && isIn(view, visible.anchor, 0))
    leaders.push_back({nearestPoint(plate, visible.anchor), visible.anchor, kSharedColor});
  leaders.erase(
      std::remove_if(leaders.begin(), leaders.end(),
                     [](const Leader& it) { return distance(it.begin, it.end) < kShortestLeader; }),
      leaders.end());
  return leaders;
}

}  // namespace process_visualizer::displays
