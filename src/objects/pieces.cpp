// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/pieces.hpp"

#include <algorithm>
#include <limits>

#include "process_visualizer/objects/disjoint_sets.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr float kNear = 0.04F;         // m: how wrong the expected place may be
constexpr float kFewestShare = 0.15F;  // of a group's points, of each object in it
constexpr std::size_t kSample = 200;   // points of a group tell whose it is
constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

/// Which expected object is nearest to a place, of those that are nearer than `farthest` (m).
std::size_t nearestTo(const Vector3f& place, const std::vector<ExpectedObject>& expected,
                      const std::vector<std::size_t>& candidates, float farthest) {
  std::size_t nearest = kNobody;
  for (const std::size_t object : candidates) {
    const UprightBox& box = expected[object].box;
    const float reach = farthest + box.size.norm() / 2;
    if ((place - box.center).squaredNorm() >= reach * reach) continue;
    const float away = distanceTo(box, place);
    if (away >= farthest) continue;
    farthest = away;
    nearest = object;
  }
  return nearest;
}

std::vector<std::size_t> numbersTo(std::size_t count) {
  std::vector<std::size_t> numbers(count);
  for (std::size_t number = 0; number < count; ++number) numbers[number] = number;
  return numbers;
}

/// Whether the middle of one box lies in the other: such two are no two things.
bool areOne(const UprightBox& one, const UprightBox& other) {
  return distanceTo(one, other.center) == 0 || distanceTo(other, one.center) == 0;
}

/// How many points of a sample belong to each expected object.
struct Counts {
  std::size_t sample = 0;
  std::vector<std::size_t> of_object;
};

/// \param pointAt  the place of a point of the group
template <typename PointAt>
Counts countsOf(std::size_t points, const PointAt& pointAt,
                const std::vector<ExpectedObject>& expected) {
  const std::vector<std::size_t> all = numbersTo(expected.size());
  Counts counts{0, std::vector<std::size_t>(expected.size())};
  for (std::size_t point = 0; point < points; point += points / kSample + 1) {
    const std::size_t object = nearestTo(pointAt(point), expected, all, kNear);
    if (object != kNobody) ++counts.of_object[object];
    ++counts.sample;
  }
  return counts;
}

/// The expected objects of which a group has points of their own.
std::vector<std::size_t> objectsIn(const Indices& group, const Cluster& places,
                                   const std::vector<ExpectedObject>& expected,
                                   std::size_t fewest) {
  const Counts counts = countsOf(
      group.size(), [&](std::size_t point) { return places[group[point]]; }, expected);
  const float least =
      std::max(kFewestShare, static_cast<float>(fewest) / static_cast<float>(group.size()));
  std::vector<std::size_t> objects;
  for (std::size_t object = 0; object < expected.size(); ++object) {
    const bool is_other = std::none_of(objects.begin(), objects.end(), [&](std::size_t it) {
      return areOne(expected[it].box, expected[object].box);
    });
    const auto count = static_cast<float>(counts.of_object[object]);
    if (is_other && count >= least * static_cast<float>(counts.sample)) objects.push_back(object);
  }
  return objects;
}

}  // namespace

std::optional<std::size_t> ownerOf(const Cluster& points,
                                   const std::vector<ExpectedObject>& expected) {
  const Counts counts = countsOf(
      points.size(), [&](std::size_t point) { return points[point]; }, expected);
  const auto most = std::max_element(counts.of_object.begin(), counts.of_object.end());
  if (most == counts.of_object.end() || 2 * *most <= counts.sample) return std::nullopt;
  return static_cast<std::size_t>(most - counts.of_object.begin());
}

std::vector<Indices> divided(const std::vector<Indices>& groups, const Cluster& places,
                             const std::vector<ExpectedObject>& expected, std::size_t fewest) {
  std::vector<Indices> parts;
  for (const Indices& group : groups) {
    const std::vector<std::size_t> objects = objectsIn(group, places, expected, fewest);
    if (objects.size() < 2) {
      parts.push_back(group);
      continue;
    }
    std::vector<Indices> by_object(expected.size());
    for (const std::uint32_t point : group)
      by_object[nearestTo(places[point], expected, objects, std::numeric_limits<float>::infinity())]
          .push_back(point);
    for (const std::size_t object : objects) parts.push_back(std::move(by_object[object]));
  }
  return parts;
}

std::vector<std::uint32_t> wholes(const std::vector<std::optional<std::size_t>>& owners,
                                  const std::vector<ExpectedObject>& expected,
                                  const std::vector<Bridge>& bridges) {
  const auto mayGrow = [&](const std::optional<std::size_t>& owner) {
    return !owner || !expected[*owner].is_whole || expected[*owner].is_moving;
  };
  DisjointSets sets(owners.size());
  for (const Bridge& bridge : bridges) {
    const auto &one = owners[bridge.one], &other = owners[bridge.other];
    const bool is_same = one ? one == other : false;
    const bool is_open = bridge.continues && mayGrow(one) && mayGrow(other) && !(one && other);
    if (is_same || is_open) sets.join(bridge.one, bridge.other);
  }
  std::vector<std::uint32_t> firsts;
  for (std::uint32_t group = 0; group < owners.size(); ++group) firsts.push_back(sets.first(group));
  return firsts;
}

}  // namespace process_visualizer::objects
