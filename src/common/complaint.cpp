// SPDX-License-Identifier: BSD-3-Clause
// Duration of a complaint after the last bad message, and its diagnostic status.

#include "process_visualizer/common/complaint.hpp"

#include <chrono>

namespace process_visualizer {
namespace {

constexpr std::chrono::seconds kHold{3};  // so that it does not flicker

}  // namespace

void Complaint::add(const std::string& text, Time now) {
  if (count_ == 0) since_ = now;
  text_ = text;
  last_ = now;
  has_good_ = false;
  ++count_;
}

bool Complaint::holds(Time now) const { return count_ > 0 && !(has_good_ && now - last_ > kHold); }

namespace {

using diagnostic_msgs::DiagnosticStatus;

diagnostic_msgs::KeyValue keyValue(const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue pair;
  pair.key = key;
  pair.value = value;
  return pair;
}

}  // namespace

DiagnosticStatus statusOf(const Complaint& complaint, Complaint::Time now, const std::string& node,
                          const std::string& about, const std::string& device) {
  DiagnosticStatus status;
  status.name = node + ": " + about;
  status.hardware_id = device;
  const bool holds = complaint.holds(now);
  status.level = holds ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  status.message = holds ? complaint.text() : "all is well";
  if (!holds) return status;
  const std::chrono::duration<double> duration = now - complaint.since();
  status.values = {keyValue("messages", std::to_string(complaint.count())),
                   keyValue("for_s", std::to_string(duration.count()))};
  return status;
}

}  // namespace process_visualizer
