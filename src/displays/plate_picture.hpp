// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreTexture.h>

#include <QImage>

#include "flat_object.hpp"

namespace process_visualizer::displays {

/// A picture in front of the scene, at its own size in pixels.
class PlatePicture {
 public:
  /// `node` is the parent of what is drawn; it has to outlive this.
  PlatePicture(Ogre::SceneManager& scene, Ogre::SceneNode& node);
  ~PlatePicture();
  PlatePicture(const PlatePicture&) = delete;
  PlatePicture& operator=(const PlatePicture&) = delete;

  /// Takes a picture as premultiplied ARGB.
  void setImage(const QImage& image);
  /// Places its upper left corner at a point of a view.
  void draw(Point corner, Size view);

 private:
  void makeTexture(const QSize& size);

  FlatObject object_;
  Ogre::TexturePtr texture_;
  Size size_;  ///< of the picture, which is a corner of the texture
};

}  // namespace process_visualizer::displays
