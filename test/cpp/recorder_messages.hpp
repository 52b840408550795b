// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/make_shared.hpp>
#include <cstring>
#include <memory>
#include <string>

#include "process_visualizer/recorder/message.hpp"

namespace process_visualizer::recorder {

inline ConnectionPtr connectionWith(const std::string& definition,
                                    const std::string& latching = "0") {
  return std::make_shared<Connection>(Connection{"/a",
                                                 {{"type", "a/A"},
                                                  {"md5sum", "0"},
                                                  {"message_definition", definition},
                                                  {"callerid", "/n"},
                                                  {"latching", latching}}});
}

inline Message messageAt(double time, const ConnectionPtr& connection, std::size_t size = 100,
                         std::uint32_t sequence = 0) {
  const auto content = boost::make_shared<RawMessage>();
  content->bytes.resize(size);
  std::memcpy(content->bytes.data(), &sequence, sizeof sequence);
  return {connection, ros::Time(time), content};
}

inline ConnectionPtr connectionOf(const std::string& topic, const std::string& node = "/n",
                                  const std::string& latching = "0") {
  return std::make_shared<Connection>(Connection{topic,
                                                 {{"topic", topic},
                                                  {"type", "a/A"},
                                                  {"md5sum", "0"},
                                                  {"message_definition", "float32 x"},
                                                  {"callerid", node},
                                                  {"latching", latching}}});
}

inline ConnectionPtr latchedBy(const std::string& node, const std::string& topic = "/a") {
  return connectionOf(topic, node, "1");
}

}  // namespace process_visualizer::recorder
