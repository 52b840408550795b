// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Statistics of recorded topics: rates, lost messages, gaps, and when a topic has fallen silent.

#include <process_visualizer/TopicRecord.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/machine.hpp"
#include "process_visualizer/recorder/message.hpp"

namespace process_visualizer::recorder {

/// Counts the messages of a topic and detects missing ones.
///
/// Messages whose type begins with a Header carry a sequence number of their publisher: a skipped
/// number is a lost message. Without such a number, an interval of more than three times the usual
/// one (the median of the last ones) is a gap.
class TopicStatistics {
 public:
  void add(const Message& message);  ///< a message that arrived
  void addDropped(std::uint64_t count) { dropped_ += count; }
  /// Returns true once when regular messages have stopped for a second, ten times their usual
  /// interval and twice the longest of the last ones. Logs and latched topics never fall silent.
  bool fellSilent(const ros::Time& now);
  bool isSilent() const { return is_silent_; }  ///< true from falling silent until the next message

  std::uint64_t received() const { return received_; }
  std::uint64_t bytes() const { return bytes_; }      ///< of the received messages
  std::uint64_t dropped() const { return dropped_; }  ///< received, but not recorded
  std::uint64_t lost() const { return lost_; }        ///< skipped sequence numbers
  std::uint64_t gaps() const { return gaps_; }
  double largestGap() const { return largest_gap_; }              ///< longest interval, s
  ros::Time largestGapTime() const { return largest_gap_time_; }  ///< its beginning
  double usualInterval() const;  ///< median of the last ones, s; 0 if not yet known

 private:
  struct Publisher {
    bool has_header = false;
    std::optional<std::uint32_t> sequence;
  };
  bool takeSequence(const Message& message);
  void takeInterval(double interval, bool may_be_gap);
  static constexpr std::size_t kIntervals = 31;
  std::array<double, kIntervals> intervals_{};
  std::size_t interval_count_ = 0;
  std::map<ConnectionPtr, Publisher> publishers_;
  std::uint64_t received_ = 0, bytes_ = 0, dropped_ = 0, lost_ = 0, gaps_ = 0;
  double largest_gap_ = 0;
  bool is_silent_ = false, is_on_change_ = false;
  ros::Time largest_gap_time_, last_time_;
};

/// Returns whether the type with this definition begins with a std_msgs/Header.
bool beginsWithHeader(const std::string& definition);

/// The figures of all topics: counts of a recording, and current rates.
class TopicBoard {
 public:
  /// \param now time from which rates are measured
  explicit TopicBoard(SteadyTime now) : looked_(now), measured_(now) {}

  void begin(const std::vector<std::string>& topics);  ///< restarts the counts
  void freeze() { is_counting_ = false; }              ///< stops the counts; rates continue
  void add(const Message& message, bool is_recorded);
  void addDropped(const std::map<std::string, std::uint64_t>& counts);

  /// Computes the rates since the last call; to be called about every second. A late call changes
  /// nothing, as messages of that time may still be waiting; the next call covers both periods.
  void measureRates(SteadyTime now);
  double byteRate() const { return byte_rate_; }  ///< of all topics, bytes/s
  /// While counting: the regular topics that have fallen silent since the last call.
  std::vector<std::string> fallenSilent(const ros::Time& now);
  bool hasSilent() const;  ///< true while one of them is silent

  /// The figures of these topics; `messages` is the number received.
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
  SteadyTime looked_, measured_;
  bool is_late_ = false;
};

/// Returns the account of a recording at its end, as JSON: received and dropped messages by topic,
/// and jumps of the clock.
/// \param unwritten number of messages that were received and could not be written, by topic
std::string accountText(const std::map<std::string, TopicStatistics>& statistics,
                        const std::vector<ClockJump>& jumps,
                        const std::map<std::string, std::uint64_t>& unwritten);

}  // namespace process_visualizer::recorder
