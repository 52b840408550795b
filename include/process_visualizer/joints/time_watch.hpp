// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace process_visualizer::joints {

/// Notices that ROS time stands still or goes back, which simulated time can do.
class TimeWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Returns what is wrong with ROS time, or was some seconds ago; nothing if it goes on.
  /// \param ros_s the present ROS time [s]
  /// \param now the present time of a clock that always goes on
  std::string problem(double ros_s, Clock::time_point now);

 private:
  double last_s_ = 0.0;
  Clock::time_point advanced_;
  std::optional<Clock::time_point> stepped_back_;
  bool begun_ = false;
};

}  // namespace process_visualizer::joints
