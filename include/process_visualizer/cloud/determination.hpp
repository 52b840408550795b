// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// How well points on surfaces hold a body, in the direction in which they hold it least.
///
/// The information matrix of the distances from planes, divided by the number of points: its
/// eigenvalues say how much of a small motion is across the surfaces, on average (0: nothing).
/// Turns are about the centre of the points, measured by how far they move a typical point, so
/// that turns and shifts can be compared.
class Determination {
 public:
  /// \param points  with normals; at least one
  explicit Determination(const SurfaceCloud& points);

  double weakest() const { return weakest_; }  ///< the smallest eigenvalue

  /// The motion that nothing holds, in words: "a shift along z", "a turn about x".
  std::string freeMotion() const;

 private:
  double weakest_;
  Eigen::Matrix<double, 6, 1> motion_;  ///< of the smallest eigenvalue: a turn, then a shift
};

}  // namespace process_visualizer::cloud
