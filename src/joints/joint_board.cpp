// SPDX-License-Identifier: BSD-3-Clause
// Thresholds for thinning, silence and conflicts of joints, and for the advance of ROS time.

#include "process_visualizer/joints/joint_board.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

namespace process_visualizer::joints {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Seconds = std::chrono::duration<double>;

constexpr milliseconds kSeldom{100};   // age at which a joint is passed on again with others
constexpr seconds kPatience{3};        // until a joint that nobody sends is reported
constexpr std::size_t kRegular = 10;   // number of messages that make a joint a regular one
constexpr int kMissedPeriods = 20;     // after which a regular joint has stopped
constexpr seconds kStopped{1};         // minimum time after which it has stopped
constexpr seconds kBeside{1};          // time within which two nodes count as sending a joint
constexpr std::size_t kConflicts = 5;  // number in a row that is no coincidence
constexpr seconds kConflictHolds{1};   // after the last conflict
constexpr double kMaxDelayS = 0.5;     // by which one node may lag behind another
constexpr double kEqual = 0.02;        // [rad or m]

void append(std::string& list, const std::string& name) {
  list += (list.empty() ? "" : ", ") + name;
}

std::string rounded(double value, int decimals) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value;
  return text.str();
}

}  // namespace

JointBoard::JointBoard(std::vector<std::string> joint_names, Clock::duration period)
    : names_(std::move(joint_names)), period_(period) {
  for (const std::string& name : names_) joints_[name];
}

void JointBoard::add(const JointPositions& joints, const std::string& source,
                     Clock::time_point now) {
  if (!begun_) first_ = now;
  begun_ = true;
  last_ = now;
  for (std::size_t i = 0; i < joints.names.size(); ++i) {
    Joint& joint = joints_[joints.names[i]];
    noteSource(joint, joints.positions[i], source, now);
    if (joint.count++ == 0) joint.first = now;
    joint.position = joints.positions[i];
    joint.last = now;
    joint.is_new = true;
  }
}

JointPositions JointBoard::due(Clock::time_point now) {
  const bool is_due = std::any_of(joints_.begin(), joints_.end(), [now](const auto& entry) {
    return entry.second.is_new && now >= entry.second.next;
  });
  return is_due ? passOn(now, false) : JointPositions{};
}

JointPositions JointBoard::rest(Clock::time_point now) {
  const bool is_any = std::any_of(joints_.begin(), joints_.end(), [](const auto& entry) {
    return entry.second.is_new || entry.second.is_unsure;
  });
  return is_any ? passOn(now, true) : JointPositions{};
}

JointPositions JointBoard::passOn(Clock::time_point now, bool is_rest) {
  JointPositions found;
  for (const std::string& name : names_) {
    Joint& joint = joints_[name];
    const bool is_news = joint.is_new || (is_rest && joint.is_unsure);
    if (joint.count == 0 || (!is_news && now - joint.last < kSeldom)) {
      joint.is_unsure |= !is_rest && joint.count > 0 && now - joint.passed < kSeldom;
      continue;
    }
    joint.passed = now;
    joint.is_unsure = false;
    found.names.push_back(name);
    found.positions.push_back(joint.position);
    if (!joint.is_new) continue;
    joint.is_new = false;
    // Makes up for a small delay, so that the rate does not depend on how often this is called.
    joint.next = now - joint.next < period_ ? joint.next + period_ : now + period_;
  }
  return found;
}

void JointBoard::noteSource(Joint& joint, double position, const std::string& source,
                            Clock::time_point now) {
  SourcePosition report{position, now, kBeside, 0.0};
  const auto before = joint.sources.find(source);
  if (before != joint.sources.end() && now > before->second.when) {
    report.step = now - before->second.when;
    report.moved = std::abs(position - before->second.position);
  }
  double apart = 0.0;
  for (auto other = joint.sources.begin(); other != joint.sources.end();) {
    if (now - other->second.when > kBeside) {
      other = joint.sources.erase(other);
      continue;
    }
    if (other->first != source) {
      const auto speed = [](const SourcePosition& it) {
        return it.moved / Seconds(it.step).count();
      };
      const double late = kMaxDelayS * std::max(speed(report), speed(other->second));
      const double difference = std::abs(position - other->second.position);
      if (difference > kEqual + late) apart = std::max(apart, difference);
    }
    ++other;
  }
  joint.sources[source] = report;
  if (joint.sources.size() > 1) joint.conflicts = apart > 0.0 ? joint.conflicts + 1 : 0;
  if (apart > 0.0) {
    joint.conflict = now;
    joint.apart = apart;
  }
}

std::vector<std::string> JointBoard::problems(Clock::time_point now) const {
  std::vector<std::string> found;
  if (!begun_) return found;
  std::string missing;
  for (const std::string& name : names_)
    if (joints_.at(name).count == 0) append(missing, name);
  if (!missing.empty() && now - first_ >= kPatience)
    found.push_back(
        "no message has the position of " + missing +
        ", so the links behind it are not drawn; name a topic that has all joints of the "
        "model");
  for (const std::string& problem : {silence(now), conflict(now)})
    if (!problem.empty()) found.push_back(problem);
  return found;
}

std::string JointBoard::silence(Clock::time_point now) const {
  std::string names;
  Clock::duration longest{};
  for (const std::string& name : names_) {
    const Joint& joint = joints_.at(name);
    if (joint.count < kRegular) continue;
    const Clock::duration period = (joint.last - joint.first) / (joint.count - 1);
    const Clock::duration silent = now - joint.last;
    // If all joints have stopped, the topic is silent, which robot_proc reports.
    if (silent < std::max<Clock::duration>(kStopped, kMissedPeriods * period) ||
        last_ - joint.last < kStopped)
      continue;
    append(names, name);
    longest = std::max(longest, silent);
  }
  if (names.empty()) return "";
  return "no position of " + names + " received for " + rounded(Seconds(longest).count(), 0) +
         " s, though others are; it is drawn where it was";
}

std::string JointBoard::conflict(Clock::time_point now) const {
  const Joint* worst = nullptr;
  std::string name;
  for (const std::string& it : names_) {
    const Joint& joint = joints_.at(it);
    if (joint.conflicts < kConflicts || now - joint.conflict > kConflictHolds) continue;
    if (worst != nullptr && worst->apart >= joint.apart) continue;
    worst = &joint;
    name = it;
  }
  if (worst == nullptr) return "";
  std::string nodes;
  for (const auto& [source, report] : worst->sources)
    append(nodes, source + " (" + rounded(report.position, 3) + ")");
  return std::to_string(worst->sources.size()) + " nodes send positions of " + name +
         " that are up to " + rounded(worst->apart, 3) + " apart: " + nodes +
         "; the robot jumps between them. Stop all but one";
}

namespace {

constexpr std::chrono::seconds kMaxStep{1};  // of a simulated clock
constexpr std::chrono::seconds kMemory{6};   // longer than the period of warnings

}  // namespace

std::string TimeWatch::problem(double ros_s, Clock::time_point now) {
  if (begun_ && ros_s < last_s_) stepped_back_ = now;
  if (!begun_ || ros_s != last_s_) advanced_ = now;
  begun_ = true;
  last_s_ = ros_s;
  if (stepped_back_ && now - *stepped_back_ < kMemory)
    return "ROS time has gone back: this computer's clock was set back, or what publishes /clock "
           "was restarted";
  if (now - advanced_ > kMaxStep)
    return "ROS time is not advancing; check the publisher of /clock, or set /use_sim_time to "
           "false";
  return {};
}

}  // namespace process_visualizer::joints
