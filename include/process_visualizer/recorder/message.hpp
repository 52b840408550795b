#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/time.h>

#include <boost/shared_ptr.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace process_visualizer {

/// A message as it came over the wire; any type can be received as this.
struct RawMessage {
  std::vector<std::uint8_t> bytes;
};

/// One publisher's stream of a topic: what a bag calls a connection.
struct Connection {
  std::string topic;
  std::map<std::string, std::string> header;  ///< type, md5sum, message_definition, callerid, ...

  /// A field of the header; empty if there is none.
  std::string field(const std::string& name) const {
    const auto found = header.find(name);
    return found == header.end() ? std::string() : found->second;
  }
  bool isLatching() const { return field("latching") == "1"; }
};

using ConnectionPtr = std::shared_ptr<const Connection>;

/// A message with its publisher and the time when it arrived.
struct Message {
  ConnectionPtr connection;
  ros::Time time;
  boost::shared_ptr<const RawMessage> content;

  std::size_t size() const { return content->bytes.size(); }
  const std::string& topic() const { return connection->topic; }
};

/// Returns the connection for what a publisher said of itself, so that every program can read it in
/// a bag: fields that have to be there are, and texts are UTF-8 (other bytes become U+FFFD).
Connection connectionWith(const std::string& topic,
                          const std::map<std::string, std::string>& header);

/// Returns a connection of type std_msgs/String, for what the recorder itself says.
ConnectionPtr textConnection(const std::string& topic, const std::string& node,
                             bool is_latching = true);

/// Returns a message of type std_msgs/String.
Message textMessage(const ConnectionPtr& connection, const ros::Time& time,
                    const std::string& text);

}  // namespace process_visualizer

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<process_visualizer::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const process_visualizer::RawMessage&) { return value(); }
};

template <>
struct DataType<process_visualizer::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const process_visualizer::RawMessage&) { return value(); }
};

template <>
struct Definition<process_visualizer::RawMessage> {
  static const char* value() { return ""; }
  static const char* value(const process_visualizer::RawMessage&) { return value(); }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<process_visualizer::RawMessage> {
  template <typename Stream>
  static void read(Stream& stream, process_visualizer::RawMessage& message) {
    message.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
  }
};

}  // namespace serialization
}  // namespace ros
