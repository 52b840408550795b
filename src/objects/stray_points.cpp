// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/stray_points.hpp"

#include <cmath>
#include <limits>

namespace process_visualizer::objects {
namespace {

constexpr int kFewNeighbours = 4;  // of eight

/// The distance of each pixel's point from the sensor where it is free; where it is not, it is like
/// no other.
std::vector<float> freeRanges(const PointImage& image, const Points& points,
                              const std::vector<Label>& labels) {
  std::vector<float> ranges(image.points.size(), -std::numeric_limits<float>::infinity());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::int32_t point = image.points[pixel];
    if (point != kNoPoint && labels[point] == Label::kFree)
      ranges[pixel] = points.places[point].norm();
  }
  return ranges;
}

}  // namespace

void markStrayPoints(const Points& points, std::vector<Label>& labels) {
  const PointImage image = imageOf(points);
  if (image.points.empty()) return;
  const std::vector<float> ranges = freeRanges(image, points, labels);
  const auto row = static_cast<std::ptrdiff_t>(image.width);
  // Those beside it first: they are most often alike, and four are enough.
  const std::ptrdiff_t around[] = {-1, 1, -row, row, -row - 1, -row + 1, row - 1, row + 1};
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    if (!(ranges[pixel] >= 0)) continue;
    const float tolerance = toleranceAt(ranges[pixel]);
    int alike = 0;
    for (const std::ptrdiff_t step : around) {
      if (std::abs(ranges[pixel + step] - ranges[pixel]) < tolerance) ++alike;
      if (alike == kFewNeighbours) break;
    }
    if (alike < kFewNeighbours) labels[image.points[pixel]] = Label::kStray;
  }
}

}  // namespace process_visualizer::objects
