// SPDX-License-Identifier: BSD-3-Clause
// Ogre objects in front of the scene: materials, textures, and lines with a rim.

#include "overlay.hpp"

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgrePass.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace process_visualizer::displays {
namespace {

Ogre::MaterialPtr makeMaterial(const std::string& name) {
  Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().create(
      name, Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME);
  material->setReceiveShadows(false);
  material->setLightingEnabled(false);
  material->setDepthCheckEnabled(false);
  material->setDepthWriteEnabled(false);
  material->setCullingMode(Ogre::CULL_NONE);
  return material;
}

}  // namespace

FlatObject::FlatObject(Ogre::SceneManager& scene, Ogre::SceneNode& node, Ogre::uint8 queue)
    : scene_(scene), object_(scene.createManualObject()) {
  material_ = makeMaterial("process_visualizer/" + object_->getName());
  object_->setDynamic(true);
  object_->setCastShadows(false);
  object_->setUseIdentityProjection(true);
  object_->setUseIdentityView(true);
  object_->setRenderQueueGroup(queue);
  node.attachObject(object_);
}

FlatObject::~FlatObject() {
  scene_.destroyManualObject(object_);
  Ogre::MaterialManager::getSingleton().remove(material_->getHandle());
}

Ogre::Pass& FlatObject::pass() const { return *material_->getTechnique(0)->getPass(0); }

void FlatObject::begin(Size view) {
  view_ = view;
  corners_ = 0;
  if (has_begun_) {
    object_->beginUpdate(0);
  } else {
    object_->begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_LIST);
  }
  has_begun_ = true;
}

void FlatObject::addCorner(Point corner, const Ogre::ColourValue& color) {
  addPosition(corner);
  object_->colour(color);
}

void FlatObject::addCorner(Point corner, Point texture) {
  addPosition(corner);
  object_->textureCoord(texture.x, texture.y);
}

void FlatObject::addPosition(Point corner) {
  object_->position(2 * corner.x / view_.width - 1, 1 - 2 * corner.y / view_.height, 0);
  ++corners_;
}

void FlatObject::end() {
  for (Ogre::uint32 first = 0; first < corners_; first += 4)
    object_->quad(first, first + 1, first + 2, first + 3);
  object_->end();
  // Otherwise Ogre would cull it by its place in the scene.
  object_->setBoundingBox(Ogre::AxisAlignedBox(Ogre::AxisAlignedBox::EXTENT_INFINITE));
}

namespace {

constexpr int kStep = 64;  ///< sizes of textures are rounded up, so they are rarely recreated

int roundedUp(int pixels) { return (pixels + kStep - 1) / kStep * kStep; }

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
  static unsigned count = 0;
  const std::string name = "process_visualizer/plate " + std::to_string(++count);
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
  // On whole pixels, so that letters are not blurred.
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

/// Draws a leader with a dark rim, so that it is visible on every background.
void LeaderLines::addLeader(const Leader& leader, float pixel_ratio) {
  const Ogre::ColourValue color(leader.color.red, leader.color.green, leader.color.blue);
  addLine(leader.begin, leader.end, kRimWidth * pixel_ratio, kRim);
  addLine(leader.end, leader.end, kDotRimWidth * pixel_ratio, kRim);
  addLine(leader.begin, leader.end, kWidth * pixel_ratio, color);
  addLine(leader.end, leader.end, kDotWidth * pixel_ratio, color);
}

/// Draws a line with square ends; a dot if it has no length.
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
