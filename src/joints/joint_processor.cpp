// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/joint_processor.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <std_msgs/Float32MultiArray.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "process_visualizer/common/complaint_status.hpp"

namespace process_visualizer::joints {
namespace {

constexpr double kQuietPeriodS = 0.05;
constexpr std::chrono::seconds kWarningPeriod{5};
constexpr std::chrono::seconds kSharedTopic{2};
constexpr std::chrono::milliseconds kReportPeriod{500};
constexpr char kArray[] = "std_msgs/Float32MultiArray";
constexpr char kJointState[] = "sensor_msgs/JointState";

template <typename Type>
Type deserialized(const RawMessage& message) {
  Type content;
  // roscpp only reads from this stream, although it does not say so.
  auto* bytes = const_cast<std::uint8_t*>(message.bytes.data());
  ros::serialization::IStream stream(bytes, message.bytes.size());
  ros::serialization::deserialize(stream, content);
  return content;
}

/// How many elements stand before the first value: the layout's data_offset.
std::ptrdiff_t padding(const std_msgs::Float32MultiArray& array) {
  const std::size_t padding = array.layout.data_offset;
  if (padding <= array.data.size()) return static_cast<std::ptrdiff_t>(padding);
  throw std::invalid_argument("its data_offset " + std::to_string(padding) + " is behind its " +
                              std::to_string(array.data.size()) + " elements");
}

}  // namespace

JointPositions decodeJoints(const std::string& type, const RawMessage& message) {
  if (type == kArray) {
    const auto array = deserialized<std_msgs::Float32MultiArray>(message);
    return {{}, {array.data.begin() + padding(array), array.data.end()}};
  }
  if (type == kJointState) {
    auto state = deserialized<sensor_msgs::JointState>(message);
    return {std::move(state.name), std::move(state.position)};
  }
  throw std::invalid_argument("it carries " + type + ", and " + kArray + " or " + kJointState +
                              " is expected");
}

JointProcessor::JointProcessor(JointParameters parameters, JointMatching matching)
    : parameters_(std::move(parameters)),
      matching_(std::move(matching)),
      period_(std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(1.0 / parameters_.rate_hz))),
      coverage_(matching_.jointNames()) {
  publisher_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  subscribe();
  timer_ = node_.createWallTimer(ros::WallDuration(kQuietPeriodS),
                                 [this](const ros::WallTimerEvent&) { tick(); });
}

void JointProcessor::tick() {
  followChangedType();
  // Only what nothing has followed: between two messages it would be late, and the next one is not.
  if (quiet_) flush();
  quiet_ = true;
  report();
}

void JointProcessor::subscribe() {
  ros::SubscribeOptions options;
  options.topic = parameters_.topic;
  options.queue_size = 1;  // what was overtaken need not be shown
  options.md5sum = ros::message_traits::md5sum<RawMessage>();
  options.datatype = ros::message_traits::datatype<RawMessage>();
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  options.helper = boost::make_shared<ros::SubscriptionCallbackHelperT<const Event&>>(
      [this](const Event& event) { receive(event); });
  subscriber_ = node_.subscribe(options);
}

// roscpp keeps the first type that it saw, and then refuses publishers of another one.
void JointProcessor::followChangedType() {
  const bool connected = subscriber_.getNumPublishers() > 0;
  if (was_connected_ && !connected) {
    subscriber_.shutdown();
    subscribe();
  }
  was_connected_ = connected;
}

void JointProcessor::receive(const Event& event) {
  was_connected_ = true;
  try {
    JointPositions joints = matching_.match(decode(event));
    used_ = Clock::now();
    quiet_ = false;
    coverage_.add(joints.names, *used_);
    held_.emplace();
    held_->header.stamp = ros::Time::now();  // not when it is sent: it may have to wait
    held_->name = std::move(joints.names);
    held_->position = std::move(joints.positions);
    flush();
    watch();
  } catch (const ForeignJoints& error) {
    if (!used_ || Clock::now() - *used_ > kSharedTopic)
      warn(std::string("is left out: ") + error.what());
  } catch (const std::exception& error) {
    warn(std::string("is left out: ") + error.what());
  }
}

void JointProcessor::watch() {
  const auto now = Clock::now();
  bool is_good = true;
  for (const std::string& problem :
       {time_watch_.problem(ros::Time::now().toSec(), now), coverage_.problem(now)}) {
    if (problem.empty()) continue;
    warn("is shown, but " + problem);
    is_good = false;
  }
  if (is_good) complaint_.noteGood();
}

// Not ROS_WARN_THROTTLE, which says nothing while ROS time stands still.
void JointProcessor::warn(const std::string& problem) {
  const auto now = Clock::now();
  const std::string text = "a message on " + subscriber_.getTopic() + " " + problem;
  complaint_.add(text, now);
  if (now < next_warning_) return;
  next_warning_ = now + kWarningPeriod;
  ROS_WARN("%s: %s", parameters_.robot_name.c_str(), text.c_str());
}

// Says what holds, and once that it does not hold any more.
void JointProcessor::report() {
  const auto now = Clock::now();
  if (complaint_.count() == 0 || now < next_report_) return;
  next_report_ = now + kReportPeriod;
  const bool holds = complaint_.holds(now);
  diagnostic_msgs::DiagnosticArray report;
  report.header.stamp = ros::Time::now();
  report.status.push_back(statusOf(complaint_, now, ros::this_node::getName(),
                                   subscriber_.getTopic(), parameters_.robot_name));
  diagnostics_.publish(report);
  if (!holds) complaint_.clear();
}

JointPositions JointProcessor::decode(const Event& event) const {
  const std::string type = event.getConnectionHeader()["type"];
  const std::string& wanted = parameters_.message_type;
  if (!wanted.empty() && type != wanted)
    throw std::invalid_argument("it carries " + type + ", and " + wanted + " is expected");
  return decodeJoints(type, *event.getConstMessage());
}

void JointProcessor::flush() {
  if (!held_ || !isDue()) return;
  publisher_.publish(*held_);
  held_.reset();
}

bool JointProcessor::isDue() {
  const auto now = Clock::now();
  if (now < next_) return false;
  // A little late is made up for, so that the rate holds whatever the rate of asking.
  next_ = now - next_ < period_ ? next_ + period_ : now + period_;
  return true;
}

}  // namespace process_visualizer::joints
