// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Services that check the lengths claimed by a request before its bytes are deserialized.

#include <ros/advertise_service_options.h>
#include <ros/message_traits.h>
#include <ros/ros.h>
#include <ros/service_callback_helper.h>

#include <boost/function.hpp>
#include <boost/make_shared.hpp>
#include <string>

#include "process_visualizer/common/message_bytes.hpp"

namespace process_visualizer {

/// Answers a service's requests, after checking their claimed lengths.
class CheckedRequests : public ros::ServiceCallbackHelper {
 public:
  /// \param answer      as created by roscpp
  /// \param type        of the request
  /// \param definition  of that type
  CheckedRequests(ros::ServiceCallbackHelperPtr answer, const std::string& type,
                  const std::string& definition)
      : answer_(std::move(answer)), lengths_(type, definition) {}

  /// Throws std::invalid_argument if the bytes are not those of a request: roscpp logs it and
  /// answers that the call has failed.
  bool call(ros::ServiceCallbackHelperCallParams& params) override {
    lengths_.check(params.request.message_start, params.request.num_bytes);
    return answer_->call(params);
  }

 private:
  ros::ServiceCallbackHelperPtr answer_;
  ClaimedLengths lengths_;
};

/// Offers a service; no request can take more memory than a few times its bytes.
template <typename Service, typename Answer>
ros::ServiceServer advertiseChecked(ros::NodeHandle& node, const std::string& name,
                                    const Answer& answer) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  ros::AdvertiseServiceOptions options;
  options.init<Request, Response>(name, boost::function<bool(Request&, Response&)>(answer));
  options.helper = boost::make_shared<CheckedRequests>(
      options.helper, ros::message_traits::DataType<Request>::value(),
      ros::message_traits::Definition<Request>::value());
  return node.advertiseService(options);
}

}  // namespace process_visualizer
