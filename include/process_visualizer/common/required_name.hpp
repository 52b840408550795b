// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Names of topics, frames and loggers from other programs: which ones are accepted.

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace process_visualizer {

constexpr std::size_t kMaxNameCharacters = 255;  // as in nodes/common/node_handle.py

/// Returns the name of a topic, frame or logger given by another program, if it is acceptable: not
/// a megabyte long, and without control characters.
/// \throws std::invalid_argument that says what is wrong with it
inline const std::string& requiredName(const std::string& name) {
  if (name.size() > kMaxNameCharacters)
    throw std::invalid_argument("a name has " + std::to_string(name.size()) +
                                " characters; at most " + std::to_string(kMaxNameCharacters) +
                                " are allowed");
  if (std::any_of(name.begin(), name.end(), [](unsigned char it) { return std::iscntrl(it) != 0; }))
    throw std::invalid_argument("a name has control characters");
  return name;
}

}  // namespace process_visualizer
