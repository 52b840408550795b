// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {

/// A box that stands upright, in a frame whose z axis points up.
struct UprightBox {
  Eigen::Vector3f center;  ///< m
  Eigen::Vector3f size;    ///< full edge lengths, m
  float yaw;               ///< of its first edge from the x axis, rad

  bool contains(const Eigen::Vector3f& place) const;
};

/// The box around an object: of all with its height the one with the smallest base.
///
/// The side that faces the sensor shows how far down an object reaches. One that reaches nearly to
/// the surface below it stands on it; so does one whose side cannot be seen, right below a sensor.
/// \param points  of the object, at least one, m
/// \param sensor  where they were seen from
/// \param surface  height of the surface below it, if there is one, m
/// \param tolerance  of the surface, m: nearer points are not seen as the object's
UprightBox boxAround(const Cluster& points, const Eigen::Vector3f& sensor,
                     std::optional<float> surface, float tolerance);

}  // namespace process_visualizer::objects
