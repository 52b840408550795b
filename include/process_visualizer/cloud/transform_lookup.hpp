// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>

#include <Eigen/Geometry>
#include <string>

namespace process_visualizer::cloud {

/// The transform from the frame of some data into another one, at the stamp of the data: either may
/// move with a robot, whose pose arrives a little later and is waited for. For stamps that are not
/// of the last second, such as those of a foreign recording, it is the newest one.
/// \param frame  to transform into; empty for that of the data
/// \throws tf2::TransformException there is none
Eigen::Isometry3d transformInto(const std::string& frame, const std_msgs::Header& header,
                                const tf2_ros::Buffer& buffer);

}  // namespace process_visualizer::cloud
