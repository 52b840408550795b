// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <visualization_msgs/Marker.h>

#include <optional>
#include <string>

#include "process_visualizer/cloud/roi_parameters.hpp"

namespace process_visualizer::cloud {

/// The box of a nodelet: follows the nodelet's parameters, and shows the box on `~outline`
/// (latched). Not for several threads at once.
class RegionOfInterest {
 public:
  /// \param node_handle  the private one of the nodelet
  explicit RegionOfInterest(const ros::NodeHandle& node_handle);

  /// Reads the parameters again. If they are bad it says so and keeps the last good ones.
  /// \return nothing as long as there have been no good ones
  const std::optional<RoiParameters>& update();

  /// Where a box without a frame of its own is: in the frame of the newest data.
  void setDataFrame(const std::string& frame) { data_frame_ = frame; }

 private:
  void showOutline();

  ros::NodeHandle node_handle_;
  ros::Publisher outline_publisher_;
  std::optional<RoiParameters> parameters_;
  std::string data_frame_;
  visualization_msgs::Marker shown_outline_;
};

}  // namespace process_visualizer::cloud
