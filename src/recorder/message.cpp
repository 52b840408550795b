// SPDX-License-Identifier: BSD-3-Clause
// Connection headers with valid UTF-8, text messages, and copies of fixed frames.

#include "process_visualizer/recorder/message.hpp"

#include <std_msgs/String.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>

namespace process_visualizer::recorder {
namespace {

constexpr char kNode[] = "/cell_frames";  // as in ros_names.py
constexpr char kReplacement[] = "\xEF\xBF\xBD";

/// Returns the length of a character with this first byte; 0 if there is none.
std::size_t lengthOf(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

/// Returns whether a character of this length may have this value: no overlong form, no surrogate.
bool isCharacter(std::size_t length, std::uint32_t value) {
  if (length == 3) return value >= 0x800 && (value < 0xD800 || value > 0xDFFF);
  return length != 4 || (value >= 0x10000 && value <= 0x10FFFF);
}

/// The length of the character at a place; 0 if there is none.
std::size_t characterAt(const std::string& text, std::size_t place) {
  const unsigned char first = text[place];
  const std::size_t length = lengthOf(first);
  if (length < 2 || place + length > text.size()) return length == 1 ? 1 : 0;
  std::uint32_t value = first & (0x7F >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const unsigned char next = text[place + i];
    if ((next & 0xC0) != 0x80) return 0;
    value = value << 6 | (next & 0x3F);
  }
  return isCharacter(length, value) ? length : 0;
}

}  // namespace

std::string validUtf8(const std::string& text) {
  std::string valid;
  for (std::size_t place = 0; place < text.size();) {
    const std::size_t length = characterAt(text, place);
    valid += length > 0 ? text.substr(place, length) : kReplacement;
    place += std::max<std::size_t>(length, 1);
  }
  return valid;
}

Connection connectionWith(const std::string& topic,
                          const std::map<std::string, std::string>& header) {
  Connection connection{topic, {}};
  for (const auto& [name, value] : header) connection.header[validUtf8(name)] = validUtf8(value);
  // There are a type and an md5sum, or roscpp would not have connected.
  connection.header.try_emplace("topic", topic);
  connection.header.try_emplace("message_definition");
  return connection;
}

ConnectionPtr textConnection(const std::string& topic, const std::string& node, bool is_latching) {
  using Text = std_msgs::String;
  return std::make_shared<Connection>(
      Connection{topic,
                 {{"topic", topic},
                  {"type", ros::message_traits::datatype<Text>()},
                  {"md5sum", ros::message_traits::md5sum<Text>()},
                  {"message_definition", ros::message_traits::definition<Text>()},
                  {"callerid", node},
                  {"latching", is_latching ? "1" : "0"}}});
}

Message textMessage(const ConnectionPtr& connection, const ros::Time& time,
                    const std::string& text) {
  const auto content = boost::make_shared<RawMessage>();
  content->bytes.resize(sizeof(std::uint32_t) + text.size());
  ros::serialization::OStream stream(content->bytes.data(), content->bytes.size());
  stream.next(text);
  return {connection, time, content};
}

const std::string FixedFrames::kSource = "/tf_static";
const std::string FixedFrames::kCalibration = kOwnPrefix + "calibration";
const std::string FixedFrames::kOthers = kOwnPrefix + "static_frames";

std::optional<Message> FixedFrames::copyOf(const Message& message) {
  if (message.topic() != kSource) return std::nullopt;
  ConnectionPtr& connection = connections_[message.connection];
  if (!connection) {
    Connection renamed = *message.connection;
    renamed.topic = renamed.header["topic"] =
        message.connection->field("callerid") == kNode ? kCalibration : kOthers;
    connection = std::make_shared<Connection>(renamed);
  }
  return Message{connection, message.time, message.content};
}

bool FixedFrames::isCopy(const std::string& topic) {
  return topic == kCalibration || topic == kOthers;
}

}  // namespace process_visualizer::recorder
