// SPDX-License-Identifier: BSD-3-Clause
#include "flat_object.hpp"

#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>

namespace process_visualizer::displays {
namespace {

Ogre::AxisAlignedBox everywhere() {
  Ogre::AxisAlignedBox box;
  box.setInfinite();
  return box;
}

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
  object_->setBoundingBox(everywhere());  // or Ogre would look for it in the scene
}

}  // namespace process_visualizer::displays
