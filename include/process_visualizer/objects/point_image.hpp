// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace process_visualizer::objects {

/// The points of a cloud, in its frame (m), in rows if `height` is greater than one.
struct Points {
  std::vector<Eigen::Vector3f> places;
  std::size_t width = 0, height = 0;
};

constexpr std::int32_t kNoPoint = -1;

/// Which point of a cloud each pixel of a camera has. There is a column and a row without points on
/// each side. There are no pixels at all if no image can be made of the points.
struct PointImage {
  std::size_t width = 0, height = 0;
  std::vector<std::int32_t> points;
};

/// The image of a cloud. Points that are not in rows are put into the pixels of a camera in whose
/// optical frame (z forward) they are: points that follow each other in a row of its image tell
/// their width.
PointImage imageOf(const Points& points);

/// How far from a sensor two points on one surface may be apart at a distance (m) from it: 1 cm,
/// and two steps of a Kinect's depth (3 mm at 1 m, growing with the square of the distance).
inline float toleranceAt(float range) { return 0.01F + 2 * 0.003F * range * range; }

}  // namespace process_visualizer::objects
