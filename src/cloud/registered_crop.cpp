// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/registered_crop.hpp"

#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/colored_cloud.hpp"
#include "process_visualizer/cloud/image_layout.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::Image;
using sensor_msgs::PointCloud2;

/// What the values of a depth image mean.
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

/// Where the colours of depth pixels are, at the nearest pixel of the colour image.
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
  /// The colour's row or column under the middle of a row or column of the depth image.
  std::size_t nearest(std::uint32_t number) const {
    return (2 * std::uint64_t{number} + 1) * color_.width / (2 * std::uint64_t{depth_width_});
  }

  const Image& color_;
  std::uint32_t depth_width_;
  ColorLayout layout_;
  std::vector<std::size_t> columns_;  ///< bytes from the begin of a row
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
        metres_per_pixel_((double{Depth<Value>::kUnit} / rays.focal().array()).cast<float>()),
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

  /// In the order of depth_image_proc, so that the results are equal to the last bit.
  Eigen::Vector3f pointAt(const Eigen::Vector2f& ray, float depth) const {
    return {ray.x() * depth * metres_per_pixel_.x(), ray.y() * depth * metres_per_pixel_.y(),
            depth * Depth<Value>::kUnit};
  }

  const Image& depth_;
  const PixelRays& rays_;
  const ColorPlaces& colors_;
  PixelRange range_;  ///< of the pixels that can see the box
  InsideBox is_inside_;
  Eigen::Vector2f metres_per_pixel_;  ///< at a depth of 1 in the image's unit
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
