// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages and connections as stored in bags; the recorder's own topics, and fixed frames.

#include <ros/time.h>

#include <boost/shared_ptr.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "process_visualizer/common/raw_message.hpp"

namespace process_visualizer::recorder {

/// One publisher's stream of a topic: a connection, in the terms of bags.
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

/// A message with its connection and its time of arrival.
struct Message {
  ConnectionPtr connection;
  ros::Time time;
  boost::shared_ptr<const RawMessage> content;

  std::size_t size() const { return content->bytes.size(); }
  const std::string& topic() const { return connection->topic; }
};

/// Returns the connection for a publisher's header, such that every program can read it in a bag:
/// with all required fields, and texts in UTF-8 (other bytes become U+FFFD).
Connection connectionWith(const std::string& topic,
                          const std::map<std::string, std::string>& header);

/// Returns a connection of type std_msgs/String, for the recorder's own messages.
ConnectionPtr textConnection(const std::string& topic, const std::string& node,
                             bool is_latching = true);

/// Returns a message of type std_msgs/String.
Message textMessage(const ConnectionPtr& connection, const ros::Time& time,
                    const std::string& text);

/// Returns a text in which every byte that is not part of UTF-8 is replaced by U+FFFD.
std::string validUtf8(const std::string& text);

/// Prefix of the topics that the recorder itself writes, as in ros_names.py.
inline const std::string kOwnPrefix = "/process_visualizer/";

/// Connections of the recorder's own messages in bags.
struct OwnTopics {
  /// \param node the recorder's name
  explicit OwnTopics(const std::string& node)
      : marks(textConnection(kOwnPrefix + "marks", node, false)),
        account(textConnection(kOwnPrefix + "recording", node)),
        configuration(textConnection(kOwnPrefix + "configuration", node)) {}

  const ConnectionPtr marks, account, configuration;
};

/// Fixed frames, which get topics of their own in a bag: played, they must not be mixed with those
/// of the running cell on /tf_static.
class FixedFrames {
 public:
  static const std::string kSource;       ///< the topic on which the frames arrive
  static const std::string kCalibration;  ///< the topic under which the cell's own are recorded
  static const std::string kOthers;       ///< the topic for those of all other nodes

  /// Returns the message under one of these topics if it has fixed frames, else nothing.
  std::optional<Message> copyOf(const Message& message);

  /// Returns whether a topic is one under which frames are recorded.
  static bool isCopy(const std::string& topic);

 private:
  std::map<ConnectionPtr, ConnectionPtr> connections_;  ///< by that of the source
};

}  // namespace process_visualizer::recorder
