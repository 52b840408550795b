// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>

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

}  // namespace process_visualizer::objects
