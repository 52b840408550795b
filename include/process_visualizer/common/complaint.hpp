// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Problem with a topic's messages: how long it lasts, and its status on /diagnostics.

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <chrono>
#include <cstddef>
#include <string>

namespace process_visualizer {

/// A problem with the messages of a topic. It lasts until good messages arrive and no bad one has
/// arrived for some time, as in ComplaintBook of the Python nodes.
class Complaint {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Notes a bad message.
  void add(const std::string& text, Time now);
  /// Notes a good message.
  void noteGood() { has_good_ = true; }
  bool holds(Time now) const;
  /// Starts over, when the problem is over.
  void clear() { count_ = 0; }

  const std::string& text() const { return text_; }
  std::size_t count() const { return count_; }
  Time since() const { return since_; }

 private:
  std::string text_;
  std::size_t count_ = 0;
  Time since_, last_;
  bool has_good_ = false;
};

/// Returns the status for /diagnostics: a warning while the complaint holds, otherwise "all is
/// well".
/// \param node    the name of the complaining node
/// \param about   the subject, such as a topic
/// \param device  the device to which the subject belongs
diagnostic_msgs::DiagnosticStatus statusOf(const Complaint& complaint, Complaint::Time now,
                                           const std::string& node, const std::string& about,
                                           const std::string& device);

}  // namespace process_visualizer
