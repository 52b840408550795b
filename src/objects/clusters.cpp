// SPDX-License-Identifier: BSD-3-Clause
// Joins occupied voxels; estimates the orientation, extent and height of boxes despite noise.

#include "process_visualizer/objects/clusters.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::int64_t kBits = 21, kHalf = std::int64_t{1} << (kBits - 1);
constexpr std::int64_t kAlongY = std::int64_t{1} << kBits, kAlongZ = kAlongY << kBits;

/// Number of a voxel, by z, y, x. Voxels too far from the origin share the last one.
std::int64_t voxelOf(const Vector3f& point, float voxel) {
  const auto along = [&](int axis) {
    const double place = std::floor(static_cast<double>(point[axis]) / voxel);
    const auto limit = static_cast<double>(kHalf - 2);
    return static_cast<std::int64_t>(std::clamp(place, -limit, limit)) + kHalf;
  };
  return along(2) * kAlongZ + along(1) * kAlongY + along(0);
}

/// Points sorted by their voxels.
struct Sorted {
  std::vector<std::pair<std::int64_t, std::uint32_t>> points;  ///< voxel, index of the point
  std::vector<std::int64_t> voxels;                            ///< ascending
  std::vector<std::uint32_t> begins;  ///< index of each voxel's first point, and the end
};

Sorted sorted(const std::vector<Vector3f>& points, float voxel) {
  Sorted result;
  result.points.reserve(points.size());
  for (std::uint32_t index = 0; index < points.size(); ++index)
    result.points.emplace_back(voxelOf(points[index], voxel), index);
  std::sort(result.points.begin(), result.points.end());
  for (std::uint32_t place = 0; place < result.points.size(); ++place) {
    if (!result.voxels.empty() && result.voxels.back() == result.points[place].first) continue;
    result.voxels.push_back(result.points[place].first);
    result.begins.push_back(place);
  }
  result.begins.push_back(static_cast<std::uint32_t>(result.points.size()));
  return result;
}

/// Joins voxels that touch. The three neighbors along x follow each other in the order of voxels.
DisjointSets joined(const std::vector<std::int64_t>& voxels) {
  DisjointSets sets(voxels.size());
  for (std::uint32_t number = 0; number < voxels.size(); ++number) {
    for (const std::int64_t row :
         {std::int64_t{0}, kAlongY, kAlongZ - kAlongY, kAlongZ, kAlongZ + kAlongY}) {
      const std::int64_t middle = voxels[number] + row;
      const auto begin = std::lower_bound(voxels.begin(), voxels.end(), middle - 1);
      for (auto it = begin; it != voxels.end() && *it <= middle + 1; ++it)
        sets.join(number, static_cast<std::uint32_t>(it - voxels.begin()));
    }
  }
  return sets;
}

}  // namespace

std::vector<Indices> clustersOf(const std::vector<Vector3f>& points, float voxel,
                                std::size_t min_points) {
  const Sorted order = sorted(points, voxel);
  DisjointSets sets = joined(order.voxels);
  std::vector<Indices> by_first(order.voxels.size());
  for (std::uint32_t number = 0; number < order.voxels.size(); ++number) {
    Indices& cluster = by_first[sets.first(number)];
    for (std::uint32_t place = order.begins[number]; place < order.begins[number + 1]; ++place)
      cluster.push_back(order.points[place].second);
  }
  const auto end = std::remove_if(by_first.begin(), by_first.end(),
                                  [&](const Indices& it) { return it.size() < min_points; });
  by_first.erase(end, by_first.end());
  return by_first;
}

std::vector<Vector3f> thinned(const Cluster& points, float voxel) {
  const Sorted order = sorted(points, voxel);
  std::vector<Vector3f> means;
  for (std::size_t number = 0; number < order.voxels.size(); ++number) {
    Vector3f sum = Vector3f::Zero();
    for (std::uint32_t place = order.begins[number]; place < order.begins[number + 1]; ++place)
      sum += points[order.points[place].second];
    means.emplace_back(sum / static_cast<float>(order.begins[number + 1] - order.begins[number]));
  }
  return means;
}

// Boxes around clusters.

