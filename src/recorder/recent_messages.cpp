// SPDX-License-Identifier: BSD-3-Clause
// Drops the oldest messages from memory, and keeps latched ones that a bag must begin with.

#include "process_visualizer/recorder/recent_messages.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string>

namespace process_visualizer::recorder {
namespace {

/// Returns whether messages add up: one publisher's message does not replace another's.
bool addsUp(const std::string& topic) {
  return topic == FixedFrames::kSource || topic == FixedFrames::kOthers;
}

}  // namespace

void LatchedMessages::add(const Message& message) {
  if (message.connection->isLatching())
    newest_[{message.topic(), message.connection->field("callerid")}] = {count_++, message};
}

std::vector<Message> LatchedMessages::at(const ros::Time& time) const {
  std::map<std::uint64_t, const Message*> in_order;
  for (const auto& [key, entry] : newest_) in_order[entry.number] = &entry.message;
  const bool has_room = time.toNSec() > in_order.size();
  std::uint64_t before_ns = has_room ? in_order.size() : 0;
  std::vector<Message> messages;
  for (const auto& [number, message] : in_order) {
    messages.push_back(
        {message->connection, ros::Time().fromNSec(time.toNSec() - before_ns), message->content});
    if (before_ns > 0) --before_ns;
  }
  return messages;
}

void LatchedMessages::forgetReplaced(const std::function<bool(const Message&)>& is_gone) {
  std::map<std::string, std::uint64_t> newest_of_topic;
  for (const auto& [key, entry] : newest_)
    newest_of_topic[key.first] = std::max(newest_of_topic[key.first], entry.number);
  for (auto it = newest_.begin(); it != newest_.end();) {
    const bool is_replaced = it->second.number < newest_of_topic[it->first.first] &&
                             !addsUp(it->first.first) && is_gone(it->second.message);
    it = is_replaced ? newest_.erase(it) : std::next(it);
  }
}

void RecentMessages::add(const Message& message) {
  if (!isKept() || message.time.isZero())
    return addIfLatched(message);  // zero: simulated time has not begun
  messages_.push_back(message);
  bytes_ += message.size();
  while (!messages_.empty() && (bytes_ > limit_bytes_ || age() > duration_)) {
    bytes_ -= messages_.front().size();
    before_.add(messages_.front());
    if (oldest_ >= unrecorded_) before_unrecorded_.add(messages_.front());
    messages_.pop_front();
    ++oldest_;
  }
}

void RecentMessages::addIfLatched(const Message& message) {
  before_.add(message);
  before_unrecorded_.add(message);
}

void RecentMessages::forgetReplaced(const std::function<bool(const Message&)>& is_gone) {
  before_.forgetReplaced(is_gone);
  before_unrecorded_.forgetReplaced(is_gone);
}

Past RecentMessages::last(const ros::Time& now, double duration_s) const {
  return since(unrecorded(), before_unrecorded_, now, duration_s);
}

Past RecentMessages::all(const ros::Time& now, double duration_s) const {
  return since(0, before_, now, duration_s);
}

/// The last seconds of the messages from one on.
/// \param first index of that message in the memory
/// \param before messages latched before it
Past RecentMessages::since(std::size_t first, const LatchedMessages& before, const ros::Time& now,
                           double duration_s) const {
  const auto is_recent = [&](const Message& message) {
    return duration_s > 0 && (now - message.time).toSec() <= duration_s;
  };
  const auto from = messages_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto begin = std::find_if(from, messages_.end(), is_recent);
  Past past{before, {begin, messages_.end()}};
  std::for_each(from, begin, [&](const Message& message) { past.latched.add(message); });
  return past;
}

NumberedMessages RecentMessages::matching(const MessageQuery& query) const {
  NumberedMessages found;
  std::size_t bytes = 0;
  const auto take = [&](const Message& message) {
    if (query.largest > 0 && message.size() > query.largest) return;
    if (query.topics.count(message.topic()) == 0) return;
    found.messages.push_back(message);
    bytes += message.size();
  };
  if (query.first == 0 && !messages_.empty())
    for (const Message& message : before_.at(messages_.front().time)) take(message);
  found.next = std::clamp(query.first, oldest_, oldest_ + messages_.size());
  for (; found.next < oldest_ + messages_.size() && bytes < query.most_bytes; ++found.next)
    take(messages_[found.next - oldest_]);
  found.is_cut = found.next < oldest_ + messages_.size();
  return found;
}

void RecentMessages::clear() {
  setRecorded();
  before_ = before_unrecorded_;
  oldest_ += messages_.size();
  messages_.clear();
  bytes_ = 0;
}

void RecentMessages::forget() {
  clear();
  before_ = before_unrecorded_ = {};
}

void RecentMessages::setRecorded() {
  for (std::size_t i = unrecorded(); i < messages_.size(); ++i)
    before_unrecorded_.add(messages_[i]);
  unrecorded_ = oldest_ + messages_.size();
}

double RecentMessages::ageOfOldestUnrecorded(const ros::Time& now) const {
  const std::size_t first = unrecorded();
  if (first == messages_.size() || (now - messages_.back().time).toSec() > duration_) return 0.0;
  return std::clamp((now - messages_[first].time).toSec(), 0.0, duration_);
}

double RecentMessages::age() const {
  return messages_.empty() ? 0.0 : (messages_.back().time - messages_.front().time).toSec();
}

/// Index in the memory of the first message that no recording has.
std::size_t RecentMessages::unrecorded() const { return std::max(unrecorded_, oldest_) - oldest_; }

namespace {

constexpr std::size_t kMaxBytes = 4 << 20;  // of the messages in an answer

// Bag format 2.0: length of the header, length of its only field, and op=2, message data.
constexpr std::array<std::uint8_t, 12> kHeader = {8, 0, 0, 0, 4, 0, 0, 0, 'o', 'p', '=', 2};

void append(const Message& message, ReadRecent::Response& response) {
  const auto size = static_cast<std::uint32_t>(message.size());
  auto& records = response.records;
  records.insert(records.end(), kHeader.begin(), kHeader.end());
  for (unsigned shift = 0; shift < 32; shift += 8)
    records.push_back(static_cast<std::uint8_t>(size >> shift));
  const auto& bytes = message.content->bytes;
  records.insert(records.end(), bytes.begin(), bytes.end());
  response.sizes.push_back(static_cast<std::uint32_t>(kHeader.size()) + 4 + size);
  response.times.push_back(message.time.toNSec());
}

}  // namespace

void RecentAnswers::answer(const ReadRecent::Request& request, ReadRecent::Response& response) {
  MessageQuery query{
      request.first, {request.topics.begin(), request.topics.end()}, request.largest, kMaxBytes};
  NumberedMessages found = read_(query);
  const std::lock_guard<std::mutex> lock(mutex_);
  response.anew = found.next < request.first || request.known > connections_.size();
  if (response.anew) {
    query.first = 0;
    found = read_(query);
  }
  response.next = found.next;
  response.more = found.is_cut;
  for (const Message& message : found.messages) {
    response.numbers.push_back(numberOf(message.connection));
    append(message, response);
  }
  describe(response.anew ? 0 : request.known, response);
}

std::uint32_t RecentAnswers::numberOf(const ConnectionPtr& connection) {
  const auto [entry, is_new] =
      numbers_.emplace(connection, static_cast<std::uint32_t>(connections_.size()));
  if (is_new) connections_.push_back(connection);
  return entry->second;
}

void RecentAnswers::describe(std::uint32_t known, ReadRecent::Response& response) const {
  response.connection_count = static_cast<std::uint32_t>(connections_.size());
  for (std::uint32_t number = known; number < connections_.size(); ++number) {
    const Connection& connection = *connections_[number];
    for (const std::string& text :
         {connection.topic, connection.field("type"), connection.field("md5sum"),
          connection.field("message_definition"), connection.field("callerid")})
      response.connections.push_back(text);
  }
}

}  // namespace process_visualizer::recorder
