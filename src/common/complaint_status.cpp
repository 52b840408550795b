// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/common/complaint_status.hpp"

#include <chrono>

namespace process_visualizer {
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
