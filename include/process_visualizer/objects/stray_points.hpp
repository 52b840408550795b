// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace process_visualizer::objects {

/// What is known about a point of a cloud.
enum class Label : std::uint8_t {
  kNowhere,   ///< not a number
  kOutside,   ///< not in the region that is looked at
  kKnown,     ///< on something that has a model
  kExpected,  ///< where something is expected
  kStray,     ///< made up by the sensor
  kFree,      ///< on something that nobody modelled
};

/// The points of a cloud, in its frame (m), in rows if `height` is greater than one.
struct Points {
  std::vector<Eigen::Vector3f> places;
  std::size_t width = 0, height = 0;
};

/// Finds among the free points what a camera makes up where something hides what is behind it: a
/// pixel on the edge sees both, and gets a depth between them. Of the eight pixels around such a
/// one fewer than four are free and about as far from the camera. So are single points that a
/// model's padding does not reach.
///
/// Points that are not in rows are put into the pixels of a camera in whose optical frame (z
/// forward) they are: points that follow each other in a row of its image tell their width.
void markStrayPoints(const Points& points, std::vector<Label>& labels);

}  // namespace process_visualizer::objects
