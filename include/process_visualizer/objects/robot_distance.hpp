// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/known_bodies.hpp"

namespace process_visualizer::objects {

/// The shortest way from an object to a robot.
struct RobotDistance {
  std::string link;
  float distance;  ///< m
  Eigen::Vector3f on_object, on_robot;
};

/// The distance of points from the robots among the bodies; nothing if there is none.
/// \param points  at least one, m
/// \param from_body  a transform for each body into the frame of the points
std::optional<RobotDistance> distanceToRobots(const Cluster& points,
                                              const std::vector<KnownBody>& bodies,
                                              const std::vector<Eigen::Isometry3f>& from_body);

}  // namespace process_visualizer::objects
