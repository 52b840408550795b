// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QString>
#include <string>

namespace rviz {
class ViewManager;
}

namespace process_visualizer::displays {

/// RViz's present camera as it stands in a file of RViz under Views/Current: YAML with class,
/// target frame and all other properties. Call this and the following only in RViz's GUI thread.
std::string cameraText(const rviz::ViewManager& views);

/// Looks as the text says; returns why that cannot be done, else nothing.
QString adoptCamera(const std::string& text, rviz::ViewManager& views);

}  // namespace process_visualizer::displays
