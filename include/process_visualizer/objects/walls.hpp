// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Walls: upright planes much wider than a person, and the points that lie on them.

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "process_visualizer/objects/support_planes.hpp"

namespace process_visualizer::objects {

/// Upright planes much wider than a person, such as walls and partitions. Objects near a wall are
/// not a part of it.
class Walls {
 public:
  /// \param points  in a frame whose z axis points up, m; more than SupportPlanes::kMaxPoints take
  /// time
  /// \param sensor  position of the sensor
  Walls(const std::vector<Eigen::Vector3f>& points, Eigen::Vector3f sensor,
        const DepthNoise& noise);

  /// Updates the walls by a newer cloud. A known wall needs only half of the minimum width, because
  /// people hide parts of it.
  /// \param finds_new  also searches for new walls, which takes time
  void update(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& sensor,
              const DepthNoise& noise, bool finds_new);

  std::size_t size() const { return walls_.size(); }

  /// Number of the wall on which a point lies, within the tolerance at its distance.
  std::optional<std::size_t> wallAt(const Eigen::Vector3f& point) const;

 private:
  using Plane = Eigen::Hyperplane<float, 3>;

  struct Wall {
    Plane plane;
    Eigen::Vector2f along;       ///< its horizontal direction
    Eigen::AlignedBox2f extent;  ///< along the wall and upwards, m
  };

  bool addIfWall(const Plane& plane, float min_width, std::vector<Eigen::Vector3f>& tall);
  bool isOn(const Plane& plane, const Eigen::Vector3f& point) const;
  std::vector<Eigen::Vector3f> tallPoints(const std::vector<Eigen::Vector3f>& points) const;
  std::optional<Plane> largest(const std::vector<Eigen::Vector3f>& points) const;
  std::optional<Eigen::AlignedBox2f> extentOf(const Plane& plane,
                                              const std::vector<Eigen::Vector3f>& points,
                                              float min_width) const;

  Eigen::Vector3f sensor_;
  DepthNoise noise_;
  std::vector<Wall> walls_;
};

}  // namespace process_visualizer::objects
