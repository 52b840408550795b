// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// Measure of how well points on surfaces hold a body, in the direction in which they hold it
/// least.
///
/// The information matrix of the distances from planes, divided by the number of points: its
/// eigenvalues say how much of a small motion is across the surfaces, on average (0: nothing).
/// Turns are about the center of the points, measured by how far they move a typical point, so
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

/// A cloud does not determine where its sensor is; the text says why.
class FitRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Result of a fit of a cloud to a model.
struct PoseFit {
  Eigen::Isometry3d correction;  ///< moves the cloud onto the model, in the model's frame
  double before_m;               ///< distance of the cloud from the surfaces, RMS, uncorrected
  double residual_m;             ///< and corrected
  std::size_t points;            ///< of the thinned cloud that lie on the model
  double determination;          ///< of the direction that is held least, from 0 to 1
};

/// Finds how a cloud has to be moved to lie on a model: ICP from point to plane, with ever smaller
/// distances, so that what nobody modeled does not count in the end.
///
/// \param cloud   in the model's frame, as the sensor's present pose says; m. NaN is left out.
/// \param sensor  where it was taken from, in the same frame
/// \param model   points with normals on all surfaces (`addPoints`), seen or not
/// \param spacing_m  of the model's points
/// \throws FitRefused if too little of the model is in the cloud, the cloud does not come to lie on
///         it, or a direction is left in which it could be moved
PoseFit fitPose(const pcl::PointCloud<pcl::PointXYZ>& cloud, const Eigen::Vector3f& sensor,
                const SurfaceCloud& model, double spacing_m);

}  // namespace process_visualizer::cloud
