// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace rviz {
class Display;
}

namespace process_visualizer::displays {

/// Why a display that is to show a topic shows nothing: it has not subscribed the topic, or has
/// received nothing yet. Empty if it has, if it is switched off, if it has no topic, and if RViz
/// itself warns of what it has received or of nothing. Interactive markers may have no server for
/// as long as nobody needs one. Call this and the following only in RViz's GUI thread.
std::string silence(const rviz::Display& display);

/// The name of the line in a display's status that says so.
extern const char* const kSilenceName;

/// Shows it in the status of the display, as a warning, or removes that.
void showSilence(rviz::Display& display);

}  // namespace process_visualizer::displays
