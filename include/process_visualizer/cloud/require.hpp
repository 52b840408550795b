// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Argument check: throws std::invalid_argument with the problem unless a condition holds.

#include <stdexcept>
#include <string>

namespace process_visualizer::cloud {

/// \throws std::invalid_argument with the problem, unless the condition holds
inline void require(bool condition, const std::string& problem) {
  if (!condition) throw std::invalid_argument(problem);
}

}  // namespace process_visualizer::cloud
