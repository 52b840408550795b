// SPDX-License-Identifier: BSD-3-Clause
// Labels in the picture: which are visible, the obstacles they avoid, and their leaders.

#include "label_layer.hpp"

#include <OgreCamera.h>
#include <OgreEntity.h>
#include <OgreMatrix4.h>
#include <OgreRenderTarget.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreViewport.h>
#include <rviz/display_context.h>
#include <rviz/view_manager.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "label_layout.hpp"
#include "label_plate.hpp"
#include "overlay.hpp"

namespace process_visualizer::displays {

/// A label in the picture.
struct VisibleLabel {
  const SceneLabel* label = nullptr;
  Point anchor;
  float text_height = 0;                   ///< of a line drawn in the scene, px
  float distance_m = 0;                    ///< from the camera
  std::vector<std::optional<Point>> feet;  ///< of each line's arrow
};

namespace {

/// Projection of the scene into the picture.
class ScreenProjection {
 public:
  ScreenProjection(const Ogre::Camera& camera, Size view)
      : matrix_(camera.getProjectionMatrix() * Ogre::Matrix4(camera.getViewMatrix(true))),
        up_(camera.getDerivedUp()),
        view_(view) {}

  /// The pixel of a point; nothing if it is behind the camera.
  std::optional<Point> pixel(const Ogre::Vector3& point) const {
    const Ogre::Vector4 place = matrix_ * Ogre::Vector4(point);
    if (!(place.w > 1e-6F) || place.z < -place.w) return {};
    return Point{(1 + place.x / place.w) / 2 * view_.width,
                 (1 - place.y / place.w) / 2 * view_.height};
  }

  /// Returns the height in the picture, px, of a height at a point.
  float height(const Ogre::Vector3& point, float height_m) const {
    const auto foot = pixel(point), top = pixel(point + height_m * up_);
    return foot && top ? std::hypot(top->x - foot->x, top->y - foot->y) : 0;
  }

  Size view() const { return view_; }

