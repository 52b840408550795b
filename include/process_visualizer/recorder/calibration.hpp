// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>

#include "process_visualizer/recorder/message.hpp"

namespace process_visualizer::recorder {

/// The cell's own frames get a topic of their own in a bag, so that a player can tell them from all
/// others on /tf_static.
class Calibration {
 public:
  static const std::string kSource;  ///< the topic on which the frames come
  static const std::string kTopic;   ///< and that under which they are recorded

  /// Returns the message under the other topic if it holds the cell's frames, else nothing.
  std::optional<Message> copyOf(const Message& message);

 private:
  std::map<ConnectionPtr, ConnectionPtr> connections_;  ///< by that of the source
};

}  // namespace process_visualizer::recorder
