// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Camera model: the viewing ray of each pixel, from the camera info, and the pixels that see a box.

#include <sensor_msgs/CameraInfo.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace process_visualizer::cloud {

/// State of the images: distorted by the lens, or already rectified. Messages do not contain it: a
/// raw and a rectified image have the same camera info.
enum class Lens { kDistorts, kRectified };

/// A rectangle of pixels; the end column and row are exclusive.
struct PixelRange {
  std::uint32_t begin_column, begin_row, end_column, end_row;
};

/// Viewing rays of a camera's pixels, computed once for each camera info.
///
/// A pixel's ray is its position in an image without distortion, in px from the principal point: a
/// point at depth z (m) on it lies at (ray.x / focal.x * z, ray.y / focal.y * z, z). The ray is NaN
/// for pixels that the lens model cannot undistort.
class PixelRays {
 public:
  /// \param info    K and D for raw images (distortion model plumb_bob), P for rectified ones and
  ///                those without distortion; binning and region of interest are respected. An
  ///                image of another size than the info's is assumed to be scaled to its own width.
  /// \param width   of the image, px
  /// \param height  of the image, px
  /// \throws std::invalid_argument that says what is wrong with the info
  PixelRays(const sensor_msgs::CameraInfo& info, std::uint32_t width, std::uint32_t height,
            Lens lens);

  const Eigen::Vector2d& focal() const { return focal_; }  ///< focal lengths fx and fy, px

  /// The pixels that can see points within the corners of a box; all pixels if the lens distorts,
  /// or if a corner is not in front of the camera.
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
