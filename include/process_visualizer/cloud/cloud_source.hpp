// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <string>

namespace process_visualizer::cloud {

/// Waits for a cloud that is taken after the call; of a player that stands still, that is the one
/// that it shows.
/// \param topic  of sensor_msgs/PointCloud2
/// \throws std::runtime_error if none comes; the text says why
sensor_msgs::PointCloud2::ConstPtr nextCloud(const std::string& topic);

}  // namespace process_visualizer::cloud
