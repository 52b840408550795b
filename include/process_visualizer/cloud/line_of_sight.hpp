// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The view from a sensor's position: neighboring points, and the visible part of a surface.

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// Points that are neighbors from the sensor's point of view.
using Neighbors = std::vector<Eigen::Vector3f>;

/// The points of a cloud in groups of a few pixels. Points around a jump in range are in no group:
/// it would mix an object with what is behind it.
/// \param sensor  position of the sensor in the cloud's frame
std::vector<Neighbors> neighborsOf(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                                   const Eigen::Vector3f& sensor);

/// The points of surfaces that are visible from a position: those that face it and are not occluded
/// by others.
SurfaceCloud visibleFrom(const Eigen::Vector3f& place, const SurfaceCloud& points,
                         double spacing_m);

}  // namespace process_visualizer::cloud
