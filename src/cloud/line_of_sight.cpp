// SPDX-License-Identifier: BSD-3-Clause
// Grid of directions around the sensor: neighbors share a cell, and the nearest points hide others.

#include "process_visualizer/cloud/line_of_sight.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

namespace process_visualizer::cloud {
namespace {

/// Directions from a sensor, in cells of about the same size.
class DirectionGrid {
 public:
  /// \param place  of the sensor, m
  /// \param width  of a cell, rad
  DirectionGrid(Eigen::Vector3f place, double width) : place_(std::move(place)), width_(width) {}

  /// The number of the cell in which a point appears.
  std::uint64_t cell(const Eigen::Vector3f& point) const {
    const Eigen::Vector3d ray = (point - place_).cast<double>();
    const double slope = std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
    const double azimuth = std::atan2(ray.y(), ray.x()) + M_PI;
    // Rings of equal height around z, each divided into cells about as wide as high.
    const double ring = std::floor(slope / width_);
    const double count =
        std::max(std::floor(2.0 * M_PI * std::sin((ring + 0.5) * width_) / width_), 1.0);
    const double turn = std::floor(azimuth / (2.0 * M_PI) * count);
    return static_cast<std::uint64_t>(ring) << 32U | static_cast<std::uint64_t>(turn);
  }

  /// Distance of a point, m.
  float range(const Eigen::Vector3f& point) const { return (point - place_).norm(); }

  double width() const { return width_; }  ///< of a cell, rad

 private:
  Eigen::Vector3f place_;
  double width_;
};

constexpr double kCellRad = 0.007;  ///< 4 pixels of a Kinect, 13 mm at 1.9 m
constexpr float kJump = 0.015F;     ///< relative jump in range; more than a Kinect's depth steps

/// A point from the sensor's point of view.
struct Sight {
  std::uint64_t cell;
  float range_m;
  Eigen::Vector3f place;

  bool operator<(const Sight& other) const {
    return std::tie(cell, range_m) < std::tie(other.cell, other.range_m);
  }
};

/// Points by cells of directions, not of space, because noise is along the rays.
std::vector<Sight> sights(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                          const Eigen::Vector3f& sensor) {
  const DirectionGrid grid(sensor, kCellRad);
  std::vector<Sight> found;
  for (const auto& point : cloud) {
    const Eigen::Vector3f place = placeOf(point);
    found.push_back({grid.cell(place), grid.range(place), place});
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::vector<Neighbors> neighborsOf(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                                   const Eigen::Vector3f& sensor) {
  const std::vector<Sight> all = sights(cloud, sensor);
  std::vector<Neighbors> groups;
  for (auto begin = all.begin(); begin != all.end();) {
    Neighbors group;
    bool jumps = false;
    auto it = begin;
    for (; it != all.end() && it->cell == begin->cell; ++it) {
      jumps = jumps || (it != begin && it->range_m > (1.0F + kJump) * (it - 1)->range_m);
      group.push_back(it->place);
    }
    if (!jumps) groups.push_back(std::move(group));
    begin = it;
  }
  return groups;
}

namespace {

constexpr double kSpacingsPerCell = 3.5;  ///< so that a surface has a point in nearly every cell
constexpr float kDepthPerCell = 2.0;  ///< depth of a slanting surface within a cell, in cell widths

/// The angle of a cell, rad, for its width at the farthest point.
double cellWidth(const Eigen::Vector3f& place, const SurfaceCloud& points, double spacing_m) {
  float farthest = 1e-3F;
  for (const auto& point : points) farthest = std::max(farthest, (placeOf(point) - place).norm());
  return kSpacingsPerCell * spacing_m / farthest;
}

}  // namespace

SurfaceCloud visibleFrom(const Eigen::Vector3f& place, const SurfaceCloud& points,
                         double spacing_m) {
  const DirectionGrid grid(place, cellWidth(place, points, spacing_m));
  std::unordered_map<std::uint64_t, float> nearest;
  for (const auto& point : points) {
    const Eigen::Vector3f position = placeOf(point);
    float& range = nearest.try_emplace(grid.cell(position), std::numeric_limits<float>::infinity())
                       .first->second;
    range = std::min(range, grid.range(position));
  }
  SurfaceCloud found;
  for (const auto& point : points) {
    const Eigen::Vector3f position = placeOf(point);
    if (!(normalOf(point).dot(place - position) > 0.0F)) continue;  // it faces away
    const double range = grid.range(position);
    if (range <= nearest.at(grid.cell(position)) + kDepthPerCell * grid.width() * range)
      found.push_back(point);
  }
  return found;
}

}  // namespace process_visualizer::cloud
