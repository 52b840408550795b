// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace process_visualizer::objects {

/// Sets that grow together (union-find); the first member stands for all of its set.
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

/// Divides points into those that hang together: each lies in a cube of a grid, and cubes that
/// touch belong together, at corners too. Points that are nearer than `cube` (its edge, m) are
/// never apart; those farther than 3.5 times as much are never together without others between
/// them. \return the points of each cluster of at least `fewest`, the order depends on the points
/// alone
std::vector<Indices> clustersOf(const std::vector<Eigen::Vector3f>& points, float cube,
                                std::size_t fewest);

/// The mean of the points in each cube of a grid, m.
std::vector<Eigen::Vector3f> thinned(const Cluster& points, float cube);

/// A box that stands upright, in a frame whose z axis points up.
struct UprightBox {
  Eigen::Vector3f center;  ///< m
  Eigen::Vector3f size;    ///< full edge lengths, m
  float yaw;               ///< of its first edge from the x axis, rad
};

/// A place as it is seen from a box: from its center, along its edges, m.
Eigen::Vector3f inBox(const UprightBox& box, const Eigen::Vector3f& place);

/// How far a place is from a box, m; 0 in it.
float distanceTo(const UprightBox& box, const Eigen::Vector3f& place);

/// The range of points along the edges of a box that is turned by `yaw` (rad), from the origin, m.
/// The few strays at both ends are left out, and what the sensor's noise adds there.
/// \param blur  standard deviation of the noise along the line of sight, seen from above, m
Eigen::AlignedBox2f footprint(const Cluster& points, float yaw, const Eigen::Vector2f& blur);

/// The box around what is seen of an object: of all with its height the one with the smallest base.
/// \param points  of the object, at least one, m
/// \param blur  standard deviation of the noise along the line of sight, m: its direction
UprightBox boxAround(const Cluster& points, const Eigen::Vector3f& blur = Eigen::Vector3f::Zero());

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
