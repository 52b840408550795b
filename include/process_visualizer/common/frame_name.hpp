// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Removes the leading slash of frame names, which tf2 rejects.

#include <string>

namespace process_visualizer {

/// A frame's name as tf2 requires it: without the leading slash of old drivers and recordings.
inline std::string withoutLeadingSlash(const std::string& frame) {
  return frame.substr(!frame.empty() && frame.front() == '/' ? 1 : 0);
}

}  // namespace process_visualizer
