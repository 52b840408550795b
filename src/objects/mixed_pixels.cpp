// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/mixed_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr int kReach = 2;               // px: how far from an edge pixels see both sides
constexpr float kBehind = 0.02F;        // m
constexpr int kFewNeighbours = 3;       // of eight
constexpr double kMostPixels = 4e6;     // of an image that is made of any points
constexpr float kNoise = 0.003F;        // of a Kinect's depth: a step at 1 m, m
constexpr std::int32_t kNoPoint = -1;

/// Looks at points as pixels with labels.
class LabelledImage {
 public:
  LabelledImage(const PixelImage& image, const std::vector<Vector3f>& points,
                std::vector<Label>& labels)
      : image_(image), points_(points), labels_(labels) {}

  std::vector<std::int32_t> mixedPixels() const {
    std::vector<std::int32_t> found;
    for (std::size_t row = 0; row < image_.height; ++row)
      for (std::size_t column = 0; column < image_.width; ++column)
        if (isAtEdge(row, column)) addMixedAround(row, column, found);
    return found;
  }

 private:
  std::int32_t pointAt(std::size_t row, std::size_t column) const {
    // What lies beyond the first row or column has become a huge number.
    if (row >= image_.height || column >= image_.width) return kNoPoint;
    return image_.points[row * image_.width + column];
  }

  bool has(std::int32_t point, Label label) const {
    return point != kNoPoint && labels_[point] == label;
  }

  /// Whether the pixel is on a known body, and the one beside it is not.
  bool isAtEdge(std::size_t row, std::size_t column) const {
    if (!has(image_.points[row * image_.width + column], Label::kKnown)) return false;
    return !has(pointAt(row, column - 1), Label::kKnown) ||
           !has(pointAt(row, column + 1), Label::kKnown) ||
           !has(pointAt(row - 1, column), Label::kKnown) ||
           !has(pointAt(row + 1, column), Label::kKnown);
  }

  void addMixedAround(std::size_t row, std::size_t column, std::vector<std::int32_t>& found) const {
    const float edge = points_[pointAt(row, column)].norm();
    for (int up = -kReach; up <= kReach; ++up) {
      for (int aside = -kReach; aside <= kReach; ++aside) {
        const std::int32_t point = pointAt(row + up, column + aside);
        if (has(point, Label::kFree) && points_[point].norm() > edge + kBehind &&
            neighbours(row + up, column + aside) < kFewNeighbours)
          found.push_back(point);
      }
    }
  }

  /// How many of the eight pixels around one are about as far away as it is, and free.
  int neighbours(std::size_t row, std::size_t column) const {
    const float range = points_[pointAt(row, column)].norm();
    const float tolerance = 0.01F + 2 * kNoise * range * range;
    int count = 0;
    for (int up = -1; up <= 1; ++up) {
      for (int aside = -1; aside <= 1; ++aside) {
        const std::int32_t point = pointAt(row + up, column + aside);
        if ((up != 0 || aside != 0) && has(point, Label::kFree) &&
            std::abs(points_[point].norm() - range) < tolerance)
          ++count;
      }
    }
    return count;
  }

  const PixelImage& image_;
  const std::vector<Vector3f>& points_;
  std::vector<Label>& labels_;
};

}  // namespace

PixelImage imageOf(std::size_t width, std::size_t height) {
  PixelImage image{width, height, std::vector<std::int32_t>(width * height)};
  std::iota(image.points.begin(), image.points.end(), 0);
  return image;
}

PixelImage imageOf(const std::vector<Vector3f>& points, double focal) {
  Eigen::AlignedBox2f range;
  const auto pixelOf = [focal](const Vector3f& point) -> Eigen::Vector2f {
    return point.head<2>() * (static_cast<float>(focal) / point.z());
  };
  const auto isInFront = [](const Vector3f& point) { return point.allFinite() && point.z() > 0; };
  for (const Vector3f& point : points)
    if (isInFront(point)) range.extend(pixelOf(point));
  if (range.isEmpty() || !(range.sizes().cast<double>().prod() < kMostPixels)) return {};
  PixelImage image;
  image.width = static_cast<std::size_t>(range.sizes().x()) + 2;
  image.height = static_cast<std::size_t>(range.sizes().y()) + 2;
  if (static_cast<double>(image.width) * static_cast<double>(image.height) > kMostPixels) return {};
  image.points.assign(image.width * image.height, kNoPoint);
  for (std::size_t index = 0; index < points.size(); ++index) {
    if (!isInFront(points[index])) continue;
    const Eigen::Vector2f place = (pixelOf(points[index]) - range.min()).array() + 0.5F;
    image.points[static_cast<std::size_t>(place.y()) * image.width +
                 static_cast<std::size_t>(place.x())] = static_cast<std::int32_t>(index);
  }
  return image;
}

void removeMixedPixels(const PixelImage& image, const std::vector<Vector3f>& points,
                       std::vector<Label>& labels) {
  for (const std::int32_t point : LabelledImage(image, points, labels).mixedPixels())
    labels[point] = Label::kKnown;
}

}  // namespace process_visualizer::objects
