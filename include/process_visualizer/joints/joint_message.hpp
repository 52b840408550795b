// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "process_visualizer/joints/joint_matching.hpp"

namespace process_visualizer::joints {

/// The joints in a message, and when they were measured [ns since 1970]; 0: it does not say.
struct StampedJoints {
  JointPositions joints;
  std::uint64_t stamp_ns = 0;
};

/// Returns the joints in the bytes of a driver's message.
/// \throws std::invalid_argument the type carries no joints, or the bytes are not of that type
StampedJoints decodeJoints(const std::string& type, const std::vector<std::uint8_t>& bytes);

}  // namespace process_visualizer::joints
