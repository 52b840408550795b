// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "flat_object.hpp"
#include "label_style.hpp"

namespace process_visualizer::displays {

/// A thin line from a plate to what it is about.
struct Leader {
  Point begin, end;  ///< px; a dot marks the end
  Rgb color;
};

/// Draws leaders in front of the scene.
class LeaderLines {
 public:
  /// `node` is the parent of what is drawn; it has to outlive this.
  LeaderLines(Ogre::SceneManager& scene, Ogre::SceneNode& node);

  /// `pixel_ratio`: pixels of the screen for each of the desktop's
  void draw(const std::vector<Leader>& leaders, Size view, float pixel_ratio);

 private:
  void addLeader(const Leader& leader, float pixel_ratio);
  void addLine(Point begin, Point end, float width, const Ogre::ColourValue& color);

  FlatObject object_;
};

/// The point of a rectangle that is nearest to another point: where a leader begins.
Point nearestPoint(const Rect& rect, Point to);

}  // namespace process_visualizer::displays
