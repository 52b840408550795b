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
