// SPDX-License-Identifier: BSD-3-Clause
#include "camera_report.hpp"

#include <ros/node_handle.h>
#include <std_msgs/String.h>

#include "camera_text.hpp"

namespace process_visualizer::displays {
namespace {

constexpr float kLookPeriod = 0.1F;  ///< between two looks, s

}  // namespace

void CameraReport::advertise() {
  publisher_ = ros::NodeHandle("~").advertise<std_msgs::String>("camera", 1, /*latch=*/true);
}

void CameraReport::update(float wall_dt, const rviz::ViewManager& views) {
  seconds_since_look_ += wall_dt;
  if (seconds_since_look_ < kLookPeriod) return;
  seconds_since_look_ = 0;
  std::string text = cameraText(views);
  if (text == published_) return;
  std_msgs::String message;
  message.data = text;
  publisher_.publish(message);
  published_ = std::move(text);
}

}  // namespace process_visualizer::displays
