// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreManualObject.h>
#include <OgreMaterial.h>

#include "label_layout.hpp"

namespace process_visualizer::displays {

/// When things in front of the scene are drawn: after the scene, plates over lines.
constexpr Ogre::uint8 kLineQueue = 97;
constexpr Ogre::uint8 kPlateQueue = 98;

/// Quadrangles in front of the scene, with colours of their own whatever the light.
class FlatObject {
 public:
  /// `node` is the parent of what is drawn; it has to outlive this.
  FlatObject(Ogre::SceneManager& scene, Ogre::SceneNode& node, Ogre::uint8 queue);
  ~FlatObject();
  FlatObject(const FlatObject&) = delete;
  FlatObject& operator=(const FlatObject&) = delete;

  Ogre::Pass& pass() const;
  void setVisible(bool is_visible) { object_->setVisible(is_visible); }

  /// Begins anew, with what is to be seen in a view.
  void begin(Size view);
  /// Adds a corner, px; the four corners of a quadrangle follow each other, all around it.
  void addCorner(Point corner, const Ogre::ColourValue& color);
  /// Adds a corner that shows a point of the material's texture, from 0 to 1.
  void addCorner(Point corner, Point texture);
  void end();

 private:
  void addPosition(Point corner);

  Ogre::SceneManager& scene_;
  Ogre::ManualObject* object_;
  Ogre::MaterialPtr material_;
  Size view_;
  Ogre::uint32 corners_ = 0;
  bool has_begun_ = false;
};

}  // namespace process_visualizer::displays
