// SPDX-License-Identifier: BSD-3-Clause
// The node joint_proc: joint states of one robot, in the namespace with the robot's name, and their
// stamps (the driver's if usable, else arrival, minus latency).
//
// Parameters: ~topic (or ~topics, a list), ~msg, ~joint_names (default: those of
// robot_description), ~joint_offsets, ~joint_rate, ~prefix (optional prefix of the driver's joint
// names), ~latencies (a list with a value for each topic: the time from the measurement to the
// stamp, or to the arrival, in s).

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/common/complaint.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/common/raw_message.hpp"
#include "process_visualizer/common/time_slice.hpp"
#include "process_visualizer/joints/joint_board.hpp"
#include "process_visualizer/joints/joint_message.hpp"
#include "process_visualizer/joints/measuring_time.hpp"

namespace process_visualizer::joints {

/// The parameters of the joint processor. Several topics carry different joints of the robot, such
/// as those of its arm and its gripper.
struct JointParameters {
  std::string robot_name;
  std::vector<std::string> topics;  ///< at least one
  std::string message_type;         ///< package/Type; empty: the type found on the topics
  double rate_hz;                   ///< maximum
  std::vector<double> latencies;    ///< of the topics, s; empty: none
};

/// Publishes a robot's joint states for robot_state_publisher, each joint up to a maximum rate, and
/// always its last position.
///
/// While others follow, a position is published at once or not at all, so thinning adds no delay.
/// Without thinning, fast drivers would load each robot's state publisher, and the master, which it
/// queries at every state. A published state may have only some of the joints (see JointBoard). Its
/// stamp is the driver's if that is from this computer's clock, otherwise the time of arrival,
/// minus the driver's latency if known.
///
/// An unusable message is left out, with a throttled warning, which is on /diagnostics while the
/// problem lasts. There is no warning if it has only joints of other robots while those of this one
/// arrive on the same topic. States are published even when (simulated) ROS time does not advance
/// or goes back, with a warning.
class JointProcessor {
 public:
  JointProcessor(JointParameters parameters, JointMatching matching);

 private:
  using Clock = std::chrono::steady_clock;

  struct Subscription {
    std::string topic;
    ros::Duration latency;  ///< from the measurement to the stamp, or to the arrival
    ros::Subscriber subscriber;
    bool was_connected = false;
    MeasuringTime measuring_time;
  };

  void subscribe(Subscription& subscription);
  void tick();
  void followChangedType(Subscription& subscription);
  void receive(Subscription& subscription, const RawMessageEvent& event);
  StampedJoints decode(const RawMessageEvent& event) const;
  void publish(const JointPositions& joints);
  void watch(const std::string& topic, const std::vector<std::string>& unusable);
  void warn(const std::string& topic, const std::string& problem);
  void report();

