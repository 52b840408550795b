// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The box (region of interest) of all filters: the test for lying inside, corners and outline.

#include <visualization_msgs/Marker.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

namespace process_visualizer::cloud {

/// A box (region of interest) whose edges are parallel to the axes of the frame it is given in.
class Box {
 public:
  /// \param center  middle of the box in its frame, m
  /// \param size    full lengths of its edges, m
  /// \throws std::invalid_argument that names `center` or `size` if it is not finite, or an edge
  ///         is not longer than zero
  Box(const Eigen::Vector3d& center, const Eigen::Vector3d& size);

  const Eigen::Vector3d& center() const { return center_; }
  Eigen::Vector3d halfExtents() const { return size_ / 2; }

  /// The corners, as columns. Bit i of a corner's number is its side of the center along axis i.
  Eigen::Matrix<double, 3, 8> corners() const;

 private:
  Eigen::Vector3d center_;
  Eigen::Vector3d size_;
};

/// Test of a point p in the cloud's frame for lying in a box: |p_i - c_i| < delta_i for i = x, y,
/// z, with the box's center c and half extents delta (thesis equation 6.2). Points that are not
/// finite lie in no box. All filters use this test, so they keep exactly the same points.
class InsideBox {
 public:
  /// \param box_from_cloud  transforms a point of the cloud into the box's frame
  InsideBox(const Eigen::Isometry3d& box_from_cloud, const Box& box)
      : rotation_(box_from_cloud.linear().cast<float>()),
        translation_((box_from_cloud.translation() - box.center()).cast<float>()),
        half_extents_(box.halfExtents().cast<float>()) {}

  bool operator()(const Eigen::Vector3f& position) const {
    const Eigen::Vector3f from_center = rotation_ * position + translation_;
    // & instead of &&: one branch per point. A comparison with NaN is false.
    const int is_inside = static_cast<int>(std::abs(from_center.x()) < half_extents_.x()) &
                          static_cast<int>(std::abs(from_center.y()) < half_extents_.y()) &
                          static_cast<int>(std::abs(from_center.z()) < half_extents_.z());
    return is_inside != 0;
  }

 private:
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  Eigen::Vector3f half_extents_;
};

/// The twelve edges of a box as thin lines, locked to its frame, so RViz moves them with it.
visualization_msgs::Marker outlineOf(const Box& box, const std::string& frame);

}  // namespace process_visualizer::cloud
