// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "process_visualizer/objects/support_planes.hpp"

namespace process_visualizer::objects {

/// Upright planes that are much wider than a person, such as walls and partitions. What stands near
/// a wall is not a part of it.
class Walls {
 public:
  /// \param points  in a frame whose z axis points up, m; more than SupportPlanes::kMostPoints take
  /// time
  /// \param sensor  where they were seen from
  Walls(const std::vector<Eigen::Vector3f>& points, Eigen::Vector3f sensor,
        const DepthNoise& noise);

  /// Adapts them to a newer cloud: what was a wall is one as long as half as much of it is seen,
  /// because people hide parts of it.
  /// \param seeks_more  whether new ones are sought, too, which takes time
  void update(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& sensor,
              const DepthNoise& noise, bool seeks_more);

  std::size_t size() const { return walls_.size(); }

  /// The number of the wall on which a point lies, within what a depth sensor is wrong by at this
  /// distance.
  std::optional<std::size_t> wallAt(const Eigen::Vector3f& point) const;

 private:
  using Plane = Eigen::Hyperplane<float, 3>;

  struct Wall {
    Plane plane;
    Eigen::Vector2f along;       ///< its horizontal direction
    Eigen::AlignedBox2f extent;  ///< along the wall and upwards, m
  };

  bool take(const Plane& plane, float least_width, std::vector<Eigen::Vector3f>& tall);
  bool isOn(const Plane& plane, const Eigen::Vector3f& point) const;
  std::vector<Eigen::Vector3f> tallPoints(const std::vector<Eigen::Vector3f>& points) const;
  std::optional<Plane> largest(const std::vector<Eigen::Vector3f>& points) const;
  std::optional<Eigen::AlignedBox2f> extentOf(const Plane& plane,
                                              const std::vector<Eigen::Vector3f>& points,
                                              float least_width) const;

  Eigen::Vector3f sensor_;
  DepthNoise noise_;
  std::vector<Wall> walls_;
};

}  // namespace process_visualizer::objects
