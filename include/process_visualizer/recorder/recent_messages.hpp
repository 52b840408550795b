// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
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

/// What a bag can begin with: messages, and the latched ones that held before the first of them.
struct Past {
  LatchedMessages latched;
  std::deque<Message> messages;
};

/// The messages of the last seconds, bounded in time and in bytes, and what is latched.
class RecentMessages {
 public:
  RecentMessages(double duration_s, std::size_t limit_bytes)
      : duration_(duration_s), limit_bytes_(limit_bytes) {}

  /// Takes a message; of one from before a simulated time begins (zero) only what is latched.
  void add(const Message& message);
  /// Takes note of a message that is recorded and need not be kept.
  void pass(const Message& message) { before_.add(message); }
  /// As LatchedMessages has it.
  void forgetReplaced(const std::function<bool(const Message&)>& is_gone) {
    before_.forgetReplaced(is_gone);
  }
  /// The last seconds before `now`; 0: no messages, only what is latched.
  Past last(const ros::Time& now, double duration_s) const;
  void clear();   ///< keeps what is latched
  void forget();  ///< keeps nothing

  double duration() const;  ///< time from the oldest message to the newest, s
  std::size_t bytes() const { return bytes_; }
  bool isKept() const { return duration_ > 0; }  ///< whether anything is kept at all

 private:
  double duration_;
  std::size_t limit_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Message> messages_;
  LatchedMessages before_;  ///< as of the time of the first message
};

}  // namespace process_visualizer::recorder
