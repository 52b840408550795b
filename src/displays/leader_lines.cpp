// SPDX-License-Identifier: BSD-3-Clause
#include "leader_lines.hpp"

#include <OgrePass.h>

#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr float kWidth = 1.5F, kRimWidth = 3.5F, kDotWidth = 6, kDotRimWidth = 8;
const Ogre::ColourValue kRim(0.05F, 0.06F, 0.08F, 0.5F);

}  // namespace

LeaderLines::LeaderLines(Ogre::SceneManager& scene, Ogre::SceneNode& node)
    : object_(scene, node, kLineQueue) {
  object_.pass().setSceneBlending(Ogre::SBT_TRANSPARENT_ALPHA);
}

void LeaderLines::draw(const std::vector<Leader>& leaders, Size view, float pixel_ratio) {
  object_.setVisible(!leaders.empty());
  if (leaders.empty()) return;
  object_.begin(view);
  for (const Leader& leader : leaders) addLeader(leader, pixel_ratio);
  object_.end();
}

/// With a dark rim, so that it is seen on every background.
void LeaderLines::addLeader(const Leader& leader, float pixel_ratio) {
  const Ogre::ColourValue color(leader.color.red, leader.color.green, leader.color.blue);
  addLine(leader.begin, leader.end, kRimWidth * pixel_ratio, kRim);
  addLine(leader.end, leader.end, kDotRimWidth * pixel_ratio, kRim);
  addLine(leader.begin, leader.end, kWidth * pixel_ratio, color);
  addLine(leader.end, leader.end, kDotWidth * pixel_ratio, color);
}

/// A line with square ends; without length it is a dot.
void LeaderLines::addLine(Point begin, Point end, float width, const Ogre::ColourValue& color) {
  const float x = end.x - begin.x, y = end.y - begin.y, length = std::hypot(x, y);
  const float half = width / 2;
  const Point along = length > 0 ? Point{half * x / length, half * y / length} : Point{half, 0};
  const Point across{-along.y, along.x};
  object_.addCorner({begin.x - along.x + across.x, begin.y - along.y + across.y}, color);
  object_.addCorner({begin.x - along.x - across.x, begin.y - along.y - across.y}, color);
  object_.addCorner({end.x + along.x - across.x, end.y + along.y - across.y}, color);
  object_.addCorner({end.x + along.x + across.x, end.y + along.y + across.y}, color);
}

Point nearestPoint(const Rect& rect, Point to) {
  return {std::clamp(to.x, rect.corner.x, rect.corner.x + rect.size.width),
          std::clamp(to.y, rect.corner.y, rect.corner.y + rect.size.height)};
}

}  // namespace process_visualizer::displays
