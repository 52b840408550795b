// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// The newest message of each latching publisher: what a bag has to begin with.
class LatchedMessages {
 public:
  void add(const Message& message);  ///< takes it if its connection is latching
  /// The messages with other times, as close before a bag's beginning as they can be, in the order
  /// in which they came: whoever plays the bag ends with the newest.
  std::vector<Message> at(const ros::Time& time) const;
  bool isEmpty() const { return newest_.empty(); }
  /// Forgets messages of publishers that are gone, where a newer one of the topic is here. Without
  /// one, it is still what everybody shows. On /tf_static nothing is forgotten.
  void forgetReplaced(const std::function<bool(const Message&)>& is_gone);

 private:
  struct Entry {
    std::uint64_t number = 0;  ///< in the order in which they came
    Message message;
  };
  std::map<std::pair<std::string, std::string>, Entry> newest_;  ///< by topic and publisher
  std::uint64_t count_ = 0;
};

/// Possible beginning of a bag: messages, and the latched ones that held before the first of them.
struct Past {
  LatchedMessages latched;
  std::deque<Message> messages;
};

/// Selection of messages in memory.
struct MessageWish {
  std::uint64_t first = 0;  ///< the number of the first one, counted from 1
  std::set<std::string> topics;
  std::size_t largest = 0;      ///< bytes; 0: of any size
  std::size_t most_bytes = ~0;  ///< of all together
};

/// Messages in the order in which they came, and the number of the one that will come next.
struct NumberedMessages {
  std::vector<Message> messages;
  std::uint64_t next = 0;
  bool is_cut = false;  ///< there are more than was asked for
};

/// The messages of the last seconds, bounded in time and in bytes, and what is latched.
class RecentMessages {
 public:
  RecentMessages(double duration_s, std::size_t limit_bytes)
      : duration_(duration_s), limit_bytes_(limit_bytes) {}

  /// Takes a message; of one from before a simulated time begins (zero) only what is latched.
  void add(const Message& message);
  /// Takes of a message only what is latched.
  void pass(const Message& message);
  /// As LatchedMessages has it.
  void forgetReplaced(const std::function<bool(const Message&)>& is_gone);
  /// Of the messages that no recording has, the last seconds before `now`; 0: none, only what is
  /// latched.
  Past last(const ros::Time& now, double duration_s) const;
  /// The same of all messages, also of those that a recording has.
  Past all(const ros::Time& now, double duration_s) const;
  /// The messages that are wished for. From 0 on: all, and before them what is latched.
  NumberedMessages wished(const MessageWish& wish) const;
  void setRecorded();  ///< a recording has all that is in memory
  void clear();        ///< keeps what is latched
  void forget();       ///< keeps nothing

  /// How long before `now` the oldest message came that no recording has, at most as long as they
  /// are kept, s; 0 if none came within that time.
  double reach(const ros::Time& now) const;
  std::size_t bytes() const { return bytes_; }
  bool isKept() const { return duration_ > 0; }  ///< whether anything is kept at all

 private:
  Past since(std::size_t first, const LatchedMessages& before, const ros::Time& now,
             double duration_s) const;
  double age() const;  ///< of the oldest message when the newest came, s
  std::size_t unrecorded() const;

  double duration_;
  std::size_t limit_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Message> messages_;
  std::uint64_t oldest_ = 1;           ///< the number of the first one
  std::uint64_t unrecorded_ = 1;       ///< the number of the first one that no recording has
  LatchedMessages before_;             ///< what is latched, as of the first one
  LatchedMessages before_unrecorded_;  ///< and as of the first one that no recording has
};

/// Answers to requests for what is in memory. Each connection has a number, the same for all who
/// ask, so that it is described only once.
class RecentAnswers {
 public:
  /// \param read returns what is wished for of the memory
  explicit RecentAnswers(std::function<NumberedMessages(const MessageWish&)> read)
      : read_(std::move(read)) {}

  void answer(const ReadRecent::Request& request, ReadRecent::Response& response);

 private:
  std::uint32_t numberOf(const ConnectionPtr& connection);
  void describe(std::uint32_t known, ReadRecent::Response& response) const;

  const std::function<NumberedMessages(const MessageWish&)> read_;
  std::mutex mutex_;  ///< for what follows
  std::map<ConnectionPtr, std::uint32_t> numbers_;
  std::vector<ConnectionPtr> connections_;  ///< by number
};

}  // namespace process_visualizer::recorder
