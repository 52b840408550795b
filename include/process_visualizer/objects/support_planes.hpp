// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
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
  /// \param slope  sine of the angle between the line of sight, along which the noise moves a
  /// point, and the surface
  float toleranceAt(float range, float slope = 1) const {
    return 0.015F + std::max(0.005F * range * range, slope * reachAt(range) - 0.015F);
  }

  static constexpr float kKinect = 0.0013F;  ///< m
  static constexpr float kSure = 4;          ///< standard deviations
};

/// Level surfaces on which things stand, such as a table or the floor: planes of at most 10° slope
/// so large that they are not taken for objects. A surface ends where the sensor looks past it, and
/// where something rises through its height, such as a wall or a person beside a table; only the
/// lowest one, the floor, is everywhere.
class SupportPlanes {
 public:
  /// \param points  in a frame whose z axis points up, m; more than kMostPoints take time
  /// \param sensor  where they were seen from
  /// \param least_area  of a surface that is seen, m²
  /// \param noise  of the sensor; without it, it is taken from the largest plane
  /// \param before  those of an earlier cloud: what was a surface then is one as long as half of
  /// `least_area` is seen, so that nothing becomes an object because somebody hides a part of it
  /// \param upright  further points, which are on no level surface, such as those of walls: they
  /// show where the sensor looks past one
  SupportPlanes(const std::vector<Eigen::Vector3f>& points, Eigen::Vector3f sensor,
                float least_area, std::optional<DepthNoise> noise = std::nullopt,
                const SupportPlanes* before = nullptr, std::vector<Eigen::Vector3f> upright = {});

  /// What was given or estimated.
  const DepthNoise& noise() const { return noise_; }

  /// Whether a point lies on one of them, within what a depth sensor is wrong by at this distance.
  bool contain(const Eigen::Vector3f& point) const;

  /// The height of the highest one below a place, or in it, m: as it is seen within `radius` (m) of
  /// the place, because a plane may join two tables that differ by a little.
  std::optional<float> heightBelow(const Eigen::Vector3f& place, float radius) const;

  /// How far a point on a surface may be from it, m, with this noise.
  float tolerance(const Eigen::Vector3f& point) const;

  static constexpr std::size_t kMostPoints = 10000;

 private:
  using Plane = Eigen::Hyperplane<float, 3>;

  /// A point, and what is asked of it again and again.
  struct Sample {
    Eigen::Vector3f place;
    std::size_t tile;
    float tolerance = 0;  ///< m
  };

  /// A division of what is seen, from above, into square tiles.
  struct Grid {
    Eigen::Vector2f corner = Eigen::Vector2f::Zero();
    std::size_t columns = 0, rows = 0;

    std::size_t size() const { return columns * rows; }
    std::optional<std::size_t> tileAt(const Eigen::Vector3f& place) const;
  };

  enum class Kind : std::uint8_t { kUnseen, kPassed, kCrossed, kLevel, kSteep };
  enum class Extent : std::uint8_t { kThere, kUnknown, kPassed, kNotThere };

  struct Surface {
    Plane plane;                          ///< its normal points up
    std::vector<Extent> extent;           ///< in each tile
    std::vector<Eigen::Vector3f> points;  ///< that are seen of it
  };

  float toleranceAt(const Eigen::Vector3f& point, const DepthNoise& noise) const;
  void setNoise(const DepthNoise& noise);
  void estimateNoise();
  std::vector<Sample> levelSamples() const;
  bool findNext(std::vector<Sample>& level, const SupportPlanes* before);
  static Plane largest(const std::vector<Sample>& samples);
  std::vector<Kind> kindsOf(const Plane& plane) const;
  std::vector<std::size_t> reached(const std::vector<Kind>& kinds) const;
  std::vector<Extent> extentOf(const Plane& plane, const SupportPlanes* before) const;
  Eigen::Vector3f middleOf(std::size_t tile, const Plane& plane) const;
  float alongRay(const Plane& plane, const Eigen::Vector3f& point) const;
  bool isThere(const Surface& surface, const Eigen::Vector3f& place) const;

  Eigen::Vector3f sensor_;
  float least_area_;
  DepthNoise noise_;
  Grid grid_;
  std::vector<Sample> samples_;           ///< while the surfaces are sought
  std::vector<Eigen::Vector3f> upright_;  ///< also
  std::vector<Surface> surfaces_;         ///< the lowest one first
};

}  // namespace process_visualizer::objects
