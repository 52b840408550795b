// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <vector>

namespace process_visualizer::objects {

/// By how much a depth sensor is wrong at 1 m, m: a standard deviation that grows with the square
/// of the distance, as that of sensors that triangulate.
struct DepthNoise {
  float at_one_m = kKinect;

  float at(float range) const { return at_one_m * range * range; }

  /// How far beside its place along the line of sight a point may seem to be, m.
  float reachAt(float range) const { return kSure * at(range); }

  /// How far from a surface a point on it may be, m: 15 mm, and at least nearly two steps of a
  /// Kinect's depth (3 mm at 1 m).
  float toleranceAt(float range) const {
    return 0.015F + std::max(0.005F * range * range, reachAt(range) - 0.015F);
  }

  static constexpr float kKinect = 0.0013F;  ///< m
  static constexpr float kSure = 4;          ///< standard deviations
};

/// Level surfaces on which things stand, such as a table or the floor: planes of at most 10° slope
/// so large that they are not taken for objects.
class SupportPlanes {
 public:
  /// \param points  in a frame whose z axis points up, m; more than kMostPoints take time
  /// \param sensor  where they were seen from
  /// \param least_area  of a surface that is seen, m²
  /// \param noise  of the sensor; without it, it is taken from the largest plane
  SupportPlanes(std::vector<Eigen::Vector3f> points, Eigen::Vector3f sensor, float least_area,
                std::optional<DepthNoise> noise = std::nullopt);

  /// What was given or estimated.
  const DepthNoise& noise() const { return noise_; }

  /// Whether a point lies on one of them, within what a depth sensor is wrong by at this distance.
  bool contain(const Eigen::Vector3f& point) const;

  /// The height of the highest one below a place, or in it, m: as it is seen within `radius` (m) of
  /// the place, because a plane may join two tables that differ by a little.
  std::optional<float> heightBelow(const Eigen::Vector3f& place, float radius) const;

  /// How far a point on a surface may be from it, m, with this noise.
  float tolerance(const Eigen::Vector3f& point) const;

  static constexpr std::size_t kMostPoints = 5000;

 private:
  using Plane = Eigen::Hyperplane<float, 3>;

  bool findNext(std::vector<Eigen::Vector3f>& points);
  Plane largest(const std::vector<Eigen::Vector3f>& points) const;
  bool isOn(const Plane& plane, const Eigen::Vector3f& point) const;
  float alongRay(const Plane& plane, const Eigen::Vector3f& point) const;
  void estimateNoise(const std::vector<Eigen::Vector3f>& points);

  Eigen::Vector3f sensor_;
  float least_area_;
  DepthNoise noise_;
  std::vector<Plane> planes_;                         ///< normals point up
  std::vector<std::vector<Eigen::Vector3f>> points_;  ///< of each plane
};

}  // namespace process_visualizer::objects
