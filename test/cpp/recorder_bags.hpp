// SPDX-License-Identifier: BSD-3-Clause
// Contents of the recorder's bags, read by rosbag's own library.
#pragma once

#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace process_visualizer::recorder {

struct Recorded {
  std::string topic, type, definition, publisher;
  bool is_latching;
  ros::Time time;
  std::string bytes;

  /// The number that `messageAt` has written into it.
  std::uint32_t sequence() const {
    std::uint32_t number;
    std::memcpy(&number, bytes.data(), sizeof number);
    return number;
  }
};

/// All messages of a bag in the order in which they are played.
inline std::vector<Recorded> messagesIn(const std::string& path) {
  const rosbag::Bag bag(path);
  rosbag::View view(bag);
  std::vector<Recorded> messages;
  for (const rosbag::MessageInstance& it : view) {
    std::string bytes(it.size(), '\0');
    ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    it.write(stream);
    messages.push_back({it.getTopic(), it.getDataType(), it.getMessageDefinition(),
                        it.getCallerId(), it.isLatching(), it.getTime(), bytes});
  }
  return messages;
}

/// The numbers of a topic's messages in the order in which they are played.
inline std::vector<std::uint32_t> sequencesIn(const std::string& path, const std::string& topic) {
  std::vector<std::uint32_t> numbers;
  for (const Recorded& message : messagesIn(path))
    if (message.topic == topic) numbers.push_back(message.sequence());
  return numbers;
}

/// The topics of all messages in the order in which they are played.
inline std::vector<std::string> topicsIn(const std::string& path) {
  std::vector<std::string> topics;
  for (const Recorded& message : messagesIn(path)) topics.push_back(message.topic);
  return topics;
}

}  // namespace process_visualizer::recorder
