// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/transform_lookup.hpp"

#include <ros/time.h>
#include <tf2_eigen/tf2_eigen.h>

#include <cmath>

#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr double kWait = 0.1;  ///< for the pose of a moving frame, s
constexpr double kRecent = 1;  ///< how far a stamp may be from now, s

}  // namespace

Eigen::Isometry3d transformInto(const std::string& frame, const std_msgs::Header& header,
                                const tf2_ros::Buffer& buffer) {
  if (frame.empty()) return Eigen::Isometry3d::Identity();
  const bool is_recent = std::abs((ros::Time::now() - header.stamp).toSec()) < kRecent;
  const ros::Time time = is_recent ? header.stamp : ros::Time(0);
  return tf2::transformToEigen(buffer.lookupTransform(frame, withoutLeadingSlash(header.frame_id),
                                                      time, ros::Duration(kWait)));
}

}  // namespace process_visualizer::cloud
