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

/// Where a group ends in the image.
struct RimPoint {
  std::uint32_t point;   ///< of the group
  std::uint32_t beside;  ///< the point that follows it beyond the end
  bool is_cut;           ///< whether that one hides what may follow, or touches
};

/// What hides parts of groups of points, as the sensor sees them.
struct Occlusions {
  std::vector<std::vector<RimPoint>> rims;  ///< of each group
  std::vector<Bridge> bridges;
};

/// Looks along rows and columns of the cloud's image. A robot hides what is around it, too: points
/// that are as near as its padding are taken for its own.
/// \param groups  indices of points in the cloud
Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups);

}  // namespace process_visualizer::objects
