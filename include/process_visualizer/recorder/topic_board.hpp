// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/TopicRecord.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/machine.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"

namespace process_visualizer::recorder {

/// The figures of all topics: counts of a recording, and what arrives now.
class TopicBoard {
 public:
  /// \param now from when on rates are measured
  explicit TopicBoard(SteadyTime now) : measured_(now) {}

  void begin(const std::vector<std::string>& topics);  ///< counts anew
  void freeze() { is_counting_ = false; }              ///< the counts stay as they are; rates go on
  void add(const Message& message, bool is_recorded);
  void addDropped(const std::map<std::string, std::uint64_t>& counts);

  /// Computes the rates since the last call; to be called about every second.
  void measureRates(SteadyTime now);
  double byteRate() const { return byte_rate_; }  ///< of all topics, bytes/s
  /// While counting: the topics that came regularly and have fallen silent since the last call.
  std::vector<std::string> fallenSilent(const ros::Time& now);

  /// The figures of these topics; as `messages` the count of those that arrived.
  std::vector<TopicRecord> records(const std::set<std::string>& topics, const ros::Time& now) const;
  const std::map<std::string, TopicStatistics>& statistics() const { return statistics_; }

 private:
  struct Arrival {
    std::uint64_t count = 0, counted = 0;
    double rate = 0;
    std::string type;
    bool is_latching = false;  // the publisher of the last message
    ros::Time last;
  };

  bool is_counting_ = true;
  std::map<std::string, TopicStatistics> statistics_;
  std::map<std::string, Arrival> arrivals_;
  std::uint64_t bytes_ = 0;
  double byte_rate_ = 0;
  SteadyTime measured_;
};

}  // namespace process_visualizer::recorder
