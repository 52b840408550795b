// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Memory of the last seconds: limits in time and bytes, latched messages, answers to queries.

#include <process_visualizer/ReadRecent.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/recorder/message.hpp"

namespace process_visualizer::recorder {

/// The newest message of each latching publisher, with which a bag must begin.
class LatchedMessages {
 public:
  void add(const Message& message);  ///< keeps it if its connection latches
  /// The messages in order of arrival, with new times just before a bag's beginning, so that a
  /// player of the bag ends with the newest.
  std::vector<Message> at(const ros::Time& time) const;
  bool isEmpty() const { return newest_.empty(); }
  /// Forgets messages of publishers that are gone, if there is a newer one of the topic. Without a
  /// newer one, all subscribers still show it. On /tf_static nothing is forgotten.
  void forgetReplaced(const std::function<bool(const Message&)>& is_gone);

 private:
  struct Entry {
    std::uint64_t number = 0;  ///< in order of arrival
    Message message;
  };
  std::map<std::pair<std::string, std::string>, Entry> newest_;  ///< by topic and publisher
  std::uint64_t count_ = 0;
};

/// Possible beginning of a bag: messages, and the latched ones from before the first of them.
struct Past {
  LatchedMessages latched;
  std::deque<Message> messages;
};

/// Selection of messages in memory.
struct MessageQuery {
  std::uint64_t first = 0;  ///< number of the first message, from 1
  std::set<std::string> topics;
  std::size_t largest = 0;      ///< bytes; 0: of any size
  std::size_t most_bytes = ~0;  ///< in total
};

/// Messages in order of arrival, and the number of the first one after them, to ask for next.
struct NumberedMessages {
  std::vector<Message> messages;
  std::uint64_t next = 0;
  bool is_cut = false;  ///< there are more than the limit
};

/// The messages of the last seconds, bounded in time and in bytes, and the latched ones.
class RecentMessages {
 public:
  RecentMessages(double duration_s, std::size_t limit_bytes)
      : duration_(duration_s), limit_bytes_(limit_bytes) {}

  /// Adds a message; one from before simulated time begins (zero) only if it is latched.
  void add(const Message& message);
  /// Adds a message only if it is latched.
  void addIfLatched(const Message& message);
  /// As in LatchedMessages.
  void forgetReplaced(const std::function<bool(const Message&)>& is_gone);
  /// The messages of the last seconds before `now` that no recording has; 0: only the latched ones.
  Past last(const ros::Time& now, double duration_s) const;
  /// The same of all messages, including those that a recording has.
  Past all(const ros::Time& now, double duration_s) const;
  /// The requested messages. With `first` 0: all, after the latched ones.
  NumberedMessages matching(const MessageQuery& query) const;
  void setRecorded();  ///< notes that a recording has the whole memory
  void clear();        ///< keeps latched messages
  void forget();       ///< keeps nothing

  /// Age at `now` of the oldest message that no recording has, s, at most the time for which
  /// messages are kept; 0 if none came within that time.
  double ageOfOldestUnrecorded(const ros::Time& now) const;
  double age() const;  ///< of the oldest message, at the time of the newest, s
  std::size_t bytes() const { return bytes_; }
  bool isKept() const { return duration_ > 0; }  ///< true if messages are kept

 private:
  Past since(std::size_t first, const LatchedMessages& before, const ros::Time& now,
             double duration_s) const;
  std::size_t unrecorded() const;

  double duration_;
  std::size_t limit_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Message> messages_;
  std::uint64_t oldest_ = 1;           ///< number of the first message
  std::uint64_t unrecorded_ = 1;       ///< number of the first one that no recording has
  LatchedMessages before_;             ///< latched messages from before the first message
  LatchedMessages before_unrecorded_;  ///< the same for the first one that no recording has
};

/// Answers requests for messages in memory. Each connection has a number, the same for all clients,
/// so that it is described only once.
class RecentAnswers {
 public:
  /// \param read returns the requested part of the memory
  explicit RecentAnswers(std::function<NumberedMessages(const MessageQuery&)> read)
      : read_(std::move(read)) {}

  void answer(const ReadRecent::Request& request, ReadRecent::Response& response);

 private:
  std::uint32_t numberOf(const ConnectionPtr& connection);
  void describe(std::uint32_t known, ReadRecent::Response& response) const;

  const std::function<NumberedMessages(const MessageQuery&)> read_;
  std::mutex mutex_;  ///< guards the members below
  std::map<ConnectionPtr, std::uint32_t> numbers_;
  std::vector<ConnectionPtr> connections_;  ///< by number
};

}  // namespace process_visualizer::recorder
