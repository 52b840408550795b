// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>

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

 private:
  Eigen::Vector3d center_;
  Eigen::Vector3d size_;
};

/// Keeps the points p of a cloud that lie in a box: |p_i - c_i| < delta_i for i = x, y, z, with the
/// box's centre c and half extents delta (thesis equation 6.2). Points that are not finite lie in
/// no box.
///
/// The points stay in the cloud's frame, in their order, and every field of them is kept byte for
/// byte. The result has one row, no padding between rows, and no invalid points.
///
/// \param cloud           any layout with little-endian float32 fields x, y, z, in m
/// \param box_from_cloud  transforms a point of the cloud into the box's frame
/// \throws std::invalid_argument that says what is wrong with the cloud's layout
sensor_msgs::PointCloud2 cropToBox(const sensor_msgs::PointCloud2& cloud,
                                   const Eigen::Isometry3d& box_from_cloud, const Box& box);

}  // namespace process_visualizer::cloud
