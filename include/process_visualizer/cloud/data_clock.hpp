// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace process_visualizer::cloud {

/// A clock for the age of data, as the Python nodes' PlaybackClock has it: it stands while playback
/// is paused, and is slow where playback is. Without a player, or when nothing has been heard of it
/// for a second, it runs as the wall clock does.
class DataClock {
 public:
  /// Takes a state of the player.
  /// \param wall_s  wall time for which it holds, s
  /// \param speed   seconds of the recording in a second; 0 while paused, below 0 backwards
  void follow(double wall_s, double speed);

  /// \return the clock's time at a wall time, s
  double at(double wall_s) const;

 private:
  double wall_s_ = 0, data_s_ = 0, speed_ = 1;
};

}  // namespace process_visualizer::cloud
