// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// RViz's current camera as text, to copy it from one RViz to another.

#include <QString>
#include <string>

namespace rviz {
class ViewManager;
}

namespace process_visualizer::displays {

/// RViz's current camera as YAML, as under Views/Current in RViz's files: class, target frame and
/// all other properties. Call this and the following only in RViz's GUI thread.
std::string cameraText(const rviz::ViewManager& views);

/// Adopts a camera from such a text; returns the problem, else nothing.
QString adoptCamera(const std::string& text, rviz::ViewManager& views);

}  // namespace process_visualizer::displays
