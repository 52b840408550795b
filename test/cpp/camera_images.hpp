// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/distortion_models.h>
#include <sensor_msgs/image_encodings.h>

#include <cstdint>
#include <cstring>
#include <random>
#include <string>

namespace process_visualizer::cloud {

/// Images and camera info that arrive together.
struct CameraImages {
  sensor_msgs::Image depth, color;
  sensor_msgs::CameraInfo info;
};

template <typename Value>
void setDepth(sensor_msgs::Image& depth, std::uint32_t column, std::uint32_t row, Value value) {
  std::memcpy(&depth.data[row * depth.step + column * sizeof(Value)], &value, sizeof(Value));
}

inline sensor_msgs::Image makeImage(const std::string& encoding, std::uint32_t width,
                                    std::uint32_t height) {
  namespace encodings = sensor_msgs::image_encodings;
  sensor_msgs::Image image;
  image.header.frame_id = "camera";
  image.header.stamp = ros::Time(12, 34);
  image.encoding = encoding;
  image.width = width;
  image.height = height;
  image.step = width * encodings::numChannels(encoding) * encodings::bitDepth(encoding) / 8;
  image.data.resize(image.step * height);
  return image;
}

inline sensor_msgs::CameraInfo makeInfo(std::uint32_t width, std::uint32_t height) {
  sensor_msgs::CameraInfo info;
  info.header.frame_id = "camera";
  info.width = width;
  info.height = height;
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0);
  const double focal = 0.82 * width, x = 0.49 * width, y = 0.51 * height;
  info.K = {focal, 0, x, 0, focal, y, 0, 0, 1};
  info.P = {focal, 0, x, 0, 0, focal, y, 0, 0, 0, 1, 0};
  return info;
}

/// A depth of 0.5 to 2.5 m everywhere (in a tenth of the pixels none), and arbitrary colors.
inline CameraImages makeImages(const std::string& depth_encoding = "16UC1",
                               const std::string& color_encoding = "rgb8", std::uint32_t width = 64,
                               std::uint32_t height = 48) {
  CameraImages images{makeImage(depth_encoding, width, height),
                      makeImage(color_encoding, width, height), makeInfo(width, height)};
  std::mt19937 generator(1);
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      const std::uint16_t millimetres = generator() % 10 == 0 ? 0 : 500 + generator() % 2000;
      if (depth_encoding == "32FC1")
        setDepth<float>(images.depth, column, row,
                        millimetres == 0 ? NAN : static_cast<float>(millimetres) / 1000);
      else
        setDepth<std::uint16_t>(images.depth, column, row, millimetres);
    }
  }
  for (std::uint8_t& byte : images.color.data) byte = generator();
  return images;
}

}  // namespace process_visualizer::cloud
