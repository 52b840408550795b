// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "process_visualizer/common/complaint.hpp"
#include "process_visualizer/common/raw_message.hpp"
#include "process_visualizer/joints/joint_board.hpp"
#include "process_visualizer/joints/joint_matching.hpp"
#include "process_visualizer/joints/joint_message.hpp"
#include "process_visualizer/joints/time_watch.hpp"

namespace process_visualizer::joints {

/// The parameters of the joint processor. Several topics have different joints of the robot, such
/// as those of its arm and of its gripper.
struct JointParameters {
  std::string robot_name;
  std::vector<std::string> topics;  ///< at least one
  std::string message_type;         ///< package/Type; empty: the type found on the topics
  double rate_hz;                   ///< maximum
};

/// Publishes a robot's joint states for robot_state_publisher, each joint at most at a rate; the
/// last position of each always.
///
/// A position is published at once or not at all while others follow, so that thinning delays
/// nothing. Drivers that send faster than a screen shows would otherwise cost each robot's state
/// publisher, and the master, which that asks at every state. A published state may have a part
/// of the joints (see JointBoard). Its stamp is the driver's if that is of this computer's clock,
/// else the time of arrival.
///
/// A message that cannot be used is left out with a throttled warning, which is on /diagnostics
/// as long as the problem lasts; without a warning if it has only joints of other robots, while
/// those of this one come on the same topic. While ROS time does not advance or goes back
/// (simulated time), the states are published nevertheless, also with a warning.
class JointProcessor {
 public:
  JointProcessor(JointParameters parameters, JointMatching matching);

 private:
  using Clock = std::chrono::steady_clock;
  using Event = ros::MessageEvent<RawMessage const>;

  struct Subscription {
    std::string topic;
    ros::Subscriber subscriber;
    bool was_connected = false;
  };

  void subscribe(Subscription& subscription);
  void tick();
  void followChangedType(Subscription& subscription);
  void receive(Subscription& subscription, const Event& event);
  StampedJoints decode(const Event& event) const;
  void publish(const JointPositions& joints);
  void watch(const std::string& topic, const std::vector<std::string>& unusable);
  void warn(const std::string& topic, const std::string& problem);
  void report();

  JointParameters parameters_;
  JointMatching matching_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  std::vector<Subscription> subscriptions_;  ///< their number stays as it is
  ros::WallTimer timer_;
  bool quiet_ = true;  ///< no message has come since the last tick
  ros::Time stamp_;    ///< of the newest message
  Clock::time_point next_warning_;
  std::optional<Clock::time_point> used_;  ///< when a message last had joints of this robot
  JointBoard board_;
  Complaint complaint_;
  std::string complained_;  ///< the topic of the last complaint
  ros::Publisher diagnostics_;
  Clock::time_point next_report_;
  TimeWatch time_watch_;
};

}  // namespace process_visualizer::joints
