// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstdint>
#include <vector>

namespace process_visualizer {

/// A message as it came over the wire; any type can be received as this.
struct RawMessage {
  std::vector<std::uint8_t> bytes;
};

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
