// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Joint positions of a robot: which are passed on when, which nodes contradict each other, and
// jumps or stops of ROS time.

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "process_visualizer/joints/joint_message.hpp"

namespace process_visualizer::joints {

/// The newest position of each joint of a robot, from any number of messages and nodes, and the
/// selection of what is passed on.
///
/// Many drivers send each group of joints (left arm, right arm, torso) in a separate message. So
/// each joint is thinned separately: a group that was just passed on does not delay the next one.
class JointBoard {
 public:
  using Clock = std::chrono::steady_clock;

  /// \param joint_names the robot's joints
  /// \param period minimum time between two new positions of a joint that are passed on
  JointBoard(std::vector<std::string> joint_names, Clock::duration period);

  /// Adds positions of some joints.
  /// \param source the name of the node that published them
  void add(const JointPositions& joints, const std::string& source, Clock::time_point now);

  /// Returns the joints to pass on after a message; none while it is too early.
  ///
  /// They are the joints with new positions, and those that are sent rarely: tf knows a chain of
  /// links only up to the oldest of its joints.
  JointPositions due(Clock::time_point now);

  /// Returns the joints to pass on when no message has followed: new positions that had to wait,
  /// and joints that were passed on just before others. robot_state_publisher, which has a queue of
  /// one message, may have missed those.
  JointPositions rest(Clock::time_point now);

  /// Returns the problems with the positions, each as part of a sentence about a message: joints
  /// that were never sent, or have stopped, while others are sent; and two nodes that send
  /// different positions of a joint, one of them perhaps a forgotten joint_state_publisher.
  std::vector<std::string> problems(Clock::time_point now) const;

  /// Returns only the last of these problems; empty if no two nodes contradict each other.
  std::string conflict(Clock::time_point now) const;

 private:
  struct SourcePosition {
    double position;
    Clock::time_point when;
    Clock::duration step;  ///< since the previous one
    double moved;          ///< since the previous one [rad or m]
  };

  struct Joint {
    double position = 0.0;
    std::size_t count = 0;
    Clock::time_point first, last, next, passed;
    bool is_new = false;
    bool is_unsure = false;  ///< other joints were passed on just after it
    std::map<std::string, SourcePosition> sources;
    std::size_t conflicts = 0;  ///< in a row
    Clock::time_point conflict;
    double apart = 0.0;
  };

  JointPositions passOn(Clock::time_point now, bool is_rest);
  static void noteSource(Joint& joint, double position, const std::string& source,
                         Clock::time_point now);
  std::string silence(Clock::time_point now) const;

  std::vector<std::string> names_;
  std::map<std::string, Joint> joints_;
  Clock::duration period_;
  Clock::time_point first_, last_;
  bool begun_ = false;
};

/// Detects that ROS time does not advance or goes back, as simulated time can.
class TimeWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Returns the problem with ROS time, now or some seconds ago; empty if it advances normally.
  /// \param ros_s the current ROS time [s]
  /// \param now the current time of a clock that always advances
  std::string problem(double ros_s, Clock::time_point now);

 private:
  double last_s_ = 0.0;
  Clock::time_point advanced_;
  std::optional<Clock::time_point> stepped_back_;
  bool begun_ = false;
};

}  // namespace process_visualizer::joints
