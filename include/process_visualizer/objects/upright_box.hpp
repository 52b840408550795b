// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {

/// A box that stands upright, in a frame whose z axis points up.
struct UprightBox {
  Eigen::Vector3f center;  ///< m
  Eigen::Vector3f size;    ///< full edge lengths, m
  float yaw;               ///< of its first edge from the x axis, rad
};

/// A place as it is seen from a box: from its centre, along its edges, m.
Eigen::Vector3f inBox(const UprightBox& box, const Eigen::Vector3f& place);

/// How far a place is from a box, m; 0 in it.
float distanceTo(const UprightBox& box, const Eigen::Vector3f& place);

/// The range of points along the edges of a box that is turned by `yaw` (rad), from the origin, m.
/// The few strays at both ends are left out.
Eigen::AlignedBox2f footprint(const Cluster& points, float yaw);

/// The box around what is seen of an object: of all with its height the one with the smallest base.
/// \param points  of the object, at least one, m
UprightBox boxAround(const Cluster& points);

/// The box of an object that may stand on the surface below it.
///
/// The side that faces the sensor shows how far down an object reaches. One that reaches nearly to
/// the surface below it stands on it; so does one whose side cannot be seen, at less than 11° from
/// straight below a sensor.
/// \param seen  the box around what is seen of it
/// \param surface  height of the surface, m
/// \param tolerance  of the surface, m: nearer points are not seen as the object's
/// \param sensor  where it was seen from
UprightBox standing(const UprightBox& seen, float surface, float tolerance,
                    const Eigen::Vector3f& sensor);

}  // namespace process_visualizer::objects
