// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/stray_points.hpp"

namespace process_visualizer::objects {

/// Two groups of points between which nothing is seen but what hides what is behind it.
struct Bridge {
  std::uint32_t one, other;  ///< groups, `one` < `other`
  bool continues;            ///< whether the surfaces may be one: near, and about as far away
};

/// What hides parts of groups of points, as the sensor sees them.
struct Occlusions {
  /// For each group its points beside something nearer, behind which it may go on, or beside
  /// another group that touches it.
  std::vector<Indices> cuts;
  std::vector<Bridge> bridges;
};

/// Looks along rows and columns of the cloud's image. A robot hides what is around it, too: points
/// that are as near as its padding are taken for its own.
/// \param groups  indices of points in the cloud
Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups);

}  // namespace process_visualizer::objects
