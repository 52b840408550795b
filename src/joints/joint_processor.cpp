// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/joint_processor.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "process_visualizer/common/complaint_status.hpp"

namespace process_visualizer::joints {
namespace {

// As CONFLICT_KEY of ros_names.py.
constexpr const char* kConflictKey = "several_sources";

constexpr double kQuietPeriodS = 0.05;
constexpr std::chrono::seconds kWarningPeriod{5};
constexpr std::chrono::seconds kSharedTopic{2};
constexpr std::chrono::milliseconds kReportPeriod{500};
constexpr int kQueue = 100;             // groups of joints, each of which counts
constexpr double kUsableWithinS = 1.0;  // of a stamp before its arrival, as KeptStamps

}  // namespace

JointProcessor::JointProcessor(JointParameters parameters, JointMatching matching)
    : parameters_(std::move(parameters)),
      matching_(std::move(matching)),
      board_(matching_.jointNames(),
             std::chrono::duration_cast<JointBoard::Clock::duration>(
                 std::chrono::duration<double>(1.0 / parameters_.rate_hz))) {
  publisher_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  for (const std::string& topic : parameters_.topics) subscriptions_.push_back({topic, {}});
  for (Subscription& subscription : subscriptions_) subscribe(subscription);
  timer_ = node_.createWallTimer(ros::WallDuration(kQuietPeriodS),
                                 [this](const ros::WallTimerEvent&) { tick(); });
}

void JointProcessor::tick() {
  for (Subscription& subscription : subscriptions_) followChangedType(subscription);
  // Only what nothing has followed: between two messages it would be late, and the next one is not.
  if (quiet_) publish(board_.rest(Clock::now()));
  quiet_ = true;
  report();
}

void JointProcessor::subscribe(Subscription& subscription) {
  ros::SubscribeOptions options;
  options.topic = subscription.topic;
  options.queue_size = kQueue;
  options.md5sum = ros::message_traits::md5sum<RawMessage>();
  options.datatype = ros::message_traits::datatype<RawMessage>();
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  options.helper = boost::make_shared<ros::SubscriptionCallbackHelperT<const Event&>>(
      [this, &subscription](const Event& event) { receive(subscription, event); });
  subscription.subscriber = node_.subscribe(options);
}

// roscpp keeps the first type that it saw, and then refuses publishers of another one.
void JointProcessor::followChangedType(Subscription& subscription) {
  const bool connected = subscription.subscriber.getNumPublishers() > 0;
  if (subscription.was_connected && !connected) {
    subscription.subscriber.shutdown();
    subscribe(subscription);
  }
  subscription.was_connected = connected;
}

void JointProcessor::receive(Subscription& subscription, const Event& event) {
  subscription.was_connected = true;
  const std::string& topic = subscription.topic;
  try {
    const StampedJoints message = decode(event);
    const JointPositions joints = matching_.match(message.joints);
    const auto now = Clock::now();
    used_ = now;
    quiet_ = false;
    // Not when it is sent: it may have to wait.
    const ros::Time arrival = ros::Time::now();
    const ros::Time stamp = ros::Time().fromNSec(message.stamp_ns);
    const double age_s = (arrival - stamp).toSec();
    stamp_ = age_s >= 0.0 && age_s <= kUsableWithinS ? stamp : arrival;
    board_.add(joints, event.getPublisherName(), now);
    publish(board_.due(now));
    watch(topic, joints.unusable);
  } catch (const ForeignJoints& error) {
    if (!used_ || Clock::now() - *used_ > kSharedTopic)
      warn(topic, std::string("is left out: ") + error.what());
  } catch (const std::exception& error) {
    warn(topic, std::string("is left out: ") + error.what());
  }
}

void JointProcessor::watch(const std::string& topic, const std::vector<std::string>& unusable) {
  const auto now = Clock::now();
  std::vector<std::string> problems = board_.problems(now);
  problems.push_back(time_watch_.problem(ros::Time::now().toSec(), now));
  for (const std::string& name : unusable)
    problems.push_back("the position of " + name +
                       " is NaN or infinite; that joint stays where it was");
  std::string text;
  for (const std::string& problem : problems)
    if (!problem.empty()) text += (text.empty() ? "is shown, but " : "; ") + problem;
  if (text.empty())
    complaint_.noteGood();
  else
    warn(topic, text);
}

// Not ROS_WARN_THROTTLE, which says nothing while ROS time stands still.
void JointProcessor::warn(const std::string& topic, const std::string& problem) {
  const auto now = Clock::now();
  complained_ = topic;
  const std::string text = "a message on " + topic + " " + problem;
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
  report.status.push_back(
      statusOf(complaint_, now, ros::this_node::getName(), complained_, parameters_.robot_name));
  const std::string conflict = board_.conflict(now);
  if (holds && !conflict.empty()) {
    diagnostic_msgs::KeyValue pair;
    pair.key = kConflictKey;
    pair.value = complained_ + ": " + conflict;
    report.status.back().values.push_back(pair);
  }
  diagnostics_.publish(report);
  if (!holds) complaint_.clear();
}

StampedJoints JointProcessor::decode(const Event& event) const {
  const std::string type = event.getConnectionHeader()["type"];
  const std::string& wanted = parameters_.message_type;
  if (!wanted.empty() && type != wanted)
    throw std::invalid_argument("it carries " + type + ", and " + wanted + " is expected");
  return decodeJoints(type, event.getConstMessage()->bytes);
}

void JointProcessor::publish(const JointPositions& joints) {
  if (joints.names.empty()) return;
  sensor_msgs::JointState state;
  state.header.stamp = stamp_;
  state.name = joints.names;
  state.position = joints.positions;
  publisher_.publish(state);
}

}  // namespace process_visualizer::joints
