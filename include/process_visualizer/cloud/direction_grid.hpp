// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>

namespace process_visualizer::cloud {

/// The directions in which a sensor looks, in cells of about the same size.
class DirectionGrid {
 public:
  /// \param place  of the sensor, m
  /// \param width  of a cell, rad
  DirectionGrid(Eigen::Vector3f place, double width) : place_(std::move(place)), width_(width) {}

  /// The number of the cell in which a point is seen.
  std::uint64_t cell(const Eigen::Vector3f& point) const;

  /// How far away a point is, m.
  float range(const Eigen::Vector3f& point) const { return (point - place_).norm(); }

  double width() const { return width_; }  ///< of a cell, rad

 private:
  Eigen::Vector3f place_;
  double width_;
};

}  // namespace process_visualizer::cloud
