// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace process_visualizer::objects {

// What may be a person, of whom hands, arms or legs are seen apart from the rest.

constexpr float kTall = 0.8F;     ///< m: what is higher may be a person,
constexpr float kLimbed = 0.5F;   ///< m: so may what moves and is so large,
constexpr float kArm = 0.7F;      ///< m: the tip of whose limb is no farther from the rest
constexpr float kLimbGap = 0.3F;  ///< m: no part of anything else is, nor the gap within a limb

/// Whether something of a size [m] may be a person.
inline bool mayBeSomebody(const Eigen::Vector3f& size, bool is_moving) {
  return size.z() > kTall || (is_moving && size.maxCoeff() > kLimbed);
}

}  // namespace process_visualizer::objects
