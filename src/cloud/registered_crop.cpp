// SPDX-License-Identifier: BSD-3-Clause
// Checks of depth and color images, and the loop over their pixels that keeps points in the box.

#include "process_visualizer/cloud/registered_crop.hpp"

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/cloud_layout.hpp"
#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

/// Offsets of the colors within a pixel, bytes.
struct ColorLayout {
  std::size_t red, green, blue;
  std::size_t pixel_size;
};

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

/// \param name  of the image in a problem's text
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
              "'; register the depth image to the color camera, for example with "
              "depth_image_proc/register");
}

/// Checks a depth image, so that every byte read later exists.
/// \throws std::invalid_argument that says what is wrong
void checkDepthImage(const Image& depth) {
  const bool is_float = depth.encoding == encodings::TYPE_32FC1;
  require(is_float || depth.encoding == encodings::TYPE_16UC1,
          "the depth image's encoding is '" + depth.encoding + "'; it must be 16UC1 or 32FC1");
  require(!depth.is_bigendian,
          "the depth image is big-endian; only little-endian depths are supported");
  checkData(depth, is_float ? sizeof(float) : sizeof(std::uint16_t), "depth image");
}

/// The same for a color image; scaled to the width of the depth image, it must cover that.
ColorLayout checkColorImage(const Image& color, const Image& depth) {
  const auto layout = kColorLayouts.find(color.encoding);
  require(layout != kColorLayouts.end(), "the color image's encoding is '" + color.encoding +
                                             "'; it must be rgb8, bgr8, rgba8, bgra8 or mono8");
  checkData(color, layout->second.pixel_size, "color image");
  require(
      std::uint64_t{color.height} * depth.width >= std::uint64_t{depth.height} * color.width,
      "the color image (" + size(color) + ") does not cover the depth image (" + size(depth) + ")");
  return layout->second;
}

/// Checks that images and camera info belong to one camera: registered images have one frame.
void checkFrames(const Image& depth, const Image& color, const sensor_msgs::CameraInfo& info) {
  checkFrame(color.header.frame_id, depth.header.frame_id, "color image");
  checkFrame(info.header.frame_id, depth.header.frame_id, "camera info");
}

using sensor_msgs::Image;
using sensor_msgs::PointCloud2;

/// Meaning of the values of a depth image.
template <typename Value>
struct Depth;

template <>
struct Depth<std::uint16_t> {
  static constexpr float kUnit = 0.001f;  ///< m
  static bool isMeasured(std::uint16_t value) { return value != 0; }
};

template <>
struct Depth<float> {
  static constexpr float kUnit = 1;  ///< m
  static bool isMeasured(float value) { return std::isfinite(value) && value > 0; }
};

