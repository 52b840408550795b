// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <visualization_msgs/Marker.h>

#include <string>

#include "process_visualizer/cloud/box.hpp"

namespace process_visualizer::cloud {

/// The twelve edges of a box as thin lines, locked to its frame: RViz draws them where the frame
/// is.
visualization_msgs::Marker outlineOf(const Box& box, const std::string& frame);

}  // namespace process_visualizer::cloud
