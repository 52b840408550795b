// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Subscriptions that check the lengths claimed by a message before its bytes are deserialized.

#include <ros/message_traits.h>
#include <ros/ros.h>
#include <ros/subscribe_options.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "process_visualizer/common/message_bytes.hpp"

namespace process_visualizer {

constexpr double kReportPeriod = 5;  ///< minimum time between two equal messages in the log, s

/// A callback for messages of one type that checks their claimed lengths before it reads them.
///
/// Within one process, messages are passed on unchanged, as in any subscription.
template <typename Message>
class CheckedCallback
    : public ros::SubscriptionCallbackHelperT<const boost::shared_ptr<const Message>&> {
 public:
  using Base = ros::SubscriptionCallbackHelperT<const boost::shared_ptr<const Message>&>;

  CheckedCallback(const typename Base::Callback& callback, std::string topic)
      : Base(callback),
        lengths_(ros::message_traits::DataType<Message>::value(),
                 ros::message_traits::Definition<Message>::value()),
        topic_(std::move(topic)) {}

  /// Returns nothing, which roscpp ignores, if the bytes are not those of a message.
  ros::VoidConstPtr deserialize(
      const ros::SubscriptionCallbackHelperDeserializeParams& params) override {
    try {
      lengths_.check(params.buffer, params.length);
      return Base::deserialize(params);
    } catch (const std::invalid_argument& error) {
      ROS_ERROR_THROTTLE(kReportPeriod, "A message on %s is left out: %s", topic_.c_str(),
                         error.what());
      return {};
    }
  }

 private:
  ClaimedLengths lengths_;
  std::string topic_;
};

/// Subscribes to a topic; no message can take more memory than a few times its bytes.
template <typename Message, typename Callback>
ros::Subscriber subscribeChecked(ros::NodeHandle& node, const std::string& topic,
                                 std::uint32_t queue_size, const Callback& callback,
                                 const ros::TransportHints& hints = {}) {
  using Helper = CheckedCallback<Message>;
  const typename Helper::Base::Callback taken = callback;
  ros::SubscribeOptions options;
  options.init<Message>(topic, queue_size, taken);
  options.helper = boost::make_shared<Helper>(taken, node.resolveName(topic));
  options.transport_hints = hints;
  return node.subscribe(options);
}

}  // namespace process_visualizer
