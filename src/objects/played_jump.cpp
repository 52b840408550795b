// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/played_jump.hpp"

#include <utility>

namespace process_visualizer::objects {
namespace {

/// In which the first joint positions after a jump come, and become poses, s.
constexpr double kSettling = 0.15;
/// Stamps that are farther from a jump are those of the recording, and say nothing of it, s.
constexpr double kPresent = 2.0;

}  // namespace

bool PlayedJump::follow(const PlayerState& state) {
  const auto before = std::exchange(segment_, state.segment);
  if (before == state.segment) return false;
  if (before) time_ = state.since;
  return before.has_value();
}

bool PlayedJump::isBefore(ros::Time stamp) const {
  if (!time_) return false;
  const double after = (stamp - *time_).toSec();
  return after < 0.0 && after > -kPresent;
}

bool PlayedJump::isJustAfter(ros::Time stamp) const {
  if (!time_) return false;
  const double after = (stamp - *time_).toSec();
  return after >= 0.0 && after < kSettling;
}

}  // namespace process_visualizer::objects
