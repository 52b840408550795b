// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/point_image.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <optional>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr double kMostPixels = 4e6;  // of an image that is made of any points

PointImage emptyImage(std::size_t width, std::size_t height) {
  return {width + 2, height + 2, std::vector<std::int32_t>((width + 2) * (height + 2), kNoPoint)};
}

PointImage imageOfRows(const Points& points) {
  PointImage image = emptyImage(points.width, points.height);
  for (std::size_t row = 0; row < points.height; ++row) {
    const auto begin = image.points.begin() + static_cast<std::ptrdiff_t>((row + 1) * image.width);
    std::iota(begin + 1, begin + 1 + static_cast<std::ptrdiff_t>(points.width),
              static_cast<std::int32_t>(row * points.width));
  }
  return image;
}

bool isInFront(const Vector3f& point) { return point.allFinite() && point.z() > 0; }

/// Where a camera with a focal length of 1 sees a point.
Vector2f projected(const Vector3f& point) { return point.head<2>() / point.z(); }

/// The width of pixels of a camera with a focal length of 1: the median distance of points that
/// follow each other from left to right.
std::optional<float> pixelWidth(const std::vector<Vector3f>& places) {
  std::vector<float> steps;
  for (std::size_t index = 1; index < places.size(); ++index) {
    if (!isInFront(places[index - 1]) || !isInFront(places[index])) continue;
    const float step = projected(places[index]).x() - projected(places[index - 1]).x();
    if (step > 1e-5F) steps.push_back(step);
  }
  if (steps.empty()) return std::nullopt;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Without any pixels if there are no such points, or they are too far apart.
PointImage imageOfAny(const Points& points) {
  const std::optional<float> width = pixelWidth(points.places);
  Eigen::AlignedBox<float, 2> range;
  for (const Vector3f& point : points.places)
    if (isInFront(point)) range.extend(projected(point));
  if (!width || range.isEmpty()) return {};
  const Eigen::Vector2d size = (range.sizes() / *width).cast<double>().array() + 1;
  if (!(size.prod() < kMostPixels)) return {};
  PointImage image =
      emptyImage(static_cast<std::size_t>(size.x()) + 1, static_cast<std::size_t>(size.y()) + 1);
  for (std::size_t index = 0; index < points.places.size(); ++index) {
    if (!isInFront(points.places[index])) continue;
    const Vector2f place =
        ((projected(points.places[index]) - range.min()) / *width).array() + 1.5F;
    image.points[static_cast<std::size_t>(place.y()) * image.width +
                 static_cast<std::size_t>(place.x())] = static_cast<std::int32_t>(index);
  }
  return image;
}

}  // namespace

PointImage imageOf(const Points& points) {
  return points.height > 1 ? imageOfRows(points) : imageOfAny(points);
}

}  // namespace process_visualizer::objects
