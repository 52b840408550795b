// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/support_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <set>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;
using Plane = Eigen::Hyperplane<float, 3>;

constexpr std::size_t kMostPlanes = 4;
constexpr float kLeastUpright = 0.985F;  // z of a normal: cosine of 10°
constexpr float kTile = 0.05F;           // m: areas are counted in tiles of this size
constexpr int kFewestAround = 10;        // points that tell a surface's height
constexpr double kMostTrials = 200;
constexpr int kNoiseRounds = 4;
constexpr float kNoisiest = 0.012F;        // m at 1 m
constexpr float kFlattest = 0.2F;          // sine: flatter looks tell little
constexpr float kMedianOfNormal = 0.674F;  // of the size of what has a standard deviation of 1
constexpr std::size_t kFewestResiduals = 200;
constexpr double kMissed = 0.01;  // probability that a better plane is missed

/// The area that points cover, seen from above, m².
float areaOf(const std::vector<Vector3f>& points) {
  std::set<std::pair<int, int>> tiles;
  for (const Vector3f& point : points)
    tiles.emplace(static_cast<int>(std::floor(point.x() / kTile)),
                  static_cast<int>(std::floor(point.y() / kTile)));
  return static_cast<float>(tiles.size()) * kTile * kTile;
}

/// The plane with the least mean square of distances, its normal upwards.
Plane fitted(const std::vector<Vector3f>& points) {
  Eigen::Matrix3Xf matrix(3, points.size());
  for (std::size_t index = 0; index < points.size(); ++index)
    matrix.col(static_cast<Eigen::Index>(index)) = points[index];
  const Vector3f center = matrix.rowwise().mean();
  matrix.colwise() -= center;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(matrix * matrix.transpose());
  const Vector3f normal = solver.eigenvectors().col(0);
  return {normal.z() < 0 ? Vector3f(-normal) : normal, center};
}

/// The mean height of the points of a surface around a place, if more than a few are seen there.
std::optional<float> heightAround(const std::vector<Vector3f>& surface, const Vector3f& place,
                                  float radius) {
  float sum = 0;
  int count = 0;
  for (const Vector3f& point : surface) {
    if ((point - place).head<2>().squaredNorm() > radius * radius) continue;
    sum += point.z();
    ++count;
  }
  if (count < kFewestAround) return std::nullopt;
  return sum / static_cast<float>(count);
}

/// How many trials find a plane with a share of the points (Fischler and Bolles 1981).
double trialsFor(double share) {
  const double hit = share * share * share;
  return hit >= 1 ? 1 : std::log(kMissed) / std::log(1 - hit);
}

}  // namespace

SupportPlanes::SupportPlanes(std::vector<Vector3f> points, Vector3f sensor, float least_area,
                             std::optional<DepthNoise> noise)
    : sensor_(std::move(sensor)), least_area_(least_area), noise_(noise.value_or(DepthNoise())) {
  if (!noise) estimateNoise(points);
  while (planes_.size() < kMostPlanes && findNext(points)) {
  }
}

/// Takes the points of the largest plane out of `points`.
bool SupportPlanes::findNext(std::vector<Vector3f>& points) {
  if (areaOf(points) < least_area_) return false;
  const auto on = [this](const Plane& plane) {
    return [this, plane](const Vector3f& point) { return isOn(plane, point); };
  };
  const auto end = std::partition(points.begin(), points.end(), on(largest(points)));
  const std::vector<Vector3f> inliers(points.begin(), end);
  if (areaOf(inliers) < least_area_) return false;
  planes_.push_back(fitted(inliers));
  const auto begin_rest = std::partition(points.begin(), points.end(), on(planes_.back()));
  points_.emplace_back(points.begin(), begin_rest);
  points.erase(points.begin(), begin_rest);
  return true;
}

