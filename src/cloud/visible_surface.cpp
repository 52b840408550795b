// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "process_visualizer/cloud/direction_grid.hpp"
#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr double kSpacingsPerCell = 3.5;  ///< so that a surface has a point in nearly every cell
constexpr float kDepthPerCell = 2.0;      ///< within a cell a slanting surface gets this deep

SurfaceCloud facing(const Eigen::Vector3f& place, const SurfaceCloud& points) {
  SurfaceCloud found;
  for (const auto& point : points)
    if (normalOf(point).dot(place - placeOf(point)) > 0.0F) found.push_back(point);
  return found;
}

/// The width of a cell on the farthest point, as an angle in rad.
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
  for (const auto& point : facing(place, points)) {
    const Eigen::Vector3f position = placeOf(point);
    const double range = grid.range(position);
    if (range <= nearest.at(grid.cell(position)) + kDepthPerCell * grid.width() * range)
      found.push_back(point);
  }
  return found;
}

}  // namespace process_visualizer::cloud
