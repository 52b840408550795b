// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <map>
#include <string>

#include "process_visualizer/common/complaint.hpp"

namespace process_visualizer::cloud {

/// The problems of a nodelet, by what they are about: in its log when they begin and repeatedly,
/// and on /diagnostics for as long as they last. Not for several threads at once.
class Complaints {
 public:
  /// \param name    the nodelet's
  /// \param device  to which the problems belong
  Complaints(const ros::NodeHandle& node_handle, std::string name, std::string device);

  /// Complains; to be repeated while the problem lasts.
  /// \param about  what it is about, such as a topic
  void add(const std::string& about, const std::string& text);
  void noteGood(const std::string& about);

  /// Publishes what holds, and once what does not hold any more. To be called often.
  void report();

 private:
  using Time = Complaint::Time;

  struct Entry {
    Complaint complaint;
    Time next_log;
  };

  std::string name_, device_;
  ros::NodeHandle node_handle_;
  ros::Publisher publisher_;
  std::map<std::string, Entry> entries_;
  Time next_report_;
};

}  // namespace process_visualizer::cloud