  JointParameters parameters_;
  JointMatching matching_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  std::vector<Subscription> subscriptions_;  ///< fixed in number: callbacks refer to them
  ros::WallTimer timer_;
  bool quiet_ = true;  ///< no message since the last tick
  ros::Time stamp_;    ///< of the newest message
  Clock::time_point next_warning_;
  std::optional<Clock::time_point> used_;  ///< time of the last message with joints of this robot
  JointBoard board_;
  Complaint complaint_;
  std::string complained_;  ///< the topic of the last complaint
  ros::Publisher diagnostics_;
  Clock::time_point next_report_;
  TimeWatch time_watch_;
};

namespace {

// As CONFLICT_KEY in ros_names.py.
constexpr const char* kConflictKey = "several_sources";

constexpr double kQuietPeriodS = 0.05;
constexpr std::chrono::seconds kWarningPeriod{5};
constexpr std::chrono::seconds kSharedTopic{2};
constexpr std::chrono::milliseconds kReportPeriod{500};
constexpr int kQueue = 100;  // messages: each may have other joints

}  // namespace

JointProcessor::JointProcessor(JointParameters parameters, JointMatching matching)
    : parameters_(std::move(parameters)),
      matching_(std::move(matching)),
      board_(matching_.jointNames(),
             std::chrono::duration_cast<JointBoard::Clock::duration>(
                 std::chrono::duration<double>(1.0 / parameters_.rate_hz))) {
  publisher_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  for (std::size_t number = 0; number < parameters_.topics.size(); ++number) {
    const double latency = parameters_.latencies.empty() ? 0.0 : parameters_.latencies[number];
    subscriptions_.push_back({parameters_.topics[number], ros::Duration(latency), {}, false, {}});
  }
  for (Subscription& subscription : subscriptions_) subscribe(subscription);
  timer_ = node_.createWallTimer(ros::WallDuration(kQuietPeriodS),
                                 [this](const ros::WallTimerEvent&) { tick(); });
}

void JointProcessor::tick() {
  for (Subscription& subscription : subscriptions_) followChangedType(subscription);
  // Only if no message has followed: the next message brings newer positions.
  if (quiet_) publish(board_.rest(Clock::now()));
  quiet_ = true;
  report();
}

void JointProcessor::subscribe(Subscription& subscription) {
  subscription.subscriber = subscribeRaw(
      node_, subscription.topic, kQueue,
      [this, &subscription](const RawMessageEvent& event) { receive(subscription, event); });
}

// Resubscribes: roscpp keeps the first type that it saw and refuses publishers of another one.
void JointProcessor::followChangedType(Subscription& subscription) {
  const bool connected = subscription.subscriber.getNumPublishers() > 0;
  if (subscription.was_connected && !connected) {
    subscription.subscriber.shutdown();
    subscribe(subscription);
  }
  subscription.was_connected = connected;
}

void JointProcessor::receive(Subscription& subscription, const RawMessageEvent& event) {
  subscription.was_connected = true;
  const std::string& topic = subscription.topic;
  try {
    const StampedJoints message = decode(event);
    const JointPositions joints = matching_.match(message.joints);
    const auto now = Clock::now();
    used_ = now;
    quiet_ = false;
    // Takes the arrival time here; publishing may happen later.
    const auto arrival_ns = static_cast<std::int64_t>(ros::Time::now().toNSec());
    const auto stamp_ns = static_cast<std::int64_t>(message.stamp_ns);
    const std::int64_t measured_ns = subscription.measuring_time.of(stamp_ns, arrival_ns);
    stamp_ = ros::Time().fromNSec(measured_ns) - subscription.latency;
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
  problems.push_back(aboutUnusable(unusable));
  std::string text;
  for (const std::string& problem : problems)
    if (!problem.empty()) text += (text.empty() ? "is shown, but " : "; ") + problem;
  if (text.empty())
    complaint_.noteGood();
  else
    warn(topic, text);
}

// Not ROS_WARN_THROTTLE, which is silent while ROS time does not advance.
void JointProcessor::warn(const std::string& topic, const std::string& problem) {
  const auto now = Clock::now();
  complained_ = topic;
  const std::string text = "a message on " + topic + " " + problem;
  complaint_.add(text, now);
  if (now < next_warning_) return;
  next_warning_ = now + kWarningPeriod;
  ROS_WARN("%s: %s", parameters_.robot_name.c_str(), text.c_str());
}

// Reports the complaint while it holds, and its end once.
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

StampedJoints JointProcessor::decode(const RawMessageEvent& event) const {
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

namespace {

using process_visualizer::joints::JointMatching;
using process_visualizer::joints::JointParameters;

constexpr double kRateHz = 30.0;  // about as fast as a screen shows
constexpr double kMaxLatencyS = 1.0;
constexpr double kCallTimeoutS = 0.1;

[[noreturn]] void refuse(const std::string& name, const std::string& expected) {
  throw std::invalid_argument("parameter " + ros::names::resolve(name) + ": " + expected);
}

double number(const std::string& name, XmlRpc::XmlRpcValue value) {
  if (value.getType() == XmlRpc::XmlRpcValue::TypeInt) return static_cast<int>(value);
  if (value.getType() != XmlRpc::XmlRpcValue::TypeDouble) refuse(name, "a number is expected");
  return static_cast<double>(value);
}

std::vector<double> readLatencies(std::size_t topics) {
  std::vector<double> latencies;
  if (!ros::param::has("~latencies")) return latencies;
  const bool are_usable = ros::param::get("~latencies", latencies) && latencies.size() == topics &&
                          std::all_of(latencies.begin(), latencies.end(),
                                      [](double it) { return it >= 0.0 && it < kMaxLatencyS; });
  if (!are_usable) refuse("~latencies", "a number of seconds for each topic is expected, below 1");
  return latencies;
}

JointParameters readParameters() {
  std::string robot_name = ros::this_node::getNamespace();
  robot_name.erase(0, robot_name.find_first_not_of('/'));
  JointParameters parameters{robot_name, {}, "", kRateHz, {}};
  ros::param::get("~topics", parameters.topics);
  const auto topic = ros::param::param<std::string>("~topic", "");
  if (!topic.empty()) parameters.topics = {topic};
  ros::param::get("~msg", parameters.message_type);
  XmlRpc::XmlRpcValue rate;
  if (ros::param::get("~joint_rate", rate)) parameters.rate_hz = number("~joint_rate", rate);
  if (parameters.topics.empty()) refuse("~topic", "the topic of the joints is expected");
  if (!(parameters.rate_hz > 0.0) || !std::isfinite(parameters.rate_hz))
    refuse("~joint_rate", "a number above 0 is expected");
  parameters.latencies = readLatencies(parameters.topics.size());
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

/// Like ros::spin(), which loops without a pause while the node unregisters: with real-time
/// priority, that would take the processor from the master.
void spinUntilShutdown() {
  while (!ros::isShuttingDown())
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kCallTimeoutS));
  ros::waitForShutdown();
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "joint_proc");
  // Before the first NodeHandle, so that roscpp's threads inherit it: each message wakes two of
  // them for some microseconds, one after the other, and neither must wait for processes that draw.
  if (!process_visualizer::takeRealTimePriority())
    process_visualizer::setTimeSlice(process_visualizer::kShortSlice);
  ros::NodeHandle node;  // keeps roscpp running
  process_visualizer::replaceLoggerServices();
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
