// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/direction_grid.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::cloud {

std::uint64_t DirectionGrid::cell(const Eigen::Vector3f& point) const {
  const Eigen::Vector3d ray = (point - place_).cast<double>();
  const double slope = std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
  const double azimuth = std::atan2(ray.y(), ray.x()) + M_PI;
  // Rings of equal height about z, each cut into equal cells that are about as wide as high.
  const double ring = std::floor(slope / width_);
  const double count =
      std::max(std::floor(2.0 * M_PI * std::sin((ring + 0.5) * width_) / width_), 1.0);
  const double turn = std::floor(azimuth / (2.0 * M_PI) * count);
  return static_cast<std::uint64_t>(ring) << 32U | static_cast<std::uint64_t>(turn);
}

}  // namespace process_visualizer::cloud
