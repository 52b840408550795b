// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/recent_answers.hpp"

#include <array>
#include <string>

namespace process_visualizer::recorder {
namespace {

constexpr std::size_t kMostBytes = 4 << 20;  // of messages in an answer

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
  MessageWish wish{
      request.first, {request.topics.begin(), request.topics.end()}, request.largest, kMostBytes};
  NumberedMessages found = intake_.recent(wish);
  const std::lock_guard<std::mutex> lock(mutex_);
  response.anew = found.next < request.first || request.known > connections_.size();
  if (response.anew) {
    wish.first = 0;
    found = intake_.recent(wish);
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
