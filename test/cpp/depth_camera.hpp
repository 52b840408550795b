// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"
#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// A camera that sees triangles as a Kinect does: 640 x 480 px, quantized depths with steps that
/// grow with the square of the distance, noise, and mixed pixels on edges.
class DepthCamera {
 public:
  static constexpr int kWidth = 640, kHeight = 480;
  static constexpr float kFocal = 525;
  static constexpr std::int8_t kNothing = -1, kMixed = -2;

  /// \param world_from_camera  z forward, x to the right
  explicit DepthCamera(const Eigen::Isometry3f& world_from_camera)
      : camera_from_world_(world_from_camera.inverse()),
        depths_(kWidth * kHeight, std::numeric_limits<float>::infinity()),
        things_(kWidth * kHeight, kNothing) {}

  /// Draws a surface, whose pixels get the label `thing`.
  void draw(const cloud::Surface& mesh, const Eigen::Isometry3f& world_from_mesh,
            std::int8_t thing) {
    const Eigen::Isometry3f transform = camera_from_world_ * world_from_mesh;
    for (const auto& [a, b, c] : mesh) draw({transform * a, transform * b, transform * c}, thing);
  }

  /// The label of each pixel.
  const std::vector<std::int8_t>& things() const { return things_; }

  /// Returns the cloud in the camera's frame; NaN where there is nothing. Half of the pixels on
  /// edges are mixed, and have the label `kMixed` from then on.
  Points points(std::mt19937& random) {
    const std::vector<float> depths = mixed(random);
    Points points;
    points.width = kWidth;
    points.height = kHeight;
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column)
        points.places.push_back(ray(row, column) * measured(depths[row * kWidth + column], random));
    return points;
  }

 private:
  static Eigen::Vector3f ray(int row, int column) {
    return {(static_cast<float>(column) - 319.5F) / kFocal,
            (static_cast<float>(row) - 239.5F) / kFocal, 1};
  }

  /// A step of the disparity (1/8 px) is 2.87 mm at 1 m (Khoshelham and Elberink 2012).
  static float measured(float depth, std::mt19937& random) {
    if (!std::isfinite(depth)) return std::numeric_limits<float>::quiet_NaN();
    std::normal_distribution<float> noise(0, 0.35F);
    return 348 / std::round(348 / depth + noise(random));
  }

  /// The depths, with mixed pixels on half of the edges.
  std::vector<float> mixed(std::mt19937& random) {
    std::vector<float> depths = depths_;
    std::uniform_real_distribution<float> part(0, 1);
    for (std::size_t pixel = 0; pixel + 1 < depths_.size(); ++pixel) {
      const float here = depths_[pixel], beside = depths_[pixel + 1];
      if (std::abs(here - beside) < 0.05F || !std::isfinite(here) || !std::isfinite(beside) ||
          part(random) < 0.5F)
        continue;
      const std::size_t farther = here > beside ? pixel : pixel + 1;
      depths[farther] = here + (beside - here) * part(random);
      things_[farther] = kMixed;
    }
    return depths;
  }

  /// Draws the pixels whose centers lie in a triangle in front of the camera.
  void draw(const cloud::Triangle& triangle, std::int8_t thing) {
    const auto& [a, b, c] = triangle;
    if (std::min({a.z(), b.z(), c.z()}) < 0.05F) return;
    const Eigen::Vector3f normal = (b - a).cross(c - a);
    Eigen::AlignedBox<float, 2> box;
    for (const Eigen::Vector3f& corner : triangle)
      box.extend(Eigen::Vector2f(corner.head<2>() * (kFocal / corner.z())));
    const int first_row = std::max(0, static_cast<int>(box.min().y() + 239.5F));
    const int last_row = std::min(kHeight - 1, static_cast<int>(box.max().y() + 240.5F));
    const int first_column = std::max(0, static_cast<int>(box.min().x() + 319.5F));
    const int last_column = std::min(kWidth - 1, static_cast<int>(box.max().x() + 320.5F));
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        const Eigen::Vector3f direction = ray(row, column);
        if (!isInside(triangle, direction)) continue;
        const float depth = normal.dot(a) / normal.dot(direction);
        const std::size_t pixel = static_cast<std::size_t>(row) * kWidth + column;
        if (!(depth > 0) || depth >= depths_[pixel]) continue;
        depths_[pixel] = depth;
        things_[pixel] = thing;
      }
    }
  }

  /// Returns whether a ray from the origin hits a triangle, on one side of all three edges.
  static bool isInside(const cloud::Triangle& triangle, const Eigen::Vector3f& ray) {
    const auto& [a, b, c] = triangle;
    const float ab = ray.dot(a.cross(b)), bc = ray.dot(b.cross(c)), ca = ray.dot(c.cross(a));
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  }

  Eigen::Isometry3f camera_from_world_;
  std::vector<float> depths_;
  std::vector<std::int8_t> things_;
};

/// Pose of a camera that looks straight down, with the image's upper edge towards y.
inline Eigen::Isometry3f lookingDown(const Eigen::Vector3f& place) {
  return Eigen::Translation3f(place) *
         Eigen::AngleAxisf(static_cast<float>(M_PI), Eigen::Vector3f::UnitX());
}

}  // namespace process_visualizer::objects