namespace {

constexpr float kColumnWidth = 0.03F;     // m: heights are measured in columns
constexpr float kTopLayer = 0.03F;        // m: the part of a column that counts for its height
constexpr float kTopLayerDeviations = 5;  // standard deviations: the same with a noisy sensor
constexpr std::size_t kMinColumnPoints = 8;
constexpr float kPointsPerStray = 500;      // 1 in this many points may be an outlier
constexpr float kAreaTolerance = 1.2F;      // times the smallest area
constexpr std::size_t kYawSample = 500;     // points
constexpr float kNegligibleNoise = 0.004F;  // m
constexpr float kNoiseReach = 3;            // standard deviations: noise points lie no farther out
constexpr float kMinBinPoints = 8;          // on average
constexpr float kMaxHover = 0.03F;          // m: an object on a surface may seem to hover
constexpr float kMinVisibleSide = 0.04F;    // m: of an upright side, seen from above

float cross(const Vector2f& a, const Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Convex hull, counter-clockwise (monotone chain).
std::vector<Vector2f> hullOf(std::vector<Vector2f> points) {
  std::sort(points.begin(), points.end(), [](const Vector2f& a, const Vector2f& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2f> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Vector2f& point : points) {
      while (hull.size() >= begin + 2 &&
             cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull.empty() ? std::vector<Vector2f>{points.front()} : hull;
}

/// Area of the rectangle around a hull whose first edge has this direction.
float areaAround(const std::vector<Vector2f>& hull, float yaw) {
  Eigen::AlignedBox2f box;
  for (const Vector2f& point : hull) box.extend(Eigen::Rotation2Df(-yaw) * point);
  return box.sizes().prod();
}

/// Mean distance of points from the nearest side of the rectangle around them.
float distanceFromSides(const std::vector<Vector2f>& points, float yaw) {
  const Eigen::Rotation2Df turned(-yaw);
  Eigen::AlignedBox2f box;
  for (const Vector2f& point : points) box.extend(turned * point);
  float sum = 0;
  for (const Vector2f& point : points) {
    const Vector2f place = turned * point;
    sum += std::min((place - box.min()).minCoeff(), (box.max() - place).minCoeff());
  }
  return sum / static_cast<float>(points.size());
}

/// Yaw of the smallest rectangle, one side of which lies on an edge of the hull (Freeman and
/// Shapira 1975). If two upright sides are seen at a corner, the rectangle across the corner is as
/// small as the right one. So among rectangles of almost equal size, the one whose sides are
/// nearest to the points is taken.
float yawOfSmallest(const std::vector<Vector2f>& points) {
  const std::vector<Vector2f> hull = hullOf(points);
  std::vector<std::pair<float, float>> by_area;
  for (std::size_t index = 0; index < hull.size(); ++index) {
    const Vector2f edge = hull[(index + 1) % hull.size()] - hull[index];
    const float yaw = std::atan2(edge.y(), edge.x());
    by_area.emplace_back(areaAround(hull, yaw), yaw);
  }
  std::vector<Vector2f> sample;
  for (std::size_t index = 0; index < points.size(); index += points.size() / kYawSample + 1)
    sample.push_back(points[index]);
  const float max_area = kAreaTolerance * std::min_element(by_area.begin(), by_area.end())->first;
  float best_yaw = 0, min_away = std::numeric_limits<float>::infinity();
  for (const auto& [area, yaw] : by_area) {
    const float away = area <= max_area ? distanceFromSides(sample, yaw) : min_away;
    if (away >= min_away) continue;
    min_away = away;
    best_yaw = yaw;
  }
  return best_yaw;
}

/// Minimum and maximum, without a few stray values at either end.
std::pair<float, float> rangeOf(std::vector<float> values) {
  const auto strays =
      static_cast<std::ptrdiff_t>(static_cast<float>(values.size()) / kPointsPerStray);
  std::nth_element(values.begin(), values.begin() + strays, values.end());
  const float min = values[strays];
  std::nth_element(values.begin(), values.end() - 1 - strays, values.end());
  return {min, values[values.size() - 1 - strays]};
}

/// Estimate of the true minimum of noisy values: the value at which they become half as dense as a
/// little farther in. If many values are those of one side, it is too low by one deviation.
/// \param values  ascending
/// \param deviation  standard deviation of their noise
float denoisedMin(const std::vector<float>& values, float deviation) {
  const float length = values.back() - values.front();
  const float bin =
      std::max(deviation / 2, length * kMinBinPoints / static_cast<float>(values.size()));
  const auto reach = static_cast<std::size_t>(std::ceil(kNoiseReach * deviation / bin)) + 1;
  const auto last = static_cast<std::size_t>(length / bin);
  std::vector<float> density(last + 1, 0);
  for (const float value : values)
    ++density[std::min(static_cast<std::size_t>((value - values.front()) / bin), last)];
  for (std::size_t place = 0; place <= std::min(reach, last); ++place) {
    const auto end = density.begin() + static_cast<std::ptrdiff_t>(std::min(place + reach, last));
    const float half =
        *std::max_element(density.begin() + static_cast<std::ptrdiff_t>(place), end + 1) / 2;
    if (density[place] < half) continue;
    const float before = place == 0 ? 0 : density[place - 1];
    const float share = (half - before) / std::max(density[place] - before, 1.0F);
    return values.front() +
           bin * (static_cast<float>(place) - 0.5F + std::clamp(share, 0.0F, 1.0F));
  }
  return values.front() + static_cast<float>(reach) * bin;
}

/// Minimum and maximum of places along an axis.
/// \param deviation  standard deviation of the noise along it, m; if large, it widens the range
std::pair<float, float> endsOf(std::vector<float> values, float deviation) {
  const auto [min, max] = rangeOf(values);
  if (deviation < kNegligibleNoise || max - min < deviation) return {min, max};
  std::sort(values.begin(), values.end());
  const float begin = std::max(min, denoisedMin(values, deviation));
  std::reverse(values.begin(), values.end());
  for (float& value : values) value = -value;
  const float end = std::min(max, -denoisedMin(values, deviation));
  return begin < end ? std::pair(begin, end) : std::pair(min, max);
}

/// Height of a column: the mean of the points near its top, which averages out the sensor's noise.
/// On an upright face, where points are equally dense, that mean is half a layer too low.
float heightOf(const std::vector<float>& column, float layer) {
  const float top = *std::max_element(column.begin(), column.end()),
              bottom = *std::min_element(column.begin(), column.end());
  float sum = 0;
  int count = 0;
  for (const float height : column) {
    if (height < top - layer) continue;
    sum += height;
    ++count;
  }
  const float mean = sum / static_cast<float>(count);
  const float even = static_cast<float>(column.size()) * layer / (top - bottom);
  const bool is_face = top - bottom > 2 * layer && static_cast<float>(count) < 1.5F * even;
  return is_face ? std::min(top, mean + layer / 3) : mean;
}

/// Mean height of the highest columns; a single one may be noise, or show an upright side.
float topOf(const Cluster& points, float fallback, float layer) {
  std::map<std::pair<int, int>, std::vector<float>> columns;
  for (const Vector3f& point : points)
    columns[{static_cast<int>(std::floor(point.x() / kColumnWidth)),
             static_cast<int>(std::floor(point.y() / kColumnWidth))}]
        .push_back(point.z());
  std::vector<float> heights;
  for (const auto& [place, column] : columns)
    if (column.size() >= kMinColumnPoints) heights.push_back(heightOf(column, layer));
  if (heights.empty()) return fallback;
  const float highest = *std::max_element(heights.begin(), heights.end());
  const auto others = std::partition(heights.begin(), heights.end(),
                                     [&](float height) { return height >= highest - layer; });
  return std::accumulate(heights.begin(), others, 0.0F) /
         static_cast<float>(others - heights.begin());
}

/// Returns whether a sensor would see more of an object's side if it reached down to the surface.
bool wouldSeeSide(const UprightBox& box, float surface, const Vector3f& sensor) {
  const float sensor_height = sensor.z() - surface, top = box.center.z() + box.size.z() / 2;
  if (sensor_height <= top - surface) return true;
  const float missing = box.center.z() - box.size.z() / 2 - surface;
  const Vector2f from_center =
      Eigen::Rotation2Df(-box.yaw) * Vector2f(sensor.head<2>() - box.center.head<2>());
  const Vector2f beside = (from_center.cwiseAbs() - box.size.head<2>() / 2).cwiseMax(0);
  return missing * beside.norm() / sensor_height > kMinVisibleSide;
}

}  // namespace

Vector3f inBox(const UprightBox& box, const Vector3f& place) {
  return Eigen::AngleAxisf(-box.yaw, Vector3f::UnitZ()) * (place - box.center);
}

float distanceTo(const UprightBox& box, const Vector3f& place) {
  return (inBox(box, place).cwiseAbs() - box.size / 2).cwiseMax(0).norm();
}

Eigen::AlignedBox2f footprint(const Cluster& points, float yaw, const Vector2f& blur) {
  const Eigen::Rotation2Df turned(-yaw);
  const Vector2f deviation = (turned * blur).cwiseAbs();
  std::vector<float> along, across;
  for (const Vector3f& point : points) {
    const Vector2f place = turned * Vector2f(point.head<2>());
    along.push_back(place.x());
    across.push_back(place.y());
  }
  const auto [front, back] = endsOf(std::move(along), deviation.x());
  const auto [right, left] = endsOf(std::move(across), deviation.y());
  return {Vector2f(front, right), Vector2f(back, left)};
}

UprightBox boxAround(const Cluster& points, const Vector3f& blur) {
  std::vector<Vector2f> base;
  std::vector<float> heights;
  for (const Vector3f& point : points) {
    base.emplace_back(point.head<2>());
    heights.push_back(point.z());
  }
  UprightBox box;
  box.yaw = yawOfSmallest(base);
  const Eigen::AlignedBox2f range = footprint(points, box.yaw, blur.head<2>());
  const float deviation = std::abs(blur.z());
  auto [bottom, top] = endsOf(std::move(heights), deviation);
  top = std::max(bottom, topOf(points, top, std::max(kTopLayer, kTopLayerDeviations * deviation)));
  const Vector2f center = Eigen::Rotation2Df(box.yaw) * range.center();
  box.center = {center.x(), center.y(), (bottom + top) / 2};
  box.size = {range.sizes().x(), range.sizes().y(), top - bottom};
  return box;
}

UprightBox standing(const UprightBox& seen, float surface, float tolerance,
                    const Vector3f& sensor) {
  const float bottom = seen.center.z() - seen.size.z() / 2;
  if (bottom - surface > tolerance + kMaxHover && wouldSeeSide(seen, surface, sensor)) return seen;
  const float top = bottom + seen.size.z();
  UprightBox box = seen;
  box.center.z() = (surface + top) / 2;
  box.size.z() = top - surface;
  return box;
}

}  // namespace process_visualizer::objects
