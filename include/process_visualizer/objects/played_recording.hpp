// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/PlayerState.h>
#include <ros/time.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace process_visualizer::objects {

/// The recording that is played, if one is: what the stamps of its clouds say.
///
/// A pose between one from before a jump and one from after it is where nothing ever was, though
/// the stamps do not jump. What is restored, after a jump and while paused, is stamped with the
/// present, though it was measured before the position at which the robots stand.
class PlayedRecording {
 public:
  /// Takes a state of the player. Returns whether the position has jumped since the last one.
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

  /// Whether something with this stamp is restored: the poses that belong to it are not on /tf.
  bool isRestored(ros::Time stamp) const {
    return std::find(restored_.begin(), restored_.end(), stamp) != restored_.end();
  }

  /// Whether the player may still tell that it is restored.
  bool isAwaited(ros::Time stamp, ros::WallTime now) const {
    if ((now - heard_).toSec() > kLost || isRestored(stamp)) return false;
    return is_paused_ || (isJustAfter(stamp) && restored_.empty());
  }

 private:
  /// In which the first joint positions after a jump come, and become poses, s.
  static constexpr double kSettling = 0.15;
  /// Stamps that are farther from a jump are those of the recording, and say nothing of it, s.
  static constexpr double kPresent = 2.0;
  /// After which a player that sent ten states a second has ended, s.
  static constexpr double kLost = 1.0;

  ros::WallTime heard_;
  bool is_paused_ = false;
  std::optional<std::uint32_t> segment_;
  std::optional<ros::Time> time_;  ///< of the jump, as stamps of what is played show it
  std::vector<ros::Time> restored_;
};

}  // namespace process_visualizer::objects
