// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace process_visualizer::displays {

/// State of the player (process_visualizer/PlayerState); times in s since the epoch.
struct PlayedState {
  double stamp_s = 0;  ///< wall time for which the position holds
  double since_s = 0;  ///< wall time since which this holds; may lie ahead, 0: since the stamp
  double begin_s = 0;  ///< wall time of position 0
  double duration_s = 0;
  double position_s = 0;
  double rate = 1;
  bool is_paused = false;
  double received_s = 0;  ///< by the clock of who reads this
};

/// Returns how long ago the played moment was, at a wall time, s; not below 0.
double agoAt(const PlayedState& state, double now_s);

/// The text beside the word REPLAY. It keeps a tenth of a second until the time has clearly left
/// it: at rate 1 the time stands still, and would else flicker between two tenths.
class ReplayText {
 public:
  /// "12.3 s ago", and whether that is paused or has another rate than 1, or why there is no time.
  std::string at(const std::optional<PlayedState>& state, double now_s);

 private:
  double shown_s_ = -1;
};

}  // namespace process_visualizer::displays
