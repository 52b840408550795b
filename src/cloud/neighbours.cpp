// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/neighbours.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "process_visualizer/cloud/direction_grid.hpp"
#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr double kCellRad = 0.007;  ///< 4 pixels of a Kinect, 13 mm at 1.9 m
constexpr float kJump = 0.015F;     ///< of the range, in a cell; more than a Kinect's depth steps

/// A point as its sensor sees it.
struct Sight {
  std::uint64_t cell;
  float range_m;
  Eigen::Vector3f place;

  bool operator<(const Sight& other) const {
    return std::tie(cell, range_m) < std::tie(other.cell, other.range_m);
  }
};

/// Cells of directions, not of space: noise is along the ray.
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

std::vector<Neighbours> neighboursOf(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                                     const Eigen::Vector3f& sensor) {
  const std::vector<Sight> all = sights(cloud, sensor);
  std::vector<Neighbours> groups;
  for (auto begin = all.begin(); begin != all.end();) {
    Neighbours group;
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

}  // namespace process_visualizer::cloud
