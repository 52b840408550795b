// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace process_visualizer::cloud {

/// State of the images: distorted by the lens, or rectified already. The messages do not say:
/// a raw and a rectified image have the same camera info.
enum class Lens { kDistorts, kRectified };

/// A rectangle of pixels, from the first column and row up to the last ones, exclusively.
struct PixelRange {
  std::uint32_t begin_column, begin_row, end_column, end_row;
};

/// Viewing rays of a camera's pixels, computed once for every camera info.
///
/// A pixel's ray is its place in an image without distortion, in px from the principal point: a
/// point at depth z (m) on it lies at (ray.x / focal.x * z, ray.y / focal.y * z, z). Where a
/// distorted image shows nothing that the lens's model knows, the ray is NaN.
class PixelRays {
 public:
  /// \param info    K and D of raw images (distortion model plumb_bob), P of rectified ones and of
  ///                those without distortion; binning and region of interest are respected. An
  ///                image of another size than the info's is taken to be scaled to its own width.
  /// \param width   of the image, px
  /// \param height  of the image, px
  /// \throws std::invalid_argument that says what is wrong with the info
  PixelRays(const sensor_msgs::CameraInfo& info, std::uint32_t width, std::uint32_t height,
            Lens lens);

  const Eigen::Vector2d& focal() const { return focal_; }  ///< focal lengths fx and fy, px

  /// The pixels that can see points at the corners of a box, or between them; all pixels where the
  /// lens distorts, or a corner is not in front of the camera.
  /// \param corners  in the camera's frame, m
  PixelRange rangeOf(const Eigen::Matrix<double, 3, 8>& corners) const;

  /// The rays of a row's pixels, from left to right.
  const Eigen::Vector2f* row(std::size_t number) const { return &rays_[number * width_]; }

 private:
  PixelRange whole_;
  bool is_distorted_;
  Eigen::Vector2d focal_, center_;
  std::size_t width_;
  std::vector<Eigen::Vector2f> rays_;
};

}  // namespace process_visualizer::cloud
