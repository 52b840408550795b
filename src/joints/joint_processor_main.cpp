// SPDX-License-Identifier: BSD-3-Clause
// The node joint_proc: joint states of one robot, in the namespace with the robot's name.
//
// Parameters: ~topic (or ~topics, a list), ~msg, ~joint_names (without them those of
// robot_description), ~joint_offsets, ~joint_rate, ~prefix (which the driver's names of joints may
// begin with, beside those names).

#include <ros/callback_queue.h>

#include <cmath>
#include <exception>
#include <stdexcept>

#include "process_visualizer/common/time_slice.hpp"
#include "process_visualizer/joints/joint_processor.hpp"

namespace {

using process_visualizer::joints::JointMatching;
using process_visualizer::joints::JointParameters;

constexpr double kRateHz = 30.0;  // what a screen shows
constexpr double kCallTimeoutS = 0.1;

[[noreturn]] void refuse(const std::string& name, const std::string& expected) {
  throw std::invalid_argument("parameter " + ros::names::resolve(name) + ": " + expected);
}

double number(const std::string& name, XmlRpc::XmlRpcValue value) {
  if (value.getType() == XmlRpc::XmlRpcValue::TypeInt) return static_cast<int>(value);
  if (value.getType() != XmlRpc::XmlRpcValue::TypeDouble) refuse(name, "a number is expected");
  return static_cast<double>(value);
}

JointParameters readParameters() {
  std::string robot_name = ros::this_node::getNamespace();
  robot_name.erase(0, robot_name.find_first_not_of('/'));
  JointParameters parameters{robot_name, {}, "", kRateHz};
  ros::param::get("~topics", parameters.topics);
  const auto topic = ros::param::param<std::string>("~topic", "");
  if (!topic.empty()) parameters.topics = {topic};
  ros::param::get("~msg", parameters.message_type);
  XmlRpc::XmlRpcValue rate;
  if (ros::param::get("~joint_rate", rate)) parameters.rate_hz = number("~joint_rate", rate);
  if (parameters.topics.empty()) refuse("~topic", "the topic of the joints is expected");
  if (!(parameters.rate_hz > 0.0) || !std::isfinite(parameters.rate_hz))
    refuse("~joint_rate", "a number above 0 is expected");
  return parameters;
}

std::vector<std::string> readJointNames() {
  std::vector<std::string> names;
  if (ros::param::get("~joint_names", names) && !names.empty()) return names;
  std::string urdf;
  if (!ros::param::get("robot_description", urdf))
    refuse("~joint_names", "the names of the robot's joints are expected, or a robot_description");
  try {
    return process_visualizer::joints::movableJoints(urdf);
  } catch (const std::invalid_argument& error) {
    refuse("robot_description", error.what());
  }
}

std::map<std::string, double> readOffsets() {
  std::map<std::string, double> offsets;
  XmlRpc::XmlRpcValue values;
  if (!ros::param::get("~joint_offsets", values)) return offsets;
  if (values.getType() != XmlRpc::XmlRpcValue::TypeStruct)
    refuse("~joint_offsets", "numbers by the names of joints are expected");
  for (auto& [name, value] : values) offsets[name] = number("~joint_offsets/" + name, value);
  return offsets;
}

/// As ros::spin(), but that calls without a pause while the master is told the farewell: with
/// real-time priority it would take the processor from the master itself.
void spinUntilShutdown() {
  while (!ros::isShuttingDown())
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kCallTimeoutS));
  ros::waitForShutdown();
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "joint_proc");
  // For roscpp's threads too, which begin with the first NodeHandle: each message wakes two of them
  // for some microseconds, one after the other, and neither must wait for those who draw.
  if (!process_visualizer::takeRealTimePriority())
    process_visualizer::takeSlices(process_visualizer::kShortSlice);
  ros::NodeHandle node;  // keeps roscpp running
  try {
    const JointParameters parameters = readParameters();
    process_visualizer::joints::JointProcessor processor(
        parameters, JointMatching(parameters.robot_name, readJointNames(), readOffsets(),
                                  ros::param::param<std::string>("~prefix", "")));
    spinUntilShutdown();
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
  return 0;
}
