// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The cloud as an image: stray points, silhouettes of groups, their occluders, and hidden boxes.

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

/// Classification of a point of a cloud.
enum class Label : std::uint8_t {
  kNowhere,   ///< not a number
  kOutside,   ///< not in the searched region
  kKnown,     ///< on a modeled body that is no robot
  kRobot,     ///< on a robot
  kExpected,  ///< in a region where an object is expected
  kStray,     ///< artifact of the sensor
  kFree,      ///< on something without a model
  kThin,      ///< free or an artifact: on an edge, a tip or a steep surface
};

/// Marks stray points among the free ones: mixed pixels on the edge of an occluder, which see both
/// surfaces and get a depth between them, and single points that a model's padding does not reach.
/// Of the eight neighbors of such a pixel, fewer than four are free and about as far from the
/// camera. It is marked as thin if at least two are, or continue it evenly as a steep surface does:
/// it may be real then, such as a tip.
void markStrayPoints(const Points& points, std::vector<Label>& labels);

/// The points of a cloud.
/// \throws std::invalid_argument that names the problem of the cloud's layout
Points pointsOf(const sensor_msgs::PointCloud2& cloud);

/// The points of a cloud that are free, in its frame, with all their fields.
/// \param labels  of all points of `pointsOf(cloud)`
sensor_msgs::PointCloud2 freePart(const sensor_msgs::PointCloud2& cloud,
                                  const std::vector<Label>& labels);

/// Two groups of points with nothing but occluders in the image between them.
struct Bridge {
  std::uint32_t one, other;  ///< groups, `one` < `other`
  bool continues;            ///< they may be one surface: close together, and about as far away
};

/// A point on the silhouette of a group in the image.
struct RimPoint {
  std::uint32_t point;       ///< of the group
  Eigen::Vector3f outwards;  ///< unit vector, away from the group
  bool is_truncated;  ///< the group may extend further: hidden, or beyond the image or region
};

/// Occlusions of groups of points, as the sensor sees them.
struct Occlusions {
  std::vector<std::vector<RimPoint>> rims;  ///< of each group
  std::vector<Bridge> bridges;
};

/// Searches rows and columns of the cloud's image. A robot also hides what is close around it, as
/// points within its padding are attributed to it.
/// \param groups  indices of points in the cloud
Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups);

/// Returns whether most points in the direction of a box are in front of it, so that it may contain
/// a hidden object. A robot in the box hides an object there as well.
/// \param box  in the global frame
bool isHidden(const UprightBox& box, const Points& points, const std::vector<Label>& labels,
              const Eigen::Isometry3f& global_from_cloud);

}  // namespace process_visualizer::objects
