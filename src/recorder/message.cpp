// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/message.hpp"

#include <std_msgs/String.h>

#include <boost/make_shared.hpp>

#include "process_visualizer/recorder/text.hpp"

namespace process_visualizer::recorder {

Connection connectionWith(const std::string& topic,
                          const std::map<std::string, std::string>& header) {
  Connection connection{topic, {}};
  for (const auto& [name, value] : header) connection.header[validUtf8(name)] = validUtf8(value);
  // Type and md5sum are there, or roscpp would not have connected.
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

}  // namespace process_visualizer::recorder
