// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace process_visualizer::cloud {

/// What clouds are joined to.
struct FusionParameters {
  std::vector<std::string> topics;  ///< one for each sensor
  std::string frame;                ///< of the joined cloud
  double voxel = 0;                 ///< edge of the cubes that keep one point each, m
  double timeout = 0;               ///< after which a sensor is left out, s
};

/// Reads `topics` and `frame`, `voxel` (default: 0.005) and `timeout` (default: 1).
/// \throws std::invalid_argument that names the parameter and what it must be
FusionParameters readFusionParameters(const ros::NodeHandle& node_handle);

}  // namespace process_visualizer::cloud
