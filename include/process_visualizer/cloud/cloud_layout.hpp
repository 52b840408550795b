// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Byte layout of PointCloud2 messages: checks, coordinates and colors of a point, new clouds.

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

namespace process_visualizer::cloud {

/// Offsets of the coordinates within a point, bytes.
struct CoordinateOffsets {
  std::size_t x, y, z;
};

/// Checks a cloud's layout, so that every byte read later exists.
/// \throws std::invalid_argument that says what is wrong
CoordinateOffsets checkedOffsets(const sensor_msgs::PointCloud2& cloud);

/// The number of rows to visit: none if rows have no points. Such rows need no data, so a short
/// message may claim four billion of them.
std::size_t rowsWithPoints(const sensor_msgs::PointCloud2& cloud);

/// Returns the offset of a point's color (field `rgb` or `rgba`, as PCL lays it out: blue, green,
/// red), in bytes; nothing if the cloud has none.
std::optional<std::size_t> colorOffset(const sensor_msgs::PointCloud2& cloud);

inline float readFloat(const std::uint8_t* bytes) {
  float value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// The position of a point, m; NaN if nothing was measured. Some drivers write zeros for that, and
/// no real point is at the sensor itself.
inline Eigen::Vector3f positionAt(const std::uint8_t* point, const CoordinateOffsets& offsets) {
  Eigen::Vector3f position(readFloat(point + offsets.x), readFloat(point + offsets.y),
                           readFloat(point + offsets.z));
  if (position.x() != 0 || position.y() != 0 || position.z() != 0) return position;
  return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
}

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
