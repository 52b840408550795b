// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Crops a cloud of any layout to a box; all fields of the remaining points stay as they are.

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>

#include "process_visualizer/cloud/box.hpp"

namespace process_visualizer::cloud {

/// Keeps the points of a cloud that lie in a box (`InsideBox`).
///
/// The points stay in the cloud's frame and in their order, and all their fields are kept byte for
/// byte. The result has one row and no invalid points.
///
/// \param cloud           any layout with little-endian float32 fields x, y, z, in m
/// \param box_from_cloud  transforms a point of the cloud into the box's frame
/// \throws std::invalid_argument that says what is wrong with the cloud's layout
sensor_msgs::PointCloud2 cropToBox(const sensor_msgs::PointCloud2& cloud,
                                   const Eigen::Isometry3d& box_from_cloud, const Box& box);

}  // namespace process_visualizer::cloud
