// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "leader_lines.hpp"
#include "plate_painter.hpp"
#include "screen_projection.hpp"

namespace process_visualizer::displays {

/// An arrow in the fixed frame, m.
struct SceneArrow {
  Ogre::Vector3 foot, tip;
};

/// A label in the fixed frame.
struct SceneLabel {
  std::string key;       ///< the same from picture to picture
  Ogre::Vector3 anchor;  ///< m
  float height_m = 0;    ///< of a line
  std::vector<PlateLine> lines;
  std::vector<std::optional<SceneArrow>> arrows;  ///< of each line
};

/// A label in the picture.
struct VisibleLabel {
  const SceneLabel* label = nullptr;
  Point anchor;
  float text_height = 0;                   ///< of a line that stands in the scene, px
  float distance_m = 0;                    ///< from the camera
  std::vector<std::optional<Point>> feet;  ///< of each line's arrow
};

/// The labels that are in the picture, or whose arrows are: the nearest ones, sorted by key.
std::vector<VisibleLabel> visibleLabels(const std::vector<SceneLabel>& labels,
                                        const ScreenProjection& projection,
                                        const Ogre::Vector3& camera);

/// What the arrows of a label cover.
std::vector<Obstacle> arrowObstacles(const VisibleLabel& visible,
                                     const ScreenProjection& projection);

/// Lines from a label's plate to the feet of its arrows, or to its anchor if it has no arrow; none
/// to what is near the plate anyhow.
std::vector<Leader> leadersOf(const VisibleLabel& visible, const Rect& plate, Size view);

}  // namespace process_visualizer::displays
