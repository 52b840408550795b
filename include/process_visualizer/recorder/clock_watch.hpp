#pragma once

#include <chrono>
#include <vector>

#include "ros/time.h"

namespace process_visualizer {

/// A jump of the computer's clock: the time after it, and how far it went (s).
struct ClockJump {
  ros::WallTime time;
  double seconds;
};

/// Finds jumps of the clock by comparing it with one that never jumps.
class ClockWatch {
 public:
  ClockWatch() : offset_(offset()) {}

  /// To be called about every second; notes a jump of more than 0.1 s since the last time.
  void look() {
    const double now = offset();
    if (now - offset_ > kJump || offset_ - now > kJump)
      jumps_.push_back({ros::WallTime::now(), now - offset_});
    offset_ = now;
  }
  const std::vector<ClockJump>& jumps() const { return jumps_; }

 private:
  static constexpr double kJump = 0.1;
  static double offset() {
    using Seconds = std::chrono::duration<double>;
    const auto steady = std::chrono::steady_clock::now().time_since_epoch();
    const auto system = std::chrono::system_clock::now().time_since_epoch();
    return Seconds(system).count() - Seconds(steady).count();
  }
  double offset_;
  std::vector<ClockJump> jumps_;
};

}  // namespace process_visualizer
