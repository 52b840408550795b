// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures and leader lines drawn in front of RViz's scene.

#include <OgreManualObject.h>
#include <OgreMaterial.h>
#include <OgreTexture.h>

#include <QImage>
#include <vector>

#include "label_layout.hpp"
#include "label_plate.hpp"

namespace process_visualizer::displays {

/// Drawing order in front of the scene: plates over lines.
constexpr Ogre::uint8 kLineQueue = 97;
constexpr Ogre::uint8 kPlateQueue = 98;

/// Quadrangles in front of the scene, with colors that do not depend on light.
class FlatObject {
 public:
  /// `node` is the parent of the drawn objects; it must outlive this.
  FlatObject(Ogre::SceneManager& scene, Ogre::SceneNode& node, Ogre::uint8 queue);
  ~FlatObject();
  FlatObject(const FlatObject&) = delete;
  FlatObject& operator=(const FlatObject&) = delete;

  Ogre::Pass& pass() const;
  void setVisible(bool is_visible) { object_->setVisible(is_visible); }

  /// Starts over, for a view of this size.
  void begin(Size view);
  /// Adds a corner, px; the four corners of a quadrangle are added one after another, around it.
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

/// A picture in front of the scene, at its own size in pixels.
class PlatePicture {
 public:
  /// `node` is the parent of the drawn objects; it must outlive this.
  PlatePicture(Ogre::SceneManager& scene, Ogre::SceneNode& node);
  ~PlatePicture();
  PlatePicture(const PlatePicture&) = delete;
  PlatePicture& operator=(const PlatePicture&) = delete;

  /// Sets a picture as premultiplied ARGB.
  void setImage(const QImage& image);
  /// Places its upper left corner at a point of a view.
  void draw(Point corner, Size view);

 private:
  void makeTexture(const QSize& size);

  FlatObject object_;
  Ogre::TexturePtr texture_;
  Size size_;  ///< of the picture, which fills only a corner of the texture
};

/// A thin line from a plate to its object.
struct Leader {
  Point begin, end;  ///< px; a dot marks the end
  Rgb color;
};

/// Draws leaders in front of the scene.
class LeaderLines {
 public:
  /// `node` is the parent of the drawn objects; it must outlive this.
  LeaderLines(Ogre::SceneManager& scene, Ogre::SceneNode& node);

  /// `pixel_ratio`: pixels of the screen per pixel of the desktop
  void draw(const std::vector<Leader>& leaders, Size view, float pixel_ratio);

 private:
  void addLeader(const Leader& leader, float pixel_ratio);
  void addLine(Point begin, Point end, float width, const Ogre::ColourValue& color);

  FlatObject object_;
};

/// The point of a rectangle nearest to another point: where a leader begins.
Point nearestPoint(const Rect& rect, Point to);

}  // namespace process_visualizer::displays
