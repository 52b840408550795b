// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/complaints.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/console.h>
#include <ros/time.h>

#include <chrono>
#include <iterator>
#include <utility>

#include "process_visualizer/common/complaint_status.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr std::chrono::seconds kLogPeriod{5};
constexpr std::chrono::milliseconds kStatusPeriod{500};

}  // namespace

Complaints::Complaints(const ros::NodeHandle& node_handle, std::string name, std::string device)
    : name_(std::move(name)), device_(std::move(device)), node_handle_(node_handle) {
  publisher_ = node_handle_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
}

void Complaints::add(const std::string& about, const std::string& text) {
  const Time now = std::chrono::steady_clock::now();
  Entry& entry = entries_[about];
  entry.complaint.add(text, now);
  if (now < entry.next_log) return;
  entry.next_log = now + kLogPeriod;
  ROS_WARN("%s: %s", device_.c_str(), text.c_str());
}

void Complaints::noteGood(const std::string& about) {
  const auto entry = entries_.find(about);
  if (entry != entries_.end()) entry->second.complaint.noteGood();
}

void Complaints::report() {
  const Time now = std::chrono::steady_clock::now();
  if (entries_.empty() || now < next_report_) return;
  next_report_ = now + kStatusPeriod;
  diagnostic_msgs::DiagnosticArray report;
  report.header.stamp = ros::Time::now();
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const Complaint& complaint = entry->second.complaint;
    report.status.push_back(statusOf(complaint, now, name_, entry->first, device_));
    entry = complaint.holds(now) ? std::next(entry) : entries_.erase(entry);
  }
  publisher_.publish(report);
}

}  // namespace process_visualizer::cloud
