// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {

/// The points of a cloud, in its frame (m), in rows if `height` is greater than one.
struct Points {
  std::vector<Eigen::Vector3f> places;
  std::size_t width = 0, height = 0;
};

/// What is known about a point of a cloud.
enum class Label : std::uint8_t {
  kNowhere,   ///< not a number
  kOutside,   ///< not in the region that is looked at
  kKnown,     ///< on something that has a model and is no robot
  kRobot,     ///< on a robot
  kExpected,  ///< where something is expected
  kStray,     ///< made up by the sensor
  kFree,      ///< on something that nobody modeled
  kThin,      ///< the same, or made up: on an edge, a tip or a steep surface
};

/// Finds among the free points what a camera makes up where something hides what is behind it: a
/// pixel on the edge sees both, and gets a depth between them. Of the eight pixels around such a
/// one fewer than four are free and about as far from the camera. So are single points that a
/// model's padding does not reach. If two are, or continue it evenly as a steep surface does, it
/// may be real: tips look like this.
void markStrayPoints(const Points& points, std::vector<Label>& labels);

/// The points of a cloud.
/// \throws std::invalid_argument that says what is wrong with the cloud's layout
Points pointsOf(const sensor_msgs::PointCloud2& cloud);

/// The points of a cloud that are free, in its frame, with all their fields.
/// \param labels  of all points of `pointsOf(cloud)`
sensor_msgs::PointCloud2 freePart(const sensor_msgs::PointCloud2& cloud,
                                  const std::vector<Label>& labels);

/// Two groups of points between which nothing is seen but what hides what is behind it.
struct Bridge {
  std::uint32_t one, other;  ///< groups, `one` < `other`
  bool continues;            ///< whether the surfaces may be one: near, and about as far away
};

/// Where a group ends in the image.
struct RimPoint {
  std::uint32_t point;       ///< of the group
  Eigen::Vector3f outwards;  ///< the direction in which it ends, of length 1
  bool is_cut;  ///< whether it may go on: behind something, beyond the picture or the region
};

/// What hides parts of groups of points, as the sensor sees them.
struct Occlusions {
  std::vector<std::vector<RimPoint>> rims;  ///< of each group
  std::vector<Bridge> bridges;
};

/// Looks along rows and columns of the cloud's image. A robot hides what is around it, too: points
/// that are as near as its padding are taken for its own.
/// \param groups  indices of points in the cloud
Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups);

/// Whether most of what a sensor sees in the direction of a box is in front of it, so that nobody
/// knows whether something is there. A robot in it hides what is there, too.
/// \param box  in the global frame
bool isHidden(const UprightBox& box, const Points& points, const std::vector<Label>& labels,
              const Eigen::Isometry3f& global_from_cloud);

}  // namespace process_visualizer::objects