template <typename Value>
Value read(const std::uint8_t* bytes) {
  Value value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// The colors of depth pixels: those of the nearest pixels of the color image.
class ColorPlaces {
 public:
  ColorPlaces(const Image& color, const Image& depth, const ColorLayout& layout)
      : color_(color), depth_width_(depth.width), layout_(layout) {
    columns_.reserve(depth.width);
    for (std::uint32_t column = 0; column < depth.width; ++column)
      columns_.push_back(nearest(column) * layout.pixel_size);
  }

  const std::uint8_t* row(std::uint32_t depth_row) const {
    return color_.data.data() + nearest(depth_row) * color_.step;
  }

  ColoredPoint point(const Eigen::Vector3f& position, const std::uint8_t* row,
                     std::size_t column) const {
    const std::uint8_t* pixel = row + columns_[column];
    return makePoint(position, pixel[layout_.red], pixel[layout_.green], pixel[layout_.blue]);
  }

 private:
  /// The color's row or column under the middle of a row or column of the depth image.
  std::size_t nearest(std::uint32_t number) const {
    return (2 * std::uint64_t{number} + 1) * color_.width / (2 * std::uint64_t{depth_width_});
  }

  const Image& color_;
  std::uint32_t depth_width_;
  ColorLayout layout_;
  std::vector<std::size_t> columns_;  ///< bytes from the beginning of a row
};

/// The crop of one pair of images, row by row.
template <typename Value>
class ImageCrop {
 public:
  ImageCrop(const Image& depth, const PixelRays& rays, const ColorPlaces& colors,
            const PixelRange& range, InsideBox is_inside)
      : depth_(depth),
        rays_(rays),
        colors_(colors),
        range_(range),
        is_inside_(std::move(is_inside)),
        meters_per_pixel_((double{Depth<Value>::kUnit} / rays.focal().array()).cast<float>()),
        row_(depth.width) {}

  void appendTo(std::vector<std::uint8_t>& points) {
    for (std::uint32_t row = range_.begin_row; row < range_.end_row; ++row) {
      const auto* begin = reinterpret_cast<const std::uint8_t*>(row_.data());
      points.insert(points.end(), begin, begin + cropRow(row) * sizeof(ColoredPoint));
    }
  }

 private:
  /// Writes the points of a row that lie in the box into `row_`, and returns their number.
  std::size_t cropRow(std::uint32_t row) {
    const std::uint8_t* depths = depth_.data.data() + std::size_t{row} * depth_.step;
    const std::uint8_t* colors = colors_.row(row);
    const Eigen::Vector2f* rays = rays_.row(row);
    std::size_t count = 0;
    for (std::size_t column = range_.begin_column; column < range_.end_column; ++column) {
      const auto depth = read<Value>(depths + column * sizeof(Value));
      if (!Depth<Value>::isMeasured(depth)) continue;
      const Eigen::Vector3f position = pointAt(rays[column], depth);
      if (is_inside_(position)) row_[count++] = colors_.point(position, colors, column);
    }
    return count;
  }

  /// The operations in the order of depth_image_proc, so that results are equal to the last bit.
  Eigen::Vector3f pointAt(const Eigen::Vector2f& ray, float depth) const {
    return {ray.x() * depth * meters_per_pixel_.x(), ray.y() * depth * meters_per_pixel_.y(),
            depth * Depth<Value>::kUnit};
  }

  const Image& depth_;
  const PixelRays& rays_;
  const ColorPlaces& colors_;
  PixelRange range_;  ///< of the pixels that can see the box
  InsideBox is_inside_;
  Eigen::Vector2f meters_per_pixel_;  ///< at a depth of 1 in the image's unit
  std::vector<ColoredPoint> row_;
};

}  // namespace

PointCloud2 RegisteredCrop::crop(const Image& depth, const Image& color,
                                 const sensor_msgs::CameraInfo& info,
                                 const Eigen::Isometry3d& box_from_camera, const Box& box) {
  checkFrames(depth, color, info);
  checkDepthImage(depth);
  const ColorPlaces colors(color, depth, checkColorImage(color, depth));
  const PixelRays& rays = raysOf(depth, info);
  const PixelRange range = rays.rangeOf(box_from_camera.inverse() * box.corners());
  const InsideBox is_inside(box_from_camera, box);
  const bool is_float = depth.encoding == sensor_msgs::image_encodings::TYPE_32FC1;
  points_.clear();
  if (is_float)
    ImageCrop<float>(depth, rays, colors, range, is_inside).appendTo(points_);
  else
    ImageCrop<std::uint16_t>(depth, rays, colors, range, is_inside).appendTo(points_);
  return makeColoredCloud(depth.header, points_);
}

const PixelRays& RegisteredCrop::raysOf(const Image& depth, const sensor_msgs::CameraInfo& info) {
  sensor_msgs::CameraInfo timeless = info;
  timeless.header = {};
  const bool is_known =
      rays_ && timeless == rays_info_ && depth.width == rays_width_ && depth.height == rays_height_;
  if (!is_known) {
    rays_.emplace(info, depth.width, depth.height, lens_);
    rays_info_ = timeless;
    rays_width_ = depth.width;
    rays_height_ = depth.height;
  }
  return *rays_;
}

}  // namespace process_visualizer::cloud
