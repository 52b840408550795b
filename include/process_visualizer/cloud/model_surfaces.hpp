// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <visualization_msgs/Marker.h>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// The surface that a marker shows, in the marker's own coordinates.
/// \throws std::invalid_argument that says why it has none, with the address of its mesh
Surface surfaceOf(const visualization_msgs::Marker& marker);

}  // namespace process_visualizer::cloud
