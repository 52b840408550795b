// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Detected objects as messages and markers; the distances for a warning and for a stop.

#include <process_visualizer/DetectedObjects.h>
#include <visualization_msgs/MarkerArray.h>

#include <vector>

#include "process_visualizer/objects/object_tracks.hpp"

namespace process_visualizer::objects {

/// Distances from robots below which an object causes a warning, or is too near, m.
struct Limits {
  double warn, stop;
};

/// \param header  stamp of the cloud and frame of the objects
DetectedObjects messageOf(const std::vector<TrackedObject>& objects, const Limits& limits,
                          const std_msgs::Header& header);

/// Boxes with number and size, and lines to the nearest robot with the distance: yellow below the
/// distance `warn`, red below `stop`. Markers are locked to the frame, and expire if they are not
/// published again within a second. The first marker deletes those shown before.
visualization_msgs::MarkerArray markersOf(const DetectedObjects& objects);

}  // namespace process_visualizer::objects
