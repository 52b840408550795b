// SPDX-License-Identifier: BSD-3-Clause
// Finds walls (RANSAC) among tall columns of points, and follows them from cloud to cloud.

#include "process_visualizer/objects/walls.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <unordered_map>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::AlignedBox2f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kCell = 0.1F;           // m: of a wall, and of the floor plan
constexpr float kMinWallHeight = 0.8F;  // m: of a wall in each column, as far as it is visible
constexpr float kMinWallWidth = 1.5F;   // m: of all its columns; a pallet is 1.2 m wide
constexpr float kMaxWallGap = 1.0F;     // m: that something in front of a wall may hide
constexpr float kMaxWallTilt = 0.17F;   // sine of 10°: from the vertical of the global frame
constexpr float kMinBaseline = 0.5F;    // m: horizontally between two points that define a plane
constexpr int kMaxWalls = 6;
constexpr int kWallTrials = 80;
constexpr std::size_t kWallSample = 600;  // points by which planes are compared
constexpr std::size_t kMinWallPoints = 100;

/// Horizontal direction along an upright plane.
Vector2f alongWall(const Eigen::Hyperplane<float, 3>& plane) {
  return Vector2f(-plane.normal().y(), plane.normal().x()).normalized();
}

/// Position of a point on a wall: along it, and its height, m.
Vector2f onWall(const Vector2f& along, const Vector3f& point) {
  return {along.dot(point.head<2>()), point.z()};
}

int wallCell(float place) { return static_cast<int>(std::floor(place / kCell)); }

/// Least-squares plane.
Eigen::Hyperplane<float, 3> fittedPlane(const std::vector<Vector3f>& points) {
  Vector3f center = Vector3f::Zero();
  for (const Vector3f& point : points) center += point / static_cast<float>(points.size());
  Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
  for (const Vector3f& point : points) spread += (point - center) * (point - center).transpose();
  return {Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(spread).eigenvectors().col(0), center};
}

}  // namespace

Walls::Walls(const std::vector<Vector3f>& points, Vector3f sensor, const DepthNoise& noise) {
  update(points, sensor, noise, true);
}

void Walls::update(const std::vector<Vector3f>& points, const Vector3f& sensor,
                   const DepthNoise& noise, bool finds_new) {
  sensor_ = sensor;
  noise_ = noise;
  const std::vector<Wall> before = std::exchange(walls_, {});
  if (before.empty() && !finds_new) return;
  std::vector<Vector3f> tall = tallPoints(points);
  for (const Wall& wall : before) {
    std::vector<Vector3f> on;
    std::copy_if(tall.begin(), tall.end(), std::back_inserter(on),
                 [&](const Vector3f& it) { return isOn(wall.plane, it); });
    if (on.size() >= kMinWallPoints) addIfWall(fittedPlane(on), kMinWallWidth / 2, tall);
  }
  while (finds_new && walls_.size() < kMaxWalls) {
    const auto plane = largest(tall);
    if (!plane || !addIfWall(*plane, kMinWallWidth, tall)) break;
  }
}

/// Adds a plane if it is a wall, and removes its points from `tall`.
bool Walls::addIfWall(const Plane& plane, float min_width, std::vector<Vector3f>& tall) {
  const auto extent = extentOf(plane, tall, min_width);
  if (!extent) return false;
  walls_.push_back({plane, alongWall(plane), *extent});
  const auto isTaken = [&](const Vector3f& it) {
    return isOn(plane, it) && extent->contains(onWall(walls_.back().along, it));
  };
  tall.erase(std::remove_if(tall.begin(), tall.end(), isTaken), tall.end());
  return true;
}

bool Walls::isOn(const Plane& plane, const Vector3f& point) const {
  const Vector3f ray = point - sensor_;
  const float range = ray.norm();
  const float slope = range > 0 ? std::abs(plane.normal().dot(ray)) / range : 1;
  return plane.absDistance(point) < noise_.toleranceAt(range, slope);
}

