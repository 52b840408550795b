// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/PlayerState.h>
#include <ros/time.h>

#include <cstdint>
#include <optional>

namespace process_visualizer::objects {

/// The last jump in a recording that is played. A pose between one from before it and one from
/// after it is where nothing ever was, though the stamps do not jump.
class PlayedJump {
 public:
  /// Takes a state of the player. Returns whether the position has jumped since the last one.
  bool follow(const PlayerState& state);

  /// Whether something with this stamp is from before the jump, and shows another moment.
  bool isBefore(ros::Time stamp) const;

  /// Whether the poses around this stamp may be from before the jump and from after it.
  bool isJustAfter(ros::Time stamp) const;

 private:
  std::optional<std::uint32_t> segment_;
  std::optional<ros::Time> time_;  ///< of the jump, as stamps of what is played show it
};

}  // namespace process_visualizer::objects
