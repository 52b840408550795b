// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clusters of nearby points, and upright boxes around them.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace process_visualizer::objects {

/// Disjoint sets that can be joined (union-find). The first member represents its set.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  std::uint32_t first(std::uint32_t member) {
    while (parents_[member] != member) member = parents_[member] = parents_[parents_[member]];
    return member;
  }

  void join(std::uint32_t one, std::uint32_t other) {
    const std::uint32_t a = first(one), b = first(other);
    parents_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parents_;
};

using Cluster = std::vector<Eigen::Vector3f>;
using Indices = std::vector<std::uint32_t>;

/// Divides points into connected clusters: each point lies in a voxel of a grid, and voxels that
/// touch are connected, even at corners. Points nearer to each other than `voxel` (its edge, m) are
/// always in one cluster; points farther apart than 3.5 times as much are connected only by others
/// between them.
/// \return the points of each cluster of at least `min_points`; the order depends on the points
/// alone
std::vector<Indices> clustersOf(const std::vector<Eigen::Vector3f>& points, float voxel,
                                std::size_t min_points);

/// Means of the points in each voxel of a grid, m.
std::vector<Eigen::Vector3f> thinned(const Cluster& points, float voxel);

/// An upright box, in a frame whose z axis points up.
struct UprightBox {
  Eigen::Vector3f center;  ///< m
  Eigen::Vector3f size;    ///< full edge lengths, m
  float yaw;               ///< from the x axis to its first edge, rad
};

/// A place in the frame of a box, whose origin is its center and whose axes are its edges, m.
Eigen::Vector3f inBox(const UprightBox& box, const Eigen::Vector3f& place);

/// Distance of a place from a box, m; 0 inside.
float distanceTo(const UprightBox& box, const Eigen::Vector3f& place);

/// Range of the points along the edges of a box that is turned by `yaw` (rad) about the origin, m.
/// A few stray points at either end are left out, and the sensor's noise there is subtracted.
/// \param blur  the same as for boxAround, its horizontal part
Eigen::AlignedBox2f footprint(const Cluster& points, float yaw, const Eigen::Vector2f& blur);

/// Box around the visible part of an object: the one with the smallest base.
/// \param points  of the object, at least one, m
/// \param blur  vector along the line of sight, as long as the standard deviation of the noise, m
UprightBox boxAround(const Cluster& points, const Eigen::Vector3f& blur = Eigen::Vector3f::Zero());

/// Box of an object that may stand on the surface below it.
///
/// The side that faces the sensor shows how far down an object reaches. One that reaches nearly to
/// the surface stands on it. So does one whose side cannot be seen, less than 11° from straight
/// below the sensor.
/// \param seen  box around its visible part
/// \param surface  height of the surface, m
/// \param tolerance  of the surface, m: points nearer to it do not count as the object's
/// \param sensor  position of the sensor
UprightBox standing(const UprightBox& seen, float surface, float tolerance,
                    const Eigen::Vector3f& sensor);

}  // namespace process_visualizer::objects
