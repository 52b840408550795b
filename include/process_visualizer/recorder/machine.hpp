// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clocks and disk of the recorder's computer, replaceable in tests; finds jumps of the clock.

#include <ros/time.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"

namespace process_visualizer::recorder {

using SteadyTime = std::chrono::steady_clock::time_point;

/// Clocks and disk of the recorder's computer; tests replace them.
struct Machine {
  std::function<ros::Time()> now = ros::Time::now;  ///< the time of messages; may be simulated
  std::function<bool()> isSimulated = ros::Time::isSimTime;  ///< true if `now` is simulated
  std::function<ros::WallTime()> wall = ros::WallTime::now;  ///< can be set, so it can jump
  std::function<SteadyTime()> steady = std::chrono::steady_clock::now;  ///< never jumps
  std::function<std::uint64_t(const BagFile&)> freeBytes = &BagFile::freeBytes;
};

/// A jump of the clock that stamps messages: the time after it (s since the epoch), and its size
/// (s).
struct ClockJump {
  double time;
  double seconds;
};

/// Finds jumps of the clock by comparing it with one that never jumps.
///
/// A simulated clock (/clock) may pause or run faster than real time, but neither go back nor
/// advance faster than any simulation can.
class ClockWatch {
 public:
  explicit ClockWatch(Machine machine) : machine_(std::move(machine)), last_(measure()) {}

  /// To be called about every second; notes a jump since the last time.
  void look() {
    const Times now = measure();
    const double passed = now.steady - last_.steady, went = now.shown - last_.shown;
    const bool is_jump = !now.is_simulated ? std::abs(went - passed) > kJump
                                           : went < 0 || went > kMaxSpeed * passed + kStep;
    if (is_jump && now.is_simulated == last_.is_simulated && last_.shown > 0)
      jumps_.push_back({now.shown, went - passed});
    last_ = now;
  }
  const std::vector<ClockJump>& jumps() const { return jumps_; }

 private:
  static constexpr double kJump = 0.1, kMaxSpeed = 20, kStep = 1;

  /// Readings of both clocks, s.
  struct Times {
    double steady, shown;  ///< shown: 0 before the first simulated time
    bool is_simulated;
  };

  Times measure() const {
    const std::chrono::duration<double> steady = machine_.steady().time_since_epoch();
    const bool is_simulated = machine_.isSimulated();
    return {steady.count(), is_simulated ? machine_.now().toSec() : machine_.wall().toSec(),
            is_simulated};
  }
  const Machine machine_;
  Times last_;
  std::vector<ClockJump> jumps_;
};

}  // namespace process_visualizer::recorder
