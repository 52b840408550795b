// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace process_visualizer::cloud {

/// A point as PCL and depth_image_proc lay it out.
struct ColoredPoint {
  float x, y, z, unused;
  std::uint8_t blue, green, red, alpha;
  std::uint8_t padding[12];
};
static_assert(sizeof(ColoredPoint) == 32, "PointCloud2Modifier lays out x, y, z, rgb in 32 bytes");

inline ColoredPoint makePoint(const Eigen::Vector3f& position, std::uint8_t red, std::uint8_t green,
                              std::uint8_t blue) {
  constexpr std::uint8_t kOpaque = 255;
  return {position.x(), position.y(), position.z(), 0, blue, green, red, kOpaque, {}};
}

/// A cloud of one row with the fields x, y, z (m) and rgb.
/// \param points  the bytes of `ColoredPoint`s, all of them finite
sensor_msgs::PointCloud2 makeColoredCloud(const std_msgs::Header& header,
                                          const std::vector<std::uint8_t>& points);

}  // namespace process_visualizer::cloud
