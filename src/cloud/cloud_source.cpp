// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/cloud_source.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <stdexcept>

#include "process_visualizer/common/checked_subscription.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::PointCloud2;

constexpr double kPatience = 5.0;   ///< s
constexpr double kBeginning = 0.5;  ///< until the transforms of a cloud are heard as well, s
constexpr double kQuiet = 1.0;      ///< after which no newer cloud is to be expected, s
constexpr double kPeriod = 0.05;    ///< s

// as in ros_names.py
constexpr char kRepeat[] = "/bag_player/repeat";

/// Lets a player that is paused publish what it shows once more.
void askForRepetition() {
  std_srvs::Trigger request;
  if (ros::service::exists(kRepeat, /*print_failure_reason=*/false))
    ros::service::call(kRepeat, request);
}

}  // namespace

PointCloud2::ConstPtr nextCloud(const std::string& topic) {
  const ros::Time begin = ros::Time::now() + ros::Duration(kBeginning);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kPatience);
  PointCloud2::ConstPtr last;
  ros::WallTime arrival;
  ros::CallbackQueue queue;
  ros::NodeHandle node_handle;
  node_handle.setCallbackQueue(&queue);
  const ros::Subscriber subscriber =
      subscribeChecked<PointCloud2>(node_handle, topic, 1, [&](const PointCloud2::ConstPtr& cloud) {
        last = cloud;
        arrival = ros::WallTime::now();
      });
  bool is_connected = false;
  const auto is_last = [&] {
    return last && (last->header.stamp >= begin ||
                    ros::WallTime::now() > arrival + ros::WallDuration(kQuiet));
  };
  while (ros::ok() && ros::WallTime::now() < end && !is_last()) {
    queue.callAvailable(ros::WallDuration(kPeriod));
    if (!is_connected && subscriber.getNumPublishers() > 0) askForRepetition();
    is_connected = subscriber.getNumPublishers() > 0;
  }
  if (last) return last;
  throw std::runtime_error(is_connected ? "no cloud comes on " + topic
                                        : "nobody publishes clouds on " + topic);
}

}  // namespace process_visualizer::cloud
