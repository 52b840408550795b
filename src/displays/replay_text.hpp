// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Text in the band of a replay: how long ago the shown moment was.

#include <optional>
#include <string>

namespace process_visualizer::displays {

/// State of the player (process_visualizer/PlayerState); times in s since the epoch.
struct PlayedState {
  double stamp_s = 0;  ///< wall time for which the position holds
  double since_s = 0;  ///< wall time from which this holds; may be in the future; 0: from the stamp
  double begin_s = 0;  ///< wall time of position 0
  double duration_s = 0;
  double position_s = 0;
  double rate = 1;
  bool is_paused = false;
  double received_s = 0;  ///< by the receiver's clock
};

/// Returns the age of the played moment at a wall time, s; at least 0.
double agoAt(const PlayedState& state, double now_s);

/// The text beside the word REPLAY. It changes to another tenth of a second only when the time is
/// clearly in that: at rate 1 the time is constant, and the text would otherwise flicker between
/// two tenths.
class ReplayText {
 public:
  /// "12.3 s ago", with "paused" or a rate other than 1, or the reason why there is no time.
  std::string at(const std::optional<PlayedState>& state, double now_s);

 private:
  double shown_s_ = -1;
};

}  // namespace process_visualizer::displays
