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
  if (!isKept()) return;
  messages_.push_back(message);
  bytes_ += message.size();
  while (bytes_ > limit_bytes_ || (message.time - messages_.front().time).toSec() > duration_) {
    bytes_ -= messages_.front().size();
    messages_.pop_front();
    if (messages_.empty()) return;
  }
}

std::deque<Message> RecentMessages::last(const ros::Time& now, double duration_s) const {
  const auto is_recent = [&](const Message& message) {
    return (now - message.time).toSec() <= duration_s;
  };
  return {std::find_if(messages_.begin(), messages_.end(), is_recent), messages_.end()};
}

void RecentMessages::clear() {
  messages_.clear();
  bytes_ = 0;
}

double RecentMessages::duration() const {
  return messages_.empty() ? 0.0 : (messages_.back().time - messages_.front().time).toSec();
}

}  // namespace process_visualizer
