// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>

#include <string>

#include "process_visualizer/cloud/roi_filter.hpp"

namespace process_visualizer::cloud {

/// The region of interest as it is on the parameter server.
struct RoiParameters {
  Box box;
  std::string frame;  ///< the box's frame, empty for the cloud's own
};

/// Reads `center` ([x, y, z], default zero), `size` ([x, y, z]) and `frame` (default empty), in m.
/// The values are cached and kept up to date by the master, so that this is cheap for every cloud.
/// \throws std::invalid_argument that names the parameter and what it must be
RoiParameters readRoiParameters(const ros::NodeHandle& node_handle);

}  // namespace process_visualizer::cloud