/// Points in columns with others at many heights.
std::vector<Vector3f> Walls::tallPoints(const std::vector<Vector3f>& points) const {
  using Heights = std::bitset<64>;  // cells over 3.2 m below the sensor, and as many above
  const auto tile = [](const Vector3f& it) {
    return (static_cast<std::int64_t>(wallCell(it.x())) << 32) + wallCell(it.y());
  };
  std::unordered_map<std::int64_t, Heights> heights;
  for (const Vector3f& point : points) {
    const int cell = wallCell(point.z() - sensor_.z()) + 32;
    if (cell >= 0 && cell < 64) heights[tile(point)].set(static_cast<std::size_t>(cell));
  }
  std::vector<Vector3f> tall;
  std::copy_if(points.begin(), points.end(), std::back_inserter(tall), [&](const Vector3f& it) {
    const auto found = heights.find(tile(it));
    return found != heights.end() &&
           static_cast<float>(found->second.count()) * kCell >= kMinWallHeight;
  });
  return tall;
}

/// Upright plane through two of the points that contains the most points (RANSAC).
std::optional<Walls::Plane> Walls::largest(const std::vector<Vector3f>& points) const {
  if (points.size() < kMinWallPoints) return std::nullopt;
  std::mt19937 random(1);  // fixed seed: the result depends on this cloud alone
  const std::size_t stride = points.size() / kWallSample + 1;
  Plane best(Vector3f::UnitX(), 0);
  std::size_t most = 0;
  for (int trial = 0; trial < kWallTrials; ++trial) {
    const Vector3f one = points[random() % points.size()];
    const Vector3f other = points[random() % points.size()];
    const Vector2f way = (other - one).head<2>();
    if (way.norm() < kMinBaseline) continue;
    const Plane plane(Vector3f(-way.y(), way.x(), 0).normalized(), one);
    std::size_t count = 0;
    for (std::size_t index = 0; index < points.size(); index += stride)
      if (isOn(plane, points[index])) ++count;
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  if (most == 0) return std::nullopt;
  for (int round = 0; round < 2; ++round) {
    std::vector<Vector3f> on;
    std::copy_if(points.begin(), points.end(), std::back_inserter(on),
                 [&](const Vector3f& it) { return isOn(best, it); });
    if (on.size() < kMinWallPoints) return std::nullopt;
    best = fittedPlane(on);
  }
  return best;
}

/// Extent of the wall in a plane: the longest row of columns that are tall enough, with gaps that
/// people in front of it may cause.
std::optional<AlignedBox2f> Walls::extentOf(const Plane& plane, const std::vector<Vector3f>& points,
                                            float min_width) const {
  if (std::abs(plane.normal().z()) > kMaxWallTilt) return std::nullopt;
  const Vector2f along = alongWall(plane);
  std::map<int, std::set<int>> columns;
  for (const Vector3f& point : points) {
    if (!isOn(plane, point)) continue;
    const Vector2f place = onWall(along, point);
    columns[wallCell(place.x())].insert(wallCell(place.y()));
  }
  AlignedBox2f best, row;
  int most = 0, count = 0, last = 0;
  for (const auto& [column, heights] : columns) {
    if (static_cast<float>(heights.size()) * kCell < kMinWallHeight) continue;
    if (static_cast<float>(column - last) * kCell > kMaxWallGap) {
      row.setEmpty();
      count = 0;
    }
    last = column;
    row.extend(kCell * Vector2f(column - 1, *heights.begin() - 1));
    row.extend(kCell * Vector2f(column + 2, *heights.rbegin() + 2));
    if (++count <= most) continue;
    most = count;
    best = row;
  }
  if (static_cast<float>(most) * kCell < min_width) return std::nullopt;
  return best;
}

std::optional<std::size_t> Walls::wallAt(const Vector3f& point) const {
  for (std::size_t number = 0; number < walls_.size(); ++number) {
    const Wall& wall = walls_[number];
    if (wall.extent.contains(onWall(wall.along, point)) && isOn(wall.plane, point)) return number;
  }
  return std::nullopt;
}

}  // namespace process_visualizer::objects
