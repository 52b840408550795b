// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// Points that lie beside each other as their sensor sees them.
using Neighbors = std::vector<Eigen::Vector3f>;

/// The points of a cloud in groups, each of some pixels. Where the range jumps there is no group:
/// it would be partly of one thing, and partly of what is behind it.
/// \param sensor  where the cloud was taken from, in its frame
std::vector<Neighbors> neighborsOf(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                                   const Eigen::Vector3f& sensor);

/// The points of surfaces that can be seen from a place: those that face it, and have no others
/// before them.
SurfaceCloud visibleFrom(const Eigen::Vector3f& place, const SurfaceCloud& points,
                         double spacing_m);

}  // namespace process_visualizer::cloud
