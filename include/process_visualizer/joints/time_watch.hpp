// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace process_visualizer::joints {

/// Notices that ROS time does not advance or goes back, which simulated time can do.
class TimeWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Returns the problem of ROS time, now or some seconds ago; nothing if it advances normally.
  /// \param ros_s the present ROS time [s]
  /// \param now the present time of a clock that always advances
  std::string problem(double ros_s, Clock::time_point now);

 private:
  double last_s_ = 0.0;
  Clock::time_point advanced_;
  std::optional<Clock::time_point> stepped_back_;
  bool begun_ = false;
};

}  // namespace process_visualizer::joints
