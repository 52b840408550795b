// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <string>
#include <vector>

namespace rviz {
class Display;
class DisplayGroup;
}  // namespace rviz

namespace process_visualizer::displays {

/// What a display shows under "Status": level and texts, and whether it has received nothing.
/// RViz's levels ok, warning and error are numbered as those of DiagnosticStatus. Call this and the
/// following only in RViz's GUI thread.
diagnostic_msgs::DiagnosticStatus reportDisplay(const rviz::Display& display,
                                                const std::string& name);

/// Reports every display below `group`, also in groups; their names are like "Group/Display".
std::vector<diagnostic_msgs::DiagnosticStatus> reportDisplays(const rviz::DisplayGroup& group,
                                                              const std::string& prefix = "");

}  // namespace process_visualizer::displays
