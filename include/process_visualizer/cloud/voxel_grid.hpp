// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Thins clouds: one point with mean position and color for each cube of a grid fixed to the origin.

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace process_visualizer::cloud {

/// Thins colored clouds: replaces all points in a cube of a grid by their mean position and color.
///
/// The grid is fixed to the origin, so that objects at rest do not flicker. Like pcl::VoxelGrid,
/// but for several clouds at once without joining them first, and without its limit of 2^31 cubes
/// in a cloud's bounding box (docs/benchmarks.md compares the two).
class VoxelGrid {
 public:
  /// \param edge  of the cubes, m
  /// \throws std::invalid_argument unless it is a finite number greater than zero
  explicit VoxelGrid(double edge);

  /// Adds the points of a cloud, except those that are not finite or farther away than 2^20 cubes.
  /// Points without a color are gray.
  /// \param cloud            any layout with little-endian float32 fields x, y, z, in m
  /// \param grid_from_cloud  transforms a point of the cloud into the grid's frame
  /// \throws std::invalid_argument that says what is wrong with the cloud's layout
  void add(const sensor_msgs::PointCloud2& cloud, const Eigen::Isometry3d& grid_from_cloud);

  /// The means, with the fields x, y, z (m) and rgb, in the order in which the cubes were added.
  sensor_msgs::PointCloud2 cloud(const std_msgs::Header& header) const;

  void clear();

 private:
  struct Cube {
    std::uint64_t key;
    Eigen::Vector3f position_sum;  ///< relative to the grid's origin, m
    std::uint32_t red_sum, green_sum, blue_sum, count;
  };

  void addPoint(const Eigen::Vector3f& position, const std::uint8_t* blue_green_red);
  Cube& cubeAt(std::uint64_t key);
  std::size_t slotOf(std::uint64_t key) const;
  void grow();

  float cubes_per_meter_;
  std::vector<Cube> cubes_;
  std::vector<std::uint32_t> slots_;  ///< a hash table: numbers of cubes from 1 on, 0 for none
};

}  // namespace process_visualizer::cloud
