// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <vector>

#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// The points of a cloud.
/// \throws std::invalid_argument that says what is wrong with the cloud's layout
Points pointsOf(const sensor_msgs::PointCloud2& cloud);

/// The points of a cloud that are free, in its frame, with all their fields.
/// \param labels  of all points of `pointsOf(cloud)`
sensor_msgs::PointCloud2 freePart(const sensor_msgs::PointCloud2& cloud,
                                  const std::vector<Label>& labels);

}  // namespace process_visualizer::objects
