// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sizes by which an object may be a person, and how far a limb may be from the rest of one.

#include <Eigen/Core>

namespace process_visualizer::objects {

// Sizes of persons, whose hands, arms or legs may be seen separately from the rest.

constexpr float kMinPersonHeight = 0.8F;      ///< m: anything higher may be a person
constexpr float kMinMovingPersonSize = 0.5F;  ///< m: so may anything larger that moves
constexpr float kMaxReach = 0.7F;    ///< m: distance of the tip of a limb from the rest of a person
constexpr float kMaxLimbGap = 0.3F;  ///< m: gap within a limb, or to a part of any other object

/// Returns whether an object of a size [m] may be a person.
inline bool mayBePerson(const Eigen::Vector3f& size, bool is_moving) {
  return size.z() > kMinPersonHeight || (is_moving && size.maxCoeff() > kMinMovingPersonSize);
}

}  // namespace process_visualizer::objects