 private:
  Ogre::Matrix4 matrix_;
  Ogre::Vector3 up_;
  Size view_;
};

// Obstacles: parts of the picture that plates should not cover

constexpr float kModelWeight = 60;  ///< px; small, as plates are transparent and models are large
constexpr float kMinSide = 4;       ///< of an obstacle, px
constexpr float kMaxPart = 0.04F;   ///< of the picture; larger ones are not obstacles
constexpr int kMaxPieces = 5;

/// A box: a corner, and the edges from there.
struct Box {
  Ogre::Vector3 corner;
  Ogre::Vector3 edges[3];
};

Box boxOf(const Ogre::Entity& entity) {
  const Ogre::AxisAlignedBox& bounds = entity.getBoundingBox();
  const Ogre::Matrix4 place = entity._getParentNodeFullTransform();
  const Ogre::Vector3 low = bounds.getMinimum(), size = bounds.getSize();
  const Ogre::Vector3 corner = place * low;
  return {corner,
          {place * (low + Ogre::Vector3(size.x, 0, 0)) - corner,
           place * (low + Ogre::Vector3(0, size.y, 0)) - corner,
           place * (low + Ogre::Vector3(0, 0, size.z)) - corner}};
}

/// Pieces of a box along its longest edge, each about as long as wide.
std::vector<Box> pieces(Box box) {
  std::sort(box.edges, box.edges + 3, [](const Ogre::Vector3& a, const Ogre::Vector3& b) {
    return a.squaredLength() > b.squaredLength();
  });
  const float width = std::max(box.edges[1].length(), 1e-6F);
  const float ratio = std::min(box.edges[0].length() / width, static_cast<float>(kMaxPieces));
  const int count = std::max(static_cast<int>(std::lround(ratio)), 1);
  box.edges[0] /= static_cast<float>(count);
  std::vector<Box> all(count, box);
  for (int i = 1; i < count; ++i) all[i].corner = all[i - 1].corner + box.edges[0];
  return all;
}

/// Returns the rectangle around a box; nothing if a corner is behind the camera.
std::optional<Rect> rectOf(const Box& box, const ScreenProjection& projection) {
  Point low{1e9F, 1e9F}, high{-1e9F, -1e9F};
  for (int corner = 0; corner < 8; ++corner) {
    Ogre::Vector3 point = box.corner;
    for (int i = 0; i < 3; ++i)
      if ((corner >> i & 1) != 0) point += box.edges[i];
    const auto pixel = projection.pixel(point);
    if (!pixel) return {};
    low = {std::min(low.x, pixel->x), std::min(low.y, pixel->y)};
    high = {std::max(high.x, pixel->x), std::max(high.y, pixel->y)};
  }
  return Rect{low, {high.x - low.x, high.y - low.y}};
}

bool isWorthAvoiding(const Rect& rect, Size view) {
  return rect.size.width >= kMinSide && rect.size.height >= kMinSide &&
         rect.size.width * rect.size.height <= kMaxPart * view.width * view.height &&
         rect.corner.x < view.width && rect.corner.y < view.height &&
         rect.corner.x + rect.size.width > 0 && rect.corner.y + rect.size.height > 0;
}

std::vector<const Ogre::Entity*> visibleEntities(Ogre::SceneManager& scene) {
  std::vector<const Ogre::Entity*> entities;
  const auto take = [&](const Ogre::MovableObject* object) {
    const auto* entity = dynamic_cast<const Ogre::Entity*>(object);
    if (entity && entity->isInScene() && entity->isVisible() && entity->getBoundingBox().isFinite())
      entities.push_back(entity);
  };
#if OGRE_VERSION >= ((1 << 16) | (12 << 8))
  for (const auto& [name, object] : scene.getMovableObjects("Entity")) take(object);
#else
  auto all = scene.getMovableObjectIterator("Entity");
  while (all.hasMoreElements()) take(all.getNext());
#endif
  return entities;
}

/// Rectangles around the parts of models and arrows. A long part is divided along its length; parts
/// that fill much of the picture are left out, as no plate could avoid them.
std::vector<Obstacle> modelObstacles(Ogre::SceneManager& scene,
                                     const ScreenProjection& projection) {
  std::vector<Obstacle> obstacles;
  for (const Ogre::Entity* entity : visibleEntities(scene)) {
    for (const Box& piece : pieces(boxOf(*entity))) {
      const auto rect = rectOf(piece, projection);
      if (rect && isWorthAvoiding(*rect, projection.view()))
        obstacles.push_back({*rect, kModelWeight});
    }
  }
  return obstacles;
}

/// Rectangles along an arrow in the picture.
std::vector<Obstacle> arrowObstacles(Point foot, Point tip, float width, float weight) {
  const float length = std::hypot(tip.x - foot.x, tip.y - foot.y);
  const int count = std::clamp(static_cast<int>(length / width), 1, 12);
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < count; ++i) {
    const float part = (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    const Point middle{foot.x + part * (tip.x - foot.x), foot.y + part * (tip.y - foot.y)};
    const Rect rect{{middle.x - width / 2, middle.y - width / 2}, {width, width}};
    obstacles.push_back({rect, weight / static_cast<float>(count)});
  }
  return obstacles;
}

// Visible labels, and their leaders

constexpr std::size_t kMaxLabels = 60;  ///< more could not be distinguished
constexpr float kArrowWeight = 400;     ///< px
constexpr float kArrowWidth = 0.03F;    ///< m
constexpr float kBeside = 0.1F;   ///< of the view; labels this close to its rim are still shown
constexpr float kMinLeader = 10;  ///< px
constexpr float kSameFoot = 14;   ///< px
constexpr Rgb kSharedColor{0.85F, 0.87F, 0.9F};

float distance(Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y); }

bool isIn(Size view, Point point, float beside) {
  return point.x >= -beside * view.width && point.x <= (1 + beside) * view.width &&
         point.y >= -beside * view.height && point.y <= (1 + beside) * view.height;
}

std::optional<Point> firstFootIn(Size view, const VisibleLabel& visible) {
  for (const auto& foot : visible.feet)
    if (foot && isIn(view, *foot, 0)) return foot;
  return {};
}

/// Returns nothing if neither the label nor any of its arrows is in the picture.
std::optional<VisibleLabel> seen(const SceneLabel& label, const ScreenProjection& projection) {
  VisibleLabel visible{&label, {}, projection.height(label.anchor, label.height_m), 0, {}};
  for (const auto& arrow : label.arrows)
    visible.feet.push_back(arrow ? projection.pixel(arrow->foot) : std::nullopt);
  const Size view = projection.view();
  const auto foot = firstFootIn(view, visible);
  auto anchor = projection.pixel(label.anchor);
  if (label.is_always_seen) anchor = anchorOrTop(anchor, view);
  if (!foot && !(anchor && isIn(view, *anchor, kBeside))) return {};
  visible.anchor = anchor ? *anchor : *foot;
  return visible;
}

/// Adds a leader, or shares one that leads to the same place.
void addLeader(const Leader& leader, std::vector<Leader>& leaders) {
  for (Leader& other : leaders) {
    if (distance(other.end, leader.end) > kSameFoot) continue;
    other.color = kSharedColor;
    return;
  }
  leaders.push_back(leader);
}

/// The nearest labels that are in the picture, or whose arrows are, sorted by key.
std::vector<VisibleLabel> visibleLabels(const std::vector<SceneLabel>& labels,
                                        const ScreenProjection& projection,
                                        const Ogre::Vector3& camera) {
  std::vector<VisibleLabel> all;
  for (const SceneLabel& label : labels) {
    auto visible = seen(label, projection);
    if (!visible) continue;
    visible->distance_m = label.is_always_seen ? 0 : (label.anchor - camera).length();
    all.push_back(std::move(*visible));
  }
  const std::size_t count = std::min(all.size(), kMaxLabels);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end(),
                    [](const auto& a, const auto& b) {
                      return std::tie(a.distance_m, a.label->key) <
                             std::tie(b.distance_m, b.label->key);
                    });
  all.resize(count);
  std::sort(all.begin(), all.end(),
            [](const auto& a, const auto& b) { return a.label->key < b.label->key; });
  return all;
}

