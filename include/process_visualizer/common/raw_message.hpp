// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages of any type as undecoded bytes, and the subscription that receives them.

#include <ros/message_event.h>
#include <ros/message_traits.h>
#include <ros/node_handle.h>
#include <ros/serialization.h>
#include <ros/subscribe_options.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace process_visualizer {

/// A message as received, undecoded; any type can be received as this.
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

namespace process_visualizer {

using RawMessageEvent = ros::MessageEvent<RawMessage const>;

/// Subscribes to a topic of any type.
/// \param queue_size  maximum number of waiting messages; 0: unlimited
inline ros::Subscriber subscribeRaw(ros::NodeHandle& node, const std::string& topic,
                                    std::uint32_t queue_size,
                                    const std::function<void(const RawMessageEvent&)>& take) {
  ros::SubscribeOptions options;
  options.topic = topic;
  options.queue_size = queue_size;
  options.md5sum = ros::message_traits::md5sum<RawMessage>();
  options.datatype = ros::message_traits::datatype<RawMessage>();
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  options.helper =
      boost::make_shared<ros::SubscriptionCallbackHelperT<const RawMessageEvent&>>(take);
  return node.subscribe(options);
}

}  // namespace process_visualizer
