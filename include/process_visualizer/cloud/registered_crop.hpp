// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colored points in a box, directly from registered depth and color images.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/cloud/pixel_rays.hpp"

namespace process_visualizer::cloud {

/// Computes the part of a colored cloud that lies in a box, in one pass over registered images.
///
/// The points equal those of depth_image_proc/point_cloud_xyzrgb followed by `cropToBox`, to the
/// last bit, if there is no distortion and the images have the same size. The full cloud (9.8 MB
/// for a Kinect), the main cost of that method, is never created.
class RegisteredCrop {
 public:
  /// \param lens  of the images, depth and color
  explicit RegisteredCrop(Lens lens) : lens_(lens) {}

  /// \param depth  z of each pixel: 16UC1 in mm or 32FC1 in m (0: not measured)
  /// \param color  rgb8, bgr8, rgba8, bgra8 or mono8, from the same viewpoint. An image of another
  ///               size is assumed to be scaled to the same width.
  /// \param info   of the camera; its frame is that of both images
  /// \param box_from_camera  transforms a point in the images' frame into the box's frame
  /// \return a cloud in the depth image's frame, with its stamp; fields x, y, z (m), rgb, in one
  ///         row without invalid points
  /// \throws std::invalid_argument that says what is wrong with the images or the info
  sensor_msgs::PointCloud2 crop(const sensor_msgs::Image& depth, const sensor_msgs::Image& color,
                                const sensor_msgs::CameraInfo& info,
                                const Eigen::Isometry3d& box_from_camera, const Box& box);

 private:
  const PixelRays& raysOf(const sensor_msgs::Image& depth, const sensor_msgs::CameraInfo& info);

  Lens lens_;
  std::optional<PixelRays> rays_;
  sensor_msgs::CameraInfo rays_info_;  ///< for which the rays were computed, without its header
  std::vector<std::uint8_t> points_;   ///< kept between calls: allocating it again takes longer
  std::uint32_t rays_width_, rays_height_;  ///< of the image for which they were computed, px
};

}  // namespace process_visualizer::cloud
