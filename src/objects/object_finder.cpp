// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/object_finder.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "process_visualizer/objects/support_planes.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kThinnest = 0.025F;  // m: smaller in two directions is no object
constexpr float kAround = 0.1F;      // m: so far around an object its surface is measured

/// Points for the search of planes, in the global frame. What surrounds the region tells more about
/// a surface than the little of it that a region may contain.
std::vector<Vector3f> surroundings(const Points& points, const std::vector<Label>& labels,
                                   const Isometry3f& global_from_cloud) {
  const std::size_t stride = labels.size() / SupportPlanes::kMostPoints + 1;
  std::vector<Vector3f> chosen;
  for (std::size_t index = 0; index < labels.size(); index += stride)
    if (labels[index] == Label::kFree || labels[index] == Label::kOutside ||
        labels[index] == Label::kExpected)
      chosen.push_back(global_from_cloud * points.places[index]);
  return chosen;
}

/// The free points that are on none of the planes, in the global frame.
std::vector<Vector3f> freePoints(const Points& points, const std::vector<Label>& labels,
                                 const Isometry3f& global_from_cloud, const SupportPlanes& planes) {
  std::vector<Vector3f> free;
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kFree) continue;
    const Vector3f place = global_from_cloud * points.places[index];
    if (!planes.contain(place)) free.push_back(place);
  }
  return free;
}

std::vector<Isometry3f> inGlobalFrame(const Scene& scene) {
  std::vector<Isometry3f> from_body;
  for (const Isometry3f& transform : scene.cloud_from_body)
    from_body.push_back(scene.global_from_cloud * transform);
  return from_body;
}

/// The edge of a table, seen from the side, or what noise leaves of a surface.
bool isSliver(const UprightBox& box) {
  std::array<float, 3> edges{box.size.x(), box.size.y(), box.size.z()};
  std::sort(edges.begin(), edges.end());
  return edges[1] < kThinnest;
}

/// The box, down to the surface on which it stands.
UprightBox reachingDown(const UprightBox& box, const SupportPlanes& planes,
                        const Vector3f& sensor) {
  const Vector3f middle = box.center;
  const auto surface = planes.heightBelow(middle, box.size.head<2>().norm() / 2 + kAround);
  return surface ? standing(box, *surface, planes.tolerance(middle), sensor) : box;
}

/// Something too far away for numbers of this kind is nothing that a sensor sees.
bool isInReach(const Vector3f& point) { return (point.array().abs() < 1e4F).all(); }

}  // namespace

std::vector<Label> ObjectFinder::label(const Points& points, const Scene& scene) const {
  const PosedBodies known(bodies_, scene.cloud_from_body);
  const auto labelOf = [&](const Vector3f& point) {
    if (!isInReach(point)) return Label::kNowhere;
    if (scene.region && !(*scene.region)(point)) return Label::kOutside;
    if (known.cover(point, settings_.padding)) return Label::kKnown;
    const bool is_expected = std::any_of(scene.expected.begin(), scene.expected.end(),
                                         [&](const auto& box) { return box(point); });
    return is_expected ? Label::kExpected : Label::kFree;
  };
  std::vector<Label> labels;
  labels.reserve(points.places.size());
  std::transform(points.places.begin(), points.places.end(), std::back_inserter(labels), labelOf);
  markStrayPoints(points, labels);
  return labels;
}

std::vector<FoundObject> ObjectFinder::find(const Points& points, const std::vector<Label>& labels,
                                            const Scene& scene) const {
  const Vector3f sensor = scene.global_from_cloud.translation();
  const SupportPlanes planes(surroundings(points, labels, scene.global_from_cloud), sensor,
                             settings_.surface);
  const std::vector<Vector3f> free = freePoints(points, labels, scene.global_from_cloud, planes);
  const std::vector<Isometry3f> from_body = inGlobalFrame(scene);
  std::vector<FoundObject> objects;
  for (const Cluster& cluster : clustersOf(free, settings_.gap, settings_.fewest)) {
    const UprightBox box = boxAround(cluster);
    if (!isSliver(box))
      objects.push_back({reachingDown(box, planes, sensor), cluster.size(),
                         distanceToRobots(cluster, bodies_, from_body)});
  }
  return objects;
}

}  // namespace process_visualizer::objects
