// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/region_of_interest.hpp"

#include <ros/console.h>

#include <stdexcept>

#include "process_visualizer/cloud/box_outline.hpp"
#include "process_visualizer/cloud/periods.hpp"

namespace process_visualizer::cloud {

RegionOfInterest::RegionOfInterest(const ros::NodeHandle& node_handle) : node_handle_(node_handle) {
  outline_publisher_ =
      node_handle_.advertise<visualization_msgs::Marker>("outline", 1, /*latch=*/true);
}

const std::optional<RoiParameters>& RegionOfInterest::update() {
  try {
    parameters_ = readRoiParameters(node_handle_);
    showOutline();
  } catch (const std::invalid_argument& error) {
    ROS_ERROR_THROTTLE(
        kReportPeriod, "%s; %s", error.what(),
        parameters_ ? "the last good values stay in use" : "no cloud is let through");
  }
  return parameters_;
}

void RegionOfInterest::showOutline() {
  const std::string& frame = parameters_->frame.empty() ? data_frame_ : parameters_->frame;
  if (frame.empty()) return;
  const visualization_msgs::Marker outline = outlineOf(parameters_->box, frame);
  if (outline == shown_outline_) return;
  outline_publisher_.publish(outline);
  shown_outline_ = outline;
}

}  // namespace process_visualizer::cloud
