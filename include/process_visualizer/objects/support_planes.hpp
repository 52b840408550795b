// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Level surfaces that support objects (floor, tables): where they are and end; noise of the sensor.

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace process_visualizer::objects {

/// Standard deviation of a depth sensor's noise. It grows with the square of the distance, as that
/// of sensors that triangulate.
struct DepthNoise {
  float at_one_m = kKinect;  ///< m

  float at(float range) const { return at_one_m * range * range; }

  /// Maximum displacement of a point along the line of sight, m.
  float reachAt(float range) const { return kMaxDeviations * at(range); }

  /// Maximum distance between a surface and a point on it, m: 15 mm, and at least nearly two steps
  /// of a Kinect's depth (3 mm at 1 m).
  /// \param slope  sine of the angle between the surface and the line of sight, along which noise
  /// moves a point
  float toleranceAt(float range, float slope = 1) const {
    return 0.015F + std::max(0.005F * range * range, slope * reachAt(range) - 0.015F);
  }

  static constexpr float kKinect = 0.0013F;   ///< m
  static constexpr float kMaxDeviations = 4;  ///< standard deviations
};

/// Level surfaces on which objects stand, such as a table or the floor: planes with a slope of at
/// most 10°, too large for objects. A surface ends where the sensor looks past it, and where
/// something rises through its height, such as a wall or a person beside a table. The lowest one,
/// the floor, also continues where nothing is visible.
class SupportPlanes {
 public:
  /// \param points  in a frame whose z axis points up, m; more than kMaxPoints take time
  /// \param sensor  position of the sensor
  /// \param min_area  visible area of a surface, m²
  /// \param noise  of the sensor; if not given, it is estimated from the largest plane
  /// \param before  surfaces of an earlier cloud, which remain surfaces as long as half of
  /// `min_area` is visible, so that a partly hidden surface does not become an object
  /// \param upright  further points on no level surface, such as those of walls: they show where
  /// the sensor looks past one
  SupportPlanes(const std::vector<Eigen::Vector3f>& points, Eigen::Vector3f sensor, float min_area,
                std::optional<DepthNoise> noise = std::nullopt,
                const SupportPlanes* before = nullptr, std::vector<Eigen::Vector3f> upright = {});

  /// The given or estimated noise.
  const DepthNoise& noise() const { return noise_; }

  /// Returns whether a point lies on a surface, within the tolerance at its distance.
  bool contain(const Eigen::Vector3f& point) const;

  /// Height of the highest surface at or below a place, m. It is measured within `radius` (m) of
  /// the place, because a plane may span two tables of slightly different height.
  std::optional<float> heightBelow(const Eigen::Vector3f& place, float radius) const;

  /// Maximum distance between a surface and a point on it, m, with this noise.
  float tolerance(const Eigen::Vector3f& point) const;

  static constexpr std::size_t kMaxPoints = 10000;

 private:
  using Plane = Eigen::Hyperplane<float, 3>;

  /// A point with its tile and tolerance, which are computed once.
  struct Sample {
    Eigen::Vector3f place;
    std::size_t tile;
    float tolerance = 0;  ///< m
  };

  /// A horizontal grid of square tiles over the visible area.
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
    std::vector<Eigen::Vector3f> points;  ///< visible points on it
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
  float min_area_;
  DepthNoise noise_;
  Grid grid_;
  std::vector<Sample> samples_;           ///< only during construction
  std::vector<Eigen::Vector3f> upright_;  ///< likewise
  std::vector<Surface> surfaces_;         ///< the first one is the lowest
};

}  // namespace process_visualizer::objects
