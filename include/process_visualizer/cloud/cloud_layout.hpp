// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

namespace process_visualizer::cloud {

/// Where the coordinates lie within a point, in bytes.
struct CoordinateOffsets {
  std::size_t x, y, z;
};

/// Checks a cloud's layout, so that every byte that is read later on exists.
/// \throws std::invalid_argument that says what is wrong
CoordinateOffsets checkedOffsets(const sensor_msgs::PointCloud2& cloud);

/// The number of rows to visit: none where they have no points. Such rows need no data, so that a
/// short message may have four billion of them.
std::size_t rowsWithPoints(const sensor_msgs::PointCloud2& cloud);

/// Where a point has its colour (field `rgb` or `rgba`, as PCL lays it out: blue, green, red), in
/// bytes; nothing if the cloud has none.
std::optional<std::size_t> colorOffset(const sensor_msgs::PointCloud2& cloud);

inline float readFloat(const std::uint8_t* bytes) {
  float value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// The position of a point, m; NaN where nothing was measured, which some drivers write as zeros:
/// no sensor sees itself.
inline Eigen::Vector3f positionAt(const std::uint8_t* point, const CoordinateOffsets& offsets) {
  Eigen::Vector3f position(readFloat(point + offsets.x), readFloat(point + offsets.y),
                           readFloat(point + offsets.z));
  if (position.x() != 0 || position.y() != 0 || position.z() != 0) return position;
  return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
}

}  // namespace process_visualizer::cloud
