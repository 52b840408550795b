// SPDX-License-Identifier: BSD-3-Clause
#include "plate_picture.hpp"

#include <OgreHardwarePixelBuffer.h>
#include <OgrePass.h>
#include <OgreTextureManager.h>

#include <cmath>
#include <string>

namespace process_visualizer::displays {
namespace {

constexpr int kStep = 64;  ///< textures are larger than pictures, and so are seldom made anew

int roundedUp(int pixels) { return (pixels + kStep - 1) / kStep * kStep; }

std::string nextName() {
  static unsigned count = 0;
  return "process_visualizer/plate " + std::to_string(++count);
}

}  // namespace

PlatePicture::PlatePicture(Ogre::SceneManager& scene, Ogre::SceneNode& node)
    : object_(scene, node, kPlateQueue) {
  object_.pass().setSceneBlending(Ogre::SBF_ONE, Ogre::SBF_ONE_MINUS_SOURCE_ALPHA);
  object_.pass().createTextureUnitState()->setTextureFiltering(Ogre::TFO_NONE);
}

PlatePicture::~PlatePicture() {
  if (texture_) Ogre::TextureManager::getSingleton().remove(texture_->getHandle());
}

void PlatePicture::makeTexture(const QSize& size) {
  auto& manager = Ogre::TextureManager::getSingleton();
  if (texture_) manager.remove(texture_->getHandle());
  const std::string name = nextName();
  texture_ =
      manager.createManual(name, Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME,
                           Ogre::TEX_TYPE_2D, roundedUp(size.width()), roundedUp(size.height()), 0,
                           Ogre::PF_A8R8G8B8, Ogre::TU_DYNAMIC_WRITE_ONLY);
  object_.pass().getTextureUnitState(0)->setTextureName(name);
}

void PlatePicture::setImage(const QImage& image) {
  const int width = image.width(), height = image.height();
  if (!texture_ || width > static_cast<int>(texture_->getWidth()) ||
      height > static_cast<int>(texture_->getHeight()))
    makeTexture(image.size());
  size_ = {static_cast<float>(width), static_cast<float>(height)};
  Ogre::PixelBox pixels(width, height, 1, Ogre::PF_A8R8G8B8, const_cast<uchar*>(image.constBits()));
  pixels.rowPitch = image.bytesPerLine() / 4;
  texture_->getBuffer()->blitFromMemory(pixels, Ogre::Box(0, 0, width, height));
}

void PlatePicture::draw(Point corner, Size view) {
  if (!texture_) return;
  // On whole pixels, so that no letter is blurred.
  const float left = std::round(corner.x), right = left + size_.width;
  const float top = std::round(corner.y), bottom = top + size_.height;
  const float u = size_.width / static_cast<float>(texture_->getWidth());
  const float v = size_.height / static_cast<float>(texture_->getHeight());
  object_.begin(view);
  object_.addCorner({left, top}, Point{0, 0});
  object_.addCorner({left, bottom}, Point{0, v});
  object_.addCorner({right, bottom}, Point{u, v});
  object_.addCorner({right, top}, Point{u, 0});
  object_.end();
}

}  // namespace process_visualizer::displays
