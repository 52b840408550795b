// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstddef>

namespace process_visualizer::cloud {

/// Where the colours lie within a pixel, in bytes.
struct ColorLayout {
  std::size_t red, green, blue;
  std::size_t pixel_size;
};

/// Checks a depth image, so that every byte that is read later on exists.
/// \throws std::invalid_argument that says what is wrong
void checkDepthImage(const sensor_msgs::Image& depth);

/// The same for a colour image, which must cover the depth image when it is scaled to its width.
ColorLayout checkColorImage(const sensor_msgs::Image& color, const sensor_msgs::Image& depth);

/// Checks that images and camera info belong to one camera: registered images have one frame.
void checkFrames(const sensor_msgs::Image& depth, const sensor_msgs::Image& color,
                 const sensor_msgs::CameraInfo& info);

}  // namespace process_visualizer::cloud
