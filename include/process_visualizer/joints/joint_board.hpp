// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "process_visualizer/joints/joint_message.hpp"

namespace process_visualizer::joints {

/// The newest position of each joint of a robot, in however many messages and by whatever nodes
/// it is sent, and what is to be passed on of it.
///
/// Many drivers send each group of joints (left arm, right arm, torso) in a message of its own.
/// So each joint is thinned by itself: a group that was just passed on does not hold up the next.
class JointBoard {
 public:
  using Clock = std::chrono::steady_clock;

  /// \param joint_names the robot's joints
  /// \param period at most once in it a joint's news are passed on
  JointBoard(std::vector<std::string> joint_names, Clock::duration period);

  /// Takes positions of some joints.
  /// \param source the name of the node that published them
  void add(const JointPositions& joints, const std::string& source, Clock::time_point now);

  /// Returns the joints to pass on when a message has come, none while it is too early.
  ///
  /// They are those with news, and with them the ones that are sent seldom: tf knows a chain of
  /// links only up to the oldest of its joints.
  JointPositions due(Clock::time_point now);

  /// Returns what is due when no message has followed: the news that had to wait, and joints that
  /// were passed on directly before others. robot_state_publisher has a queue of one message, so it
  /// may not have seen those.
  JointPositions rest(Clock::time_point now);

  /// Returns what is wrong with what is sent, each as a part of a sentence about a message.
  ///
  /// Joints that were never sent, or that came regularly and have stopped, while others come.
  /// Two nodes that send different positions of a joint, as a forgotten joint_state_publisher
  /// does.
  std::vector<std::string> problems(Clock::time_point now) const;

  /// The last of those alone; empty if no two nodes contradict each other.
  std::string conflict(Clock::time_point now) const;

 private:
  struct Report {
    double position;
    Clock::time_point when;
    Clock::duration step;  ///< since the one before
    double moved;          ///< since the one before [rad or m]
  };

  struct Joint {
    double position = 0.0;
    std::size_t count = 0;
    Clock::time_point first, last, next, passed;
    bool is_new = false;
    bool is_unsure = false;  ///< other joints were passed on directly behind it
    std::map<std::string, Report> sources;
    std::size_t conflicts = 0;  ///< in a row
    Clock::time_point conflict;
    double apart = 0.0;
  };

  JointPositions passOn(Clock::time_point now, bool is_rest);
  static void compare(Joint& joint, double position, const std::string& source,
                      Clock::time_point now);
  std::string silence(Clock::time_point now) const;

  std::vector<std::string> names_;
  std::map<std::string, Joint> joints_;
  Clock::duration period_;
  Clock::time_point first_, last_;
  bool begun_ = false;
};

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