/// Rectangles covered by the arrows of a label.
std::vector<Obstacle> arrowObstacles(const VisibleLabel& visible,
                                     const ScreenProjection& projection) {
  std::vector<Obstacle> obstacles;
  for (std::size_t i = 0; i < visible.feet.size(); ++i) {
    const auto& arrow = visible.label->arrows[i];
    if (!visible.feet[i]) continue;
    const auto tip = projection.pixel(arrow->tip);
    const float width = projection.height(arrow->foot, kArrowWidth);
    if (!tip || width < 1) continue;
    const auto more = arrowObstacles(*visible.feet[i], *tip, width, kArrowWeight);
    obstacles.insert(obstacles.end(), more.begin(), more.end());
  }
  return obstacles;
}

/// Leaders from a label's plate to the feet of its arrows, or to its anchor if it has no arrow;
/// none if the plate is near them anyway.
std::vector<Leader> leadersOf(const VisibleLabel& visible, const Rect& plate, Size view) {
  std::vector<Leader> leaders;
  bool has_arrow = false;
  for (std::size_t i = 0; i < visible.feet.size(); ++i) {
    if (!visible.feet[i]) continue;
    has_arrow = true;
    const Point foot = *visible.feet[i];
    if (isIn(view, foot, 0))
      addLeader({nearestPoint(plate, foot), foot, visible.label->lines[i].color}, leaders);
  }
  if (!has_arrow && isIn(view, visible.anchor, 0))
    leaders.push_back({nearestPoint(plate, visible.anchor), visible.anchor, kSharedColor});
  leaders.erase(
      std::remove_if(leaders.begin(), leaders.end(),
                     [](const Leader& it) { return distance(it.begin, it.end) < kMinLeader; }),
      leaders.end());
  return leaders;
}

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
  std::vector<SceneLabel> labels;
  for (const auto& [owner, shown] : labels_)
    labels.insert(labels.end(), shown.begin(), shown.end());
  const ScreenProjection projection(camera, view);
  const auto visible = visibleLabels(labels, projection, camera.getDerivedPosition());
  forgetOthers(visible);
  const auto now = std::chrono::steady_clock::now();
  const float elapsed_s = std::chrono::duration<float>(now - last_picture_).count();
  last_picture_ = now;
  std::map<std::string, Point> anchors;
  for (const VisibleLabel& it : visible) anchors[it.label->key] = it.anchor;
  const bool from_scratch = stillness_.begins(anchors, elapsed_s);
  std::vector<LabelLayout::Plate> plates;
  std::vector<Obstacle> obstacles;
  if (!visible.empty()) obstacles = modelObstacles(scene_, projection);
  for (const VisibleLabel& it : visible) {
    paint(it, from_scratch);
    plates.push_back({it.label->key, it.anchor, plates_.at(it.label->key).size});
    const auto more = arrowObstacles(it, projection);
    obstacles.insert(obstacles.end(), more.begin(), more.end());
  }
  const std::vector<Rect> rects = layout_.place(plates, obstacles, view, elapsed_s, from_scratch);
  std::vector<Leader> leaders;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    plates_.at(visible[i].label->key).picture->draw(rects[i].corner, view);
    const auto more = leadersOf(visible[i], rects[i], view);
    leaders.insert(leaders.end(), more.begin(), more.end());
  }
  leaders_.draw(leaders, view, static_cast<float>(panel_->devicePixelRatioF()));
}

void LabelLayer::forgetOthers(const std::vector<VisibleLabel>& visible) {
  std::set<std::string> keys;
  for (const VisibleLabel& it : visible) keys.insert(it.label->key);
  for (auto it = plates_.begin(); it != plates_.end();)
    it = keys.count(it->first) > 0 ? std::next(it) : plates_.erase(it);
}

void LabelLayer::paint(const VisibleLabel& visible, bool from_scratch) {
  Plate& plate = plates_[visible.label->key];
  if (!plate.picture) plate.picture = std::make_unique<PlatePicture>(scene_, *node_);
  const int font_size =
      fontSize(visible.text_height, static_cast<float>(panel_->devicePixelRatioF()),
               from_scratch ? 0 : plate.font_size);
  if (font_size == plate.font_size && visible.label->lines == plate.lines) return;
  plate.font_size = font_size;
  plate.lines = visible.label->lines;
  const QImage image = paintPlate(plate.lines, font_size);
  plate.picture->setImage(image);
  plate.size = {static_cast<float>(image.width()), static_cast<float>(image.height())};
}

}  // namespace process_visualizer::displays
