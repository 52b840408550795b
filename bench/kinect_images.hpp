// SPDX-License-Identifier: BSD-3-Clause
/// Images of the size and with the noise of a Kinect's images.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/distortion_models.h>

#include <cstdint>
#include <cstring>
#include <random>

constexpr std::uint32_t kWidth = 640, kHeight = 480;

inline sensor_msgs::Image image(const char* encoding, std::uint32_t pixel_size) {
  sensor_msgs::Image image;
  image.header.frame_id = "camera";
  image.encoding = encoding;
  image.width = kWidth;
  image.height = kHeight;
  image.step = kWidth * pixel_size;
  image.data.resize(image.step * kHeight);
  return image;
}

/// \param distortion  the first coefficient of plumb_bob; the others are 0
inline sensor_msgs::CameraInfo cameraInfo(double distortion = 0) {
  constexpr double kFocalPx = 525, kCenterX = (kWidth - 1) / 2.0, kCenterY = (kHeight - 1) / 2.0;
  sensor_msgs::CameraInfo info;
  info.header.frame_id = "camera";
  info.width = kWidth;
  info.height = kHeight;
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D = {distortion, 0, 0, 0, 0};
  info.K = {kFocalPx, 0, kCenterX, 0, kFocalPx, kCenterY, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {kFocalPx, 0, kCenterX, 0, 0, kFocalPx, kCenterY, 0, 0, 0, 1, 0};
  return info;
}

/// A plane 2 m in front of the camera, with a Kinect's noise, and no depth in a tenth of the
/// pixels.
inline sensor_msgs::Image depthImage() {
  sensor_msgs::Image depth = image("16UC1", 2);
  std::mt19937 generator(1);
  std::normal_distribution<float> distance(2000, 8);
  for (std::size_t pixel = 0; pixel < kWidth * kHeight; ++pixel) {
    const auto millimeters =
        static_cast<std::uint16_t>(generator() % 10 == 0 ? 0 : distance(generator));
    std::memcpy(&depth.data[2 * pixel], &millimeters, sizeof(millimeters));
  }
  return depth;
}
