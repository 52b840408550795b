// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/calibration.hpp"

#include "process_visualizer/recorder/own_topics.hpp"

namespace process_visualizer::recorder {
namespace {

// as in ros_names.py
constexpr char kNode[] = "/cell_frames";

}  // namespace

const std::string Calibration::kSource = "/tf_static";
const std::string Calibration::kTopic = kOwnPrefix + "calibration";

std::optional<Message> Calibration::copyOf(const Message& message) {
  if (message.topic() != kSource || message.connection->field("callerid") != kNode)
    return std::nullopt;
  ConnectionPtr& connection = connections_[message.connection];
  if (!connection) {
    Connection renamed = *message.connection;
    renamed.topic = renamed.header["topic"] = kTopic;
    connection = std::make_shared<Connection>(renamed);
  }
  return Message{connection, message.time, message.content};
}

}  // namespace process_visualizer::recorder
