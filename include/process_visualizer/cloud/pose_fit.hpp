// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of a sensor: fits its cloud to a model (ICP), and refuses fits that are not constrained.

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// Degree to which points on surfaces constrain the pose of a body, in the least constrained
/// direction.
///
/// It is taken from the information matrix of the distances from planes, divided by the number of
/// points. An eigenvalue is the mean share of a small motion that is across the surfaces (0: none).
/// Rotations are about the center of the points, measured by how far they move a typical point, so
/// that rotations and shifts are comparable.
class PoseObservability {
 public:
  /// \param points  with normals; at least one
  explicit PoseObservability(const SurfaceCloud& points);

  double weakest() const { return weakest_; }  ///< the smallest eigenvalue

  /// The least constrained motion, in words: "a shift along z", "a turn about x".
  std::string freeMotion() const;

 private:
  double weakest_;
  Eigen::Matrix<double, 6, 1> motion_;  ///< of the smallest eigenvalue: rotation, then shift
};

/// Error: a cloud does not determine the pose of its sensor; the text says why.
class FitRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Result of a fit of a cloud to a model.
struct PoseFit {
  Eigen::Isometry3d correction;  ///< moves the cloud onto the model, in the model's frame
  double before_m;               ///< distance of the cloud from the surfaces, RMS, uncorrected
  double residual_m;             ///< the same, corrected
  std::size_t points;            ///< of the thinned cloud that lie on the model
  double observability;          ///< of the least constrained direction, from 0 to 1
};

/// Finds the motion that puts a cloud onto a model: point-to-plane ICP with decreasing distances,
/// so that unmodeled objects do not count in the end.
///
/// \param cloud   in the model's frame, by the sensor's current pose; m. NaN is left out.
/// \param sensor  position of the sensor, in the same frame
/// \param model   points with normals on all surfaces (`addPoints`), visible or not
/// \param spacing_m  of the model's points
/// \throws FitRefused if too little of the model is in the cloud, the cloud cannot be fitted to it,
///         or a direction remains unconstrained
PoseFit fitPose(const pcl::PointCloud<pcl::PointXYZ>& cloud, const Eigen::Vector3f& sensor,
                const SurfaceCloud& model, double spacing_m);

}  // namespace process_visualizer::cloud
