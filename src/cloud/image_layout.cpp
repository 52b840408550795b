// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/image_layout.hpp"

#include <sensor_msgs/image_encodings.h>

#include <cstdint>
#include <map>
#include <string>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

namespace encodings = sensor_msgs::image_encodings;
using sensor_msgs::Image;

const std::map<std::string, ColorLayout> kColorLayouts{
    {encodings::RGB8, {0, 1, 2, 3}},  {encodings::BGR8, {2, 1, 0, 3}},
    {encodings::RGBA8, {0, 1, 2, 4}}, {encodings::BGRA8, {2, 1, 0, 4}},
    {encodings::MONO8, {0, 0, 0, 1}},
};

std::string size(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " px";
}

/// \param name  how the image is called in a message
void checkData(const Image& image, std::size_t pixel_size, const std::string& name) {
  require(image.width > 0 && image.height > 0, "the " + name + " has no pixels: " + size(image));
  const std::uint64_t row_size = std::uint64_t{image.width} * pixel_size;
  require(image.step >= row_size, "the " + name + "'s step " + std::to_string(image.step) +
                                      " is less than the " + std::to_string(row_size) +
                                      " bytes of a row");
  const std::uint64_t data_size = std::uint64_t{image.step} * image.height;
  require(image.data.size() >= data_size,
          "the " + name + "'s data is cut off: " + std::to_string(image.data.size()) +
              " bytes of " + std::to_string(data_size));
}

void checkFrame(const std::string& frame, const std::string& depth_frame, const std::string& name) {
  require(withoutLeadingSlash(frame) == withoutLeadingSlash(depth_frame),
          "the " + name + " has the frame '" + frame + "', the depth image '" + depth_frame +
              "'; register the depth image to the colour camera, for example with "
              "depth_image_proc/register");
}

}  // namespace

void checkDepthImage(const Image& depth) {
  const bool is_float = depth.encoding == encodings::TYPE_32FC1;
  require(is_float || depth.encoding == encodings::TYPE_16UC1,
          "the depth image's encoding is '" + depth.encoding + "', it must be 16UC1 or 32FC1");
  require(!depth.is_bigendian,
          "the depth image is big-endian, only little-endian depths are supported");
  checkData(depth, is_float ? sizeof(float) : sizeof(std::uint16_t), "depth image");
}

ColorLayout checkColorImage(const Image& color, const Image& depth) {
  const auto layout = kColorLayouts.find(color.encoding);
  require(layout != kColorLayouts.end(), "the colour image's encoding is '" + color.encoding +
                                             "', it must be rgb8, bgr8, rgba8, bgra8 or mono8");
  checkData(color, layout->second.pixel_size, "colour image");
  require(std::uint64_t{color.height} * depth.width >= std::uint64_t{depth.height} * color.width,
          "the colour image (" + size(color) + ") does not cover the depth image (" + size(depth) +
              ")");
  return layout->second;
}

void checkFrames(const Image& depth, const Image& color, const sensor_msgs::CameraInfo& info) {
  checkFrame(color.header.frame_id, depth.header.frame_id, "colour image");
  checkFrame(info.header.frame_id, depth.header.frame_id, "camera info");
}

}  // namespace process_visualizer::cloud
