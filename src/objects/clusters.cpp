// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/clusters.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "process_visualizer/objects/disjoint_sets.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t kBits = 21, kHalf = std::int64_t{1} << (kBits - 1);
constexpr std::int64_t kAlongY = std::int64_t{1} << kBits, kAlongZ = kAlongY << kBits;

/// The number of a cube: its place along z, y, x. Cubes too far from the origin share the last one.
std::int64_t cubeOf(const Vector3f& point, float cube) {
  const auto along = [&](int axis) {
    const double place = std::floor(static_cast<double>(point[axis]) / cube);
    const auto limit = static_cast<double>(kHalf - 2);
    return static_cast<std::int64_t>(std::clamp(place, -limit, limit)) + kHalf;
  };
  return along(2) * kAlongZ + along(1) * kAlongY + along(0);
}

/// Points sorted by their cubes.
struct Sorted {
  std::vector<std::pair<std::int64_t, std::uint32_t>> points;  ///< cube, index of the point
  std::vector<std::int64_t> cubes;                             ///< rising
  std::vector<std::uint32_t> begins;  ///< where the points of each cube begin, and the end
};

Sorted sorted(const std::vector<Vector3f>& points, float cube) {
  Sorted result;
  result.points.reserve(points.size());
  for (std::uint32_t index = 0; index < points.size(); ++index)
    result.points.emplace_back(cubeOf(points[index], cube), index);
  std::sort(result.points.begin(), result.points.end());
  for (std::uint32_t place = 0; place < result.points.size(); ++place) {
    if (!result.cubes.empty() && result.cubes.back() == result.points[place].first) continue;
    result.cubes.push_back(result.points[place].first);
    result.begins.push_back(place);
  }
  result.begins.push_back(static_cast<std::uint32_t>(result.points.size()));
  return result;
}

/// Joins cubes that touch. The three neighbours along x follow each other in the order of cubes.
DisjointSets joined(const std::vector<std::int64_t>& cubes) {
  DisjointSets sets(cubes.size());
  for (std::uint32_t number = 0; number < cubes.size(); ++number) {
    for (const std::int64_t row :
         {std::int64_t{0}, kAlongY, kAlongZ - kAlongY, kAlongZ, kAlongZ + kAlongY}) {
      const std::int64_t middle = cubes[number] + row;
      const auto begin = std::lower_bound(cubes.begin(), cubes.end(), middle - 1);
      for (auto it = begin; it != cubes.end() && *it <= middle + 1; ++it)
        sets.join(number, static_cast<std::uint32_t>(it - cubes.begin()));
    }
  }
  return sets;
}

}  // namespace

std::vector<Indices> clustersOf(const std::vector<Vector3f>& points, float cube,
                                std::size_t fewest) {
  const Sorted order = sorted(points, cube);
  DisjointSets sets = joined(order.cubes);
  std::vector<Indices> by_first(order.cubes.size());
  for (std::uint32_t number = 0; number < order.cubes.size(); ++number) {
    Indices& cluster = by_first[sets.first(number)];
    for (std::uint32_t place = order.begins[number]; place < order.begins[number + 1]; ++place)
      cluster.push_back(order.points[place].second);
  }
  const auto end = std::remove_if(by_first.begin(), by_first.end(),
                                  [&](const Indices& it) { return it.size() < fewest; });
  by_first.erase(end, by_first.end());
  return by_first;
}

std::vector<Vector3f> thinned(const Cluster& points, float cube) {
  const Sorted order = sorted(points, cube);
  std::vector<Vector3f> means;
  for (std::size_t number = 0; number < order.cubes.size(); ++number) {
    Vector3f sum = Vector3f::Zero();
    for (std::uint32_t place = order.begins[number]; place < order.begins[number + 1]; ++place)
      sum += points[order.points[place].second];
    means.emplace_back(sum / static_cast<float>(order.begins[number + 1] - order.begins[number]));
  }
  return means;
}

}  // namespace process_visualizer::objects
