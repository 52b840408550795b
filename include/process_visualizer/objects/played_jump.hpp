// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/PlayerState.h>
#include <ros/time.h>

#include <cstdint>
#include <optional>
#include <utility>

namespace process_visualizer::objects {

/// The last jump in a recording that is played. A pose between one from before it and one from
/// after it is where nothing ever was, though the stamps do not jump.
class PlayedJump {
 public:
  /// Takes a state of the player. Returns whether the position has jumped since the last one.
  bool follow(const PlayerState& state) {
    const auto before = std::exchange(segment_, state.segment);
    if (before == state.segment) return false;
    if (before) time_ = state.since;
    return before.has_value();
  }

  /// Whether something with this stamp is from before the jump, and shows another moment.
  bool isBefore(ros::Time stamp) const {
    if (!time_) return false;
    const double after = (stamp - *time_).toSec();
    return after < 0.0 && after > -kPresent;
  }

  /// Whether the poses around this stamp may be from before the jump and from after it.
  bool isJustAfter(ros::Time stamp) const {
    if (!time_) return false;
    const double after = (stamp - *time_).toSec();
    return after >= 0.0 && after < kSettling;
  }

 private:
  /// In which the first joint positions after a jump come, and become poses, s.
  static constexpr double kSettling = 0.15;
  /// Stamps that are farther from a jump are those of the recording, and say nothing of it, s.
  static constexpr double kPresent = 2.0;

  std::optional<std::uint32_t> segment_;
  std::optional<ros::Time> time_;  ///< of the jump, as stamps of what is played show it
};

}  // namespace process_visualizer::objects
