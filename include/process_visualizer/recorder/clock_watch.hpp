// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <utility>
#include <vector>

#include "process_visualizer/recorder/machine.hpp"

namespace process_visualizer::recorder {

/// A jump of the computer's clock: the time after it, and how far it went (s).
struct ClockJump {
  ros::WallTime time;
  double seconds;
};

/// Finds jumps of the clock by comparing it with one that never jumps.
class ClockWatch {
 public:
  explicit ClockWatch(Machine machine) : machine_(std::move(machine)), offset_(measure()) {}

  /// To be called about every second; notes a jump of more than 0.1 s since the last time.
  void look() {
    const double now = measure();
    if (now - offset_ > kJump || offset_ - now > kJump)
      jumps_.push_back({machine_.wall(), now - offset_});
    offset_ = now;
  }
  const std::vector<ClockJump>& jumps() const { return jumps_; }

 private:
  static constexpr double kJump = 0.1;

  /// The clock's time minus that of the one that never jumps, s.
  double measure() const {
    const std::chrono::duration<double> steady = machine_.steady().time_since_epoch();
    return machine_.wall().toSec() - steady.count();
  }
  const Machine machine_;
  double offset_;
  std::vector<ClockJump> jumps_;
};

}  // namespace process_visualizer::recorder
