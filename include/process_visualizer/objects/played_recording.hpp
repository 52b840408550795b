// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Stamps of clouds during playback: which are from before a jump, restored, or still awaited.

#include <process_visualizer/PlayerState.h>
#include <ros/time.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace process_visualizer::objects {

/// Relation of the stamps of clouds to the recording that is played, by the player's states.
///
/// After a jump, the stamps continue without a gap: a pose interpolated between one before and one
/// after it is where the frame never was. Messages that are restored, after a jump and while
/// paused, have present stamps, though they were measured before the position at which the robots
/// stand.
class PlayedRecording {
 public:
  /// Takes a state of the player. Returns whether the position has jumped since the previous one.
  bool follow(const PlayerState& state, ros::WallTime now) {
    heard_ = now;
    is_paused_ = state.paused;
    restored_.clear();
    for (const RestoredStamp& it : state.restored) restored_.push_back(it.stamp);
    const auto before = std::exchange(segment_, state.segment);
    if (before == state.segment) return false;
    if (before) time_ = state.since;
    return before.has_value();
  }

  bool isPaused() const { return is_paused_; }

  /// Returns whether a message with this stamp is from before the jump, and outdated.
  bool isBefore(ros::Time stamp) const {
    if (!time_) return false;
    const double after = (stamp - *time_).toSec();
    return after < 0.0 && after > -kPresent;
  }

  /// Returns whether poses from both before and after the jump may surround this stamp.
  bool isJustAfter(ros::Time stamp) const {
    if (!time_) return false;
    const double after = (stamp - *time_).toSec();
    return after >= 0.0 && after < kSettling;
  }

  /// Returns whether a message with this stamp is restored: the poses for it are not on /tf.
  bool isRestored(ros::Time stamp) const {
    return std::find(restored_.begin(), restored_.end(), stamp) != restored_.end();
  }

  /// Returns whether the player may still report a message with this stamp as restored.
  bool isAwaited(ros::Time stamp, ros::WallTime now) const {
    if ((now - heard_).toSec() > kLost || isRestored(stamp)) return false;
    return is_paused_ || (isJustAfter(stamp) && restored_.empty());
  }

 private:
  /// Time until the first joint positions after a jump have arrived and become poses, s.
  static constexpr double kSettling = 0.15;
  /// Maximum age of a present stamp, s. Stamps farther from a jump are those of the recording, and
  /// unrelated to it.
  static constexpr double kPresent = 2.0;
  /// Time without a state after which the player, which sends ten a second, has ended, s.
  static constexpr double kLost = 1.0;

  ros::WallTime heard_;
  bool is_paused_ = false;
  std::optional<std::uint32_t> segment_;
  std::optional<ros::Time> time_;  ///< of the jump, in the stamps of played messages
  std::vector<ros::Time> restored_;
};

}  // namespace process_visualizer::objects
