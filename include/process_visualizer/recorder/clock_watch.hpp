// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <functional>
#include <utility>
#include <vector>

#include "ros/time.h"

namespace process_visualizer::recorder {

/// A jump of the computer's clock: the time after it, and how far it went (s).
struct ClockJump {
  ros::WallTime time;
  double seconds;
};

/// Finds jumps of the clock by comparing it with one that never jumps.
class ClockWatch {
 public:
  /// \param offset returns the clock's time minus that of one that never jumps, s
  explicit ClockWatch(std::function<double()> offset = systemOffset)
      : measure_(std::move(offset)), offset_(measure_()) {}

  /// To be called about every second; notes a jump of more than 0.1 s since the last time.
  void look() {
    const double now = measure_();
    if (now - offset_ > kJump || offset_ - now > kJump)
      jumps_.push_back({ros::WallTime::now(), now - offset_});
    offset_ = now;
  }
  const std::vector<ClockJump>& jumps() const { return jumps_; }

 private:
  static constexpr double kJump = 0.1;
  static double systemOffset() {
    using Seconds = std::chrono::duration<double>;
    const auto steady = std::chrono::steady_clock::now().time_since_epoch();
    const auto system = std::chrono::system_clock::now().time_since_epoch();
    return Seconds(system).count() - Seconds(steady).count();
  }
  std::function<double()> measure_;
  double offset_;
  std::vector<ClockJump> jumps_;
};

}  // namespace process_visualizer::recorder