/// The level plane through three of the points that has most of all points (RANSAC). PCL's search
/// writes an error into the log whenever it draws three points in a line.
Plane SupportPlanes::largest(const std::vector<Vector3f>& points) const {
  std::mt19937 random(1);  // always the same: what is found depends on this cloud alone
  const auto any = [&] { return points[random() % points.size()]; };
  Plane best(Vector3f::UnitZ(), points.front());
  std::ptrdiff_t most = 0;
  double trials = kMostTrials;
  for (int trial = 0; trial < trials; ++trial) {
    const Vector3f a = any(), b = any(), c = any();
    const Vector3f normal = (b - a).cross(c - a).normalized();
    if (!(std::abs(normal.z()) > kLeastUpright)) continue;
    const Plane plane(normal.z() < 0 ? Vector3f(-normal) : normal, a);
    const auto count = std::count_if(points.begin(), points.end(),
                                     [&](const Vector3f& point) { return isOn(plane, point); });
    if (count <= most) continue;
    most = count;
    best = plane;
    trials = std::min(kMostTrials,
                      trialsFor(static_cast<double>(most) / static_cast<double>(points.size())));
  }
  return best;
}

/// The largest plane is where a noisy sensor shows it, too, only that fewer of its points are
/// within the tolerance, and it leans as the three do that made it. So it is fitted to what is near
/// it, and how far that is beside it along the line of sight tells how noisy the sensor is; then
/// again with what is as near as that. What stands on it is seldom half of the points, whose median
/// counts.
void SupportPlanes::estimateNoise(const std::vector<Vector3f>& points) {
  if (areaOf(points) < least_area_) return;
  Plane plane = largest(points);
  DepthNoise noise{kNoisiest};
  for (int round = 0; round < kNoiseRounds; ++round) {
    std::vector<Vector3f> near;
    std::copy_if(points.begin(), points.end(), std::back_inserter(near),
                 [&](const Vector3f& point) {
                   return alongRay(plane, point) < noise.reachAt((point - sensor_).norm());
                 });
    if (near.size() < kFewestResiduals) return;
    plane = fitted(near);
    std::vector<float> residuals;
    residuals.reserve(near.size());
    for (const Vector3f& point : near)
      residuals.push_back(alongRay(plane, point) / (point - sensor_).squaredNorm());
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    noise.at_one_m = std::clamp(*middle / kMedianOfNormal, DepthNoise::kKinect, kNoisiest);
  }
  noise_ = noise;
}

/// How far a point is from a plane along the line of sight, m; infinitely far at a flat look.
float SupportPlanes::alongRay(const Plane& plane, const Vector3f& point) const {
  const float slope = std::abs(plane.normal().dot((point - sensor_).normalized()));
  return slope < kFlattest ? std::numeric_limits<float>::infinity()
                           : plane.absDistance(point) / slope;
}

float SupportPlanes::tolerance(const Vector3f& point) const {
  return noise_.toleranceAt((point - sensor_).norm());
}

bool SupportPlanes::isOn(const Plane& plane, const Vector3f& point) const {
  return plane.absDistance(point) < tolerance(point);
}

bool SupportPlanes::contain(const Vector3f& point) const {
  return std::any_of(planes_.begin(), planes_.end(),
                     [&](const Plane& plane) { return isOn(plane, point); });
}

/// A plane that is seen around the place counts more than one that would be there if it went on.
std::optional<float> SupportPlanes::heightBelow(const Vector3f& place, float radius) const {
  std::optional<float> seen, continued;
  const auto raise = [&](std::optional<float>& height, float here) {
    if (here <= place.z() && (!height || here > *height)) height = here;
  };
  for (std::size_t number = 0; number < planes_.size(); ++number) {
    const Vector3f& normal = planes_[number].normal();
    raise(continued,
          -(planes_[number].offset() + normal.head<2>().dot(place.head<2>())) / normal.z());
    if (const auto around = heightAround(points_[number], place, radius)) raise(seen, *around);
  }
  return seen ? seen : continued;
}

}  // namespace process_visualizer::objects
