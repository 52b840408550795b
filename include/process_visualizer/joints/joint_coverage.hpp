// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <set>
#include <string>
#include <vector>

namespace process_visualizer::joints {

/// Notices joints of a robot that are in no message, such as those of a gripper whose states
/// come on another topic. The links that they move cannot be drawn.
class JointCoverage {
 public:
  using Clock = std::chrono::steady_clock;

  explicit JointCoverage(const std::vector<std::string>& joint_names);

  /// Notes the joints in a message.
  void add(const std::vector<std::string>& names, Clock::time_point now);

  /// Returns the problem: joints that have been in no message since the first one, some seconds
  /// ago. Several senders may share a topic, each with a part of the joints.
  std::string problem(Clock::time_point now) const;

 private:
  std::set<std::string> missing_;
  Clock::time_point first_;
  bool begun_ = false;
};

}  // namespace process_visualizer::joints
