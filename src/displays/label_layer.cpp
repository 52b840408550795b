// SPDX-License-Identifier: BSD-3-Clause
#include "label_layer.hpp"

#include <OgreCamera.h>
#include <OgreRenderTarget.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreViewport.h>
#include <rviz/display_context.h>
#include <rviz/view_manager.h>

#include <set>

namespace process_visualizer::displays {
namespace {

constexpr float kModelWeight = 60;  ///< px: plates are transparent, models are large

}  // namespace

std::shared_ptr<LabelLayer> LabelLayer::of(rviz::DisplayContext& context) {
  static std::map<rviz::DisplayContext*, std::weak_ptr<LabelLayer>> layers;
  std::weak_ptr<LabelLayer>& known = layers[&context];
  std::shared_ptr<LabelLayer> layer = known.lock();
  if (!layer) known = layer = std::make_shared<LabelLayer>(context);
  return layer;
}

LabelLayer::LabelLayer(rviz::DisplayContext& context)
    : scene_(*context.getSceneManager()),
      node_(scene_.getRootSceneNode()->createChildSceneNode()),
      panel_(context.getViewManager()->getRenderPanel()),
      leaders_(scene_, *node_) {
  node_->setVisible(false);
  panel_->getViewport()->getTarget()->addListener(this);
}

LabelLayer::~LabelLayer() {
  if (panel_) panel_->getViewport()->getTarget()->removeListener(this);
}

void LabelLayer::show(int owner, const std::vector<SceneLabel>& labels) {
  std::vector<SceneLabel>& shown = labels_[owner];
  shown = labels;
  for (SceneLabel& label : shown) label.key = std::to_string(owner) + '\n' + label.key;
}

bool LabelLayer::isOurs(const Ogre::RenderTargetViewportEvent& event) const {
  return panel_ && event.source == panel_->getViewport() && event.source->getCamera();
}

void LabelLayer::preViewportUpdate(const Ogre::RenderTargetViewportEvent& event) {
  if (!isOurs(event)) return;
  const Size view{static_cast<float>(event.source->getActualWidth()),
                  static_cast<float>(event.source->getActualHeight())};
  node_->setVisible(true);
  if (view.width >= 1 && view.height >= 1) draw(*event.source->getCamera(), view);
}

void LabelLayer::postViewportUpdate(const Ogre::RenderTargetViewportEvent& event) {
  if (isOurs(event)) node_->setVisible(false);
}

void LabelLayer::draw(const Ogre::Camera& camera, Size view) {
  const std::vector<SceneLabel> labels = allLabels();
  const ScreenProjection projection(camera, view);
  const auto visible = visibleLabels(labels, projection, camera.getDerivedPosition());
  forgetOthers(visible);
  const float elapsed_s = secondsSinceLastPicture();
  std::map<std::string, Point> anchors;
  for (const VisibleLabel& it : visible) anchors[it.label->key] = it.anchor;
  const bool anew = stillness_.begins(anchors, elapsed_s);
  for (const VisibleLabel& it : visible) paint(it, anew);
  const auto plates = layoutPlates(visible);
  const std::vector<Rect> rects =
      layout_.place(plates, obstacles(visible, projection), view, elapsed_s, anew);
  std::vector<Leader> leaders;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    plates_.at(visible[i].label->key).picture->draw(rects[i].corner, view);
    const auto more = leadersOf(visible[i], rects[i], view);
    leaders.insert(leaders.end(), more.begin(), more.end());
  }
  leaders_.draw(leaders, view, static_cast<float>(panel_->devicePixelRatioF()));
}

std::vector<SceneLabel> LabelLayer::allLabels() const {
  std::vector<SceneLabel> all;
  for (const auto& [owner, labels] : labels_) all.insert(all.end(), labels.begin(), labels.end());
  return all;
}

void LabelLayer::forgetOthers(const std::vector<VisibleLabel>& visible) {
  std::set<std::string> keys;
  for (const VisibleLabel& it : visible) keys.insert(it.label->key);
  for (auto it = plates_.begin(); it != plates_.end();)
    it = keys.count(it->first) > 0 ? std::next(it) : plates_.erase(it);
}

void LabelLayer::paint(const VisibleLabel& visible, bool anew) {
  Plate& plate = plates_[visible.label->key];
  if (!plate.picture) plate.picture = std::make_unique<PlatePicture>(scene_, *node_);
  const int font_size =
      fontSize(visible.text_height, static_cast<float>(panel_->devicePixelRatioF()),
               anew ? 0 : plate.font_size);
  if (font_size == plate.font_size && visible.label->lines == plate.lines) return;
  plate.font_size = font_size;
  plate.lines = visible.label->lines;
  const QImage image = paintPlate(plate.lines, font_size);
  plate.picture->setImage(image);
  plate.size = {static_cast<float>(image.width()), static_cast<float>(image.height())};
}

std::vector<LabelLayout::Plate> LabelLayer::layoutPlates(
    const std::vector<VisibleLabel>& visible) const {
  std::vector<LabelLayout::Plate> plates;
  plates.reserve(visible.size());
  for (const VisibleLabel& it : visible)
    plates.push_back({it.label->key, it.anchor, plates_.at(it.label->key).size});
  return plates;
}

std::vector<Obstacle> LabelLayer::obstacles(const std::vector<VisibleLabel>& visible,
                                            const ScreenProjection& projection) const {
  std::vector<Obstacle> all;
  if (!visible.empty()) all = modelObstacles(scene_, projection, kModelWeight);
  for (const VisibleLabel& it : visible) {
    const auto more = arrowObstacles(it, projection);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

float LabelLayer::secondsSinceLastPicture() {
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<float> elapsed = now - last_picture_;
  last_picture_ = now;
  return elapsed.count();
}

}  // namespace process_visualizer::displays
