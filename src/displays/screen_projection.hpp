// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreMatrix4.h>

#include <optional>
#include <vector>

#include "label_layout.hpp"

namespace Ogre {
class Camera;
class SceneManager;
}  // namespace Ogre

namespace process_visualizer::displays {

/// Where points of the scene are in the picture.
class ScreenProjection {
 public:
  ScreenProjection(const Ogre::Camera& camera, Size view);

  /// px; nothing for points behind the camera
  std::optional<Point> pixel(const Ogre::Vector3& point) const;
  /// How tall a height [m] is at a point, px.
  float height(const Ogre::Vector3& point, float height_m) const;
  Size view() const { return view_; }

 private:
  Ogre::Matrix4 matrix_;
  Ogre::Vector3 up_;
  Size view_;
};

/// Rectangles around the parts of models and arrows, each of `weight`. A slender part is divided
/// along its length; what fills much of the picture is left out, as nothing could avoid it.
std::vector<Obstacle> modelObstacles(Ogre::SceneManager& scene, const ScreenProjection& projection,
                                     float weight);

/// Rectangles along an arrow in the picture.
std::vector<Obstacle> arrowObstacles(Point foot, Point tip, float width, float weight);

}  // namespace process_visualizer::displays
