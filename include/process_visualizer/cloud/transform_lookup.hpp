// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Transform of data at its stamp: maximum wait for it, and use of the newest one instead.

#include <ros/time.h>
#include <std_msgs/Header.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/buffer.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {

/// The transform from the frame of some data into another one, at the stamp of the data. Either may
/// move with a robot whose pose arrives a little later, so this waits. If the stamp is more than a
/// second from now, as in a recording played by another tool, it is the newest transform.
/// \param frame  target frame; empty: the frame of the data
/// \throws tf2::TransformException if there is none
inline Eigen::Isometry3d transformInto(const std::string& frame, const std_msgs::Header& header,
                                       const tf2_ros::Buffer& buffer) {
  constexpr double kWait = 0.1;  // maximum wait for the pose of a moving frame, s
  constexpr double kRecent = 1;  // maximum distance of a stamp from now, s
  if (frame.empty()) return Eigen::Isometry3d::Identity();
  const bool is_recent = std::abs((ros::Time::now() - header.stamp).toSec()) < kRecent;
  const ros::Time time = is_recent ? header.stamp : ros::Time(0);
  return tf2::transformToEigen(buffer.lookupTransform(frame, withoutLeadingSlash(header.frame_id),
                                                      time, ros::Duration(kWait)));
}

}  // namespace process_visualizer::cloud
