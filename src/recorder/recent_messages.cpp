#include "process_visualizer/recorder/recent_messages.hpp"

#include <algorithm>

namespace process_visualizer {

void LatchedMessages::add(const Message& message) {
  if (message.connection->isLatching())
    newest_[{message.connection->topic, message.connection->field("callerid")}] = message;
}

std::vector<Message> LatchedMessages::at(const ros::Time& time) const {
  std::vector<Message> messages;
  for (const auto& [key, message] : newest_)
    messages.push_back({message.connection, time, message.content});
  return messages;
}

void RecentMessages::add(const Message& message) {
  if (!isKept()) return pass(message);
  messages_.push_back(message);
  bytes_ += message.size();
  while (!messages_.empty() && (bytes_ > limit_bytes_ || duration() > duration_)) {
    bytes_ -= messages_.front().size();
    pass(messages_.front());
    messages_.pop_front();
  }
}

Past RecentMessages::last(const ros::Time& now, double duration_s) const {
  const auto is_recent = [&](const Message& message) {
    return duration_s > 0 && (now - message.time).toSec() <= duration_s;
  };
  const auto begin = std::find_if(messages_.begin(), messages_.end(), is_recent);
  Past past{before_, {begin, messages_.end()}};
  std::for_each(messages_.begin(), begin,
                [&](const Message& message) { past.latched.add(message); });
  return past;
}

void RecentMessages::clear() {
  for (const Message& message : messages_) pass(message);
  messages_.clear();
  bytes_ = 0;
}

void RecentMessages::forget() {
  clear();
  before_ = {};
}

double RecentMessages::duration() const {
  return messages_.empty() ? 0.0 : (messages_.back().time - messages_.front().time).toSec();
}

}  // namespace process_visualizer
