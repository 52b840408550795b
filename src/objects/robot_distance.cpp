// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/robot_distance.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kCube = 0.03F;  // m: first the means of such cubes are compared

/// The distance of a point from the sphere around a body, which is no farther than the body.
float atLeast(const KnownBody& body, const Isometry3f& from_body, const Vector3f& point) {
  return (from_body * body.samples->center() - point).norm() - body.samples->radius();
}

/// Makes the best distance shorter where a body is nearer to one of the points.
void shorten(RobotDistance& best, const Cluster& points, const KnownBody& body,
             const Isometry3f& from_body) {
  const Isometry3f to_body = from_body.inverse();
  for (const Vector3f& point : points) {
    if (atLeast(body, from_body, point) >= best.distance) continue;
    const NearestPlace nearest = body.samples->nearest(to_body * point);
    if (nearest.distance < best.distance)
      best = {body.frame, nearest.distance, point, from_body * nearest.place};
  }
}

/// The robots' links with a bound of their distance, nearest first.
std::vector<std::pair<float, std::size_t>> inOrder(const Vector3f& center,
                                                   const std::vector<KnownBody>& bodies,
                                                   const std::vector<Isometry3f>& from_body) {
  std::vector<std::pair<float, std::size_t>> order;
  for (std::size_t body = 0; body < bodies.size(); ++body)
    if (bodies[body].samples)
      order.emplace_back(atLeast(bodies[body], from_body[body], center), body);
  std::sort(order.begin(), order.end());
  return order;
}

/// The points near one, which the mean of a cube may hide.
Cluster around(const Cluster& points, const Vector3f& place) {
  Cluster near;
  for (const Vector3f& point : points)
    if ((point - place).squaredNorm() < 3 * kCube * kCube) near.push_back(point);
  return near;
}

}  // namespace

std::optional<RobotDistance> distanceToRobots(const Cluster& points,
                                              const std::vector<KnownBody>& bodies,
                                              const std::vector<Isometry3f>& from_body) {
  const Cluster means = thinned(points, kCube);
  RobotDistance best;
  best.distance = std::numeric_limits<float>::infinity();
  const auto order = inOrder(means.front(), bodies, from_body);
  for (const auto& [bound, body] : order) shorten(best, means, bodies[body], from_body[body]);
  if (best.link.empty()) return std::nullopt;
  const auto nearest = std::find_if(bodies.begin(), bodies.end(),
                                    [&](const KnownBody& body) { return body.frame == best.link; });
  shorten(best, around(points, best.on_object), *nearest, from_body[nearest - bodies.begin()]);
  return best;
}

}  // namespace process_visualizer::objects
