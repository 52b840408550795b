// SPDX-License-Identifier: BSD-3-Clause
#include "screen_projection.hpp"

#include <OgreCamera.h>
#include <OgreEntity.h>
#include <OgreSceneManager.h>

#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr float kSmallestSide = 4;     ///< of an obstacle, px
constexpr float kLargestPart = 0.04F;  ///< of the picture that an obstacle may fill
constexpr int kMostPieces = 5;

/// A box with the directions of its edges.
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

/// Pieces of a box, along its longest edge, about as long as it is wide.
std::vector<Box> pieces(Box box) {
  std::sort(box.edges, box.edges + 3, [](const Ogre::Vector3& a, const Ogre::Vector3& b) {
    return a.squaredLength() > b.squaredLength();
  });
  const float width = std::max(box.edges[1].length(), 1e-6F);
  const float ratio = std::min(box.edges[0].length() / width, static_cast<float>(kMostPieces));
  const int count = std::max(static_cast<int>(std::lround(ratio)), 1);
  box.edges[0] /= static_cast<float>(count);
  std::vector<Box> all(count, box);
  for (int i = 1; i < count; ++i) all[i].corner = all[i - 1].corner + box.edges[0];
  return all;
}

/// Nothing if a corner is behind the camera.
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
  return rect.size.width >= kSmallestSide && rect.size.height >= kSmallestSide &&
         rect.size.width * rect.size.height <= kLargestPart * view.width * view.height &&
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

}  // namespace

ScreenProjection::ScreenProjection(const Ogre::Camera& camera, Size view)
    : matrix_(camera.getProjectionMatrix() * Ogre::Matrix4(camera.getViewMatrix(true))),
      up_(camera.getDerivedUp()),
      view_(view) {}

std::optional<Point> ScreenProjection::pixel(const Ogre::Vector3& point) const {
  const Ogre::Vector4 place = matrix_ * Ogre::Vector4(point);
  if (!(place.w > 1e-6F) || place.z < -place.w) return {};
  return Point{(1 + place.x / place.w) / 2 * view_.width,
               (1 - place.y / place.w) / 2 * view_.height};
}

float ScreenProjection::height(const Ogre::Vector3& point, float height_m) const {
  const auto foot = pixel(point), top = pixel(point + height_m * up_);
  return foot && top ? std::hypot(top->x - foot->x, top->y - foot->y) : 0;
}

std::vector<Obstacle> modelObstacles(Ogre::SceneManager& scene, const ScreenProjection& projection,
                                     float weight) {
  std::vector<Obstacle> obstacles;
  for (const Ogre::Entity* entity : visibleEntities(scene)) {
    for (const Box& piece : pieces(boxOf(*entity))) {
      const auto rect = rectOf(piece, projection);
      if (rect && isWorthAvoiding(*rect, projection.view())) obstacles.push_back({*rect, weight});
    }
  }
  return obstacles;
}

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

}  // namespace process_visualizer::displays
