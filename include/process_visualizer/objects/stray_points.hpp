// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "process_visualizer/objects/point_image.hpp"

namespace process_visualizer::objects {

/// What is known about a point of a cloud.
enum class Label : std::uint8_t {
  kNowhere,   ///< not a number
  kOutside,   ///< not in the region that is looked at
  kKnown,     ///< on something that has a model and is no robot
  kRobot,     ///< on a robot
  kExpected,  ///< where something is expected
  kStray,     ///< made up by the sensor
  kFree,      ///< on something that nobody modelled
};

/// Finds among the free points what a camera makes up where something hides what is behind it: a
/// pixel on the edge sees both, and gets a depth between them. Of the eight pixels around such a
/// one fewer than four are free and about as far from the camera. So are single points that a
/// model's padding does not reach.
void markStrayPoints(const Points& points, std::vector<Label>& labels);

}  // namespace process_visualizer::objects
