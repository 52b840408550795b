// SPDX-License-Identifier: BSD-3-Clause
// Decides which points belong to robots, and which of the others form one object.

#include "process_visualizer/objects/object_finder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/person.hpp"
#include "process_visualizer/objects/support_planes.hpp"
#include "process_visualizer/objects/walls.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kMinThickness = 0.025F;     // m: an object is thicker in at least two directions
constexpr float kMaxStackOffset = 0.03F;    // m: horizontal gap of parts one above the other
constexpr float kMaxStackGap = 0.3F;        // m: vertical gap of such parts of a person
constexpr float kMaxLimbThickness = 0.14F;  // m
constexpr float kMaxLimbWidth = 0.32F;      // m: with a foot
constexpr float kMaxPersonWidth = 1.5F;     // m: a wall is wider
constexpr std::size_t kMinTipPoints = 5;
constexpr float kMaxPartGap = 0.1F;          // m: between parts of one object
constexpr float kMaxSpeedDifference = 1.2F;  // m/s: of parts of a person; one that comes into view
                                             // seems to be slower or faster
constexpr float kWallSpacing = 0.02F;        // m: between the places kept of a wall
constexpr float kNoiseStep = 0.03F;          // m: along the line of sight
constexpr std::size_t kSearchPeriod = 5;     // clouds: search for walls, and estimate of noise
constexpr float kNoiseWeight = 0.3F;         // of a cloud, in the estimate of the noise
constexpr float kSurfaceMargin = 0.1F;       // m: around an object, to measure its surface
constexpr float kPredictionError = 0.04F;    // m
constexpr float kMinShare = 0.15F;           // of a group's points, of each object in it
constexpr std::size_t kViewSample = 2000;    // points of a cloud that show where it looks
constexpr std::size_t kRobotSample = 4000;   // points that show whether robots are there
constexpr float kRayStep = 0.05F;            // m
constexpr float kMaxRayLength = 20;          // m
constexpr float kOccludingDepth = 0.02F;     // m: a ray this deep in a robot ends there
constexpr std::size_t kGroupSample = 200;    // points of a group that determine its owner
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Predicted object nearest to a place, or kNone if none is within `max_distance` (m).
std::size_t nearestTo(const Vector3f& place, const std::vector<PredictedObject>& predicted,
                      const std::vector<std::size_t>& candidates, float max_distance) {
  std::size_t nearest = kNone;
  for (const std::size_t object : candidates) {
    const UprightBox& box = predicted[object].box;
    const float reach = max_distance + box.size.norm() / 2;
    if ((place - box.center).squaredNorm() >= reach * reach) continue;
    const float away = distanceTo(box, place);
    if (away >= max_distance) continue;
    max_distance = away;
    nearest = object;
  }
  return nearest;
}

/// Returns whether the center of one box lies in the other, so that they are one object.
bool areSame(const UprightBox& one, const UprightBox& other) {
  return distanceTo(one, other.center) == 0 || distanceTo(other, one.center) == 0;
}

/// Points of a sample that belong to each predicted object.
struct Counts {
  std::size_t sample = 0;
  std::vector<std::size_t> of_object;
};

/// \param pointAt  the place of a point of the group
template <typename PointAt>
Counts countsOf(std::size_t points, const PointAt& pointAt,
                const std::vector<PredictedObject>& predicted) {
  std::vector<std::size_t> all(predicted.size());
  std::iota(all.begin(), all.end(), 0);
  Counts counts{0, std::vector<std::size_t>(predicted.size())};
  for (std::size_t point = 0; point < points; point += points / kGroupSample + 1) {
    const std::size_t object = nearestTo(pointAt(point), predicted, all, kPredictionError);
    if (object != kNone) ++counts.of_object[object];
    ++counts.sample;
  }
  return counts;
}

/// The predicted objects of which a group contains enough points.
std::vector<std::size_t> objectsIn(const Indices& group, const Cluster& places,
                                   const std::vector<PredictedObject>& predicted,
                                   std::size_t min_points) {
  const Counts counts = countsOf(
      group.size(), [&](std::size_t point) { return places[group[point]]; }, predicted);
  const float min_share =
      std::max(kMinShare, static_cast<float>(min_points) / static_cast<float>(group.size()));
  std::vector<std::size_t> objects;
  for (std::size_t object = 0; object < predicted.size(); ++object) {
    const bool is_other = std::none_of(objects.begin(), objects.end(), [&](std::size_t it) {
      return areSame(predicted[it].box, predicted[object].box);
    });
    const auto count = static_cast<float>(counts.of_object[object]);
    if (is_other && count >= min_share * static_cast<float>(counts.sample))
      objects.push_back(object);
  }
  return objects;
}

/// The predicted object that owns a group, if any: more than half of the points lie in its box or
/// near it.
std::optional<std::size_t> ownerOf(const Cluster& points,
                                   const std::vector<PredictedObject>& predicted) {
  const Counts counts = countsOf(
      points.size(), [&](std::size_t point) { return points[point]; }, predicted);
  const auto most = std::max_element(counts.of_object.begin(), counts.of_object.end());
  if (most == counts.of_object.end() || 2 * *most <= counts.sample) return std::nullopt;
  return static_cast<std::size_t>(most - counts.of_object.begin());
}

/// Divides groups in which several predicted objects touch: each point goes to the nearest one.
/// \param places  of all points
/// \param min_points  of an object
std::vector<Indices> divided(const std::vector<Indices>& groups, const Cluster& places,
                             const std::vector<PredictedObject>& predicted,
                             std::size_t min_points) {
  std::vector<Indices> parts;
  for (const Indices& group : groups) {
    const std::vector<std::size_t> objects = objectsIn(group, places, predicted, min_points);
    if (objects.size() < 2) {
      parts.push_back(group);
      continue;
    }
    std::vector<Indices> by_object(predicted.size());
    for (const std::uint32_t point : group)
      by_object[nearestTo(places[point], predicted, objects,
                          std::numeric_limits<float>::infinity())]
          .push_back(point);
    for (const std::size_t object : objects) parts.push_back(std::move(by_object[object]));
  }
  return parts;
}

/// Merges groups that are parts of one object with an occluder in between: those of one predicted
/// object, and those that may continue each other unless they belong to an object that is known to
/// be smaller.
/// \return for each group the first one of its object
std::vector<std::uint32_t> firstParts(const std::vector<std::optional<std::size_t>>& owners,
                                      const std::vector<PredictedObject>& predicted,
                                      const std::vector<Bridge>& bridges) {
  const auto mayGrow = [&](const std::optional<std::size_t>& owner) {
    return !owner || !predicted[*owner].is_complete || predicted[*owner].is_moving;
  };
  DisjointSets sets(owners.size());
  for (const Bridge& bridge : bridges) {
    const auto &one = owners[bridge.one], &other = owners[bridge.other];
    const bool is_same = one ? one == other : false;
    const bool may_be_one = bridge.continues && mayGrow(one) && mayGrow(other) && !(one && other);
    if (is_same || may_be_one) sets.join(bridge.one, bridge.other);
  }
  std::vector<std::uint32_t> firsts;
  for (std::uint32_t group = 0; group < owners.size(); ++group) firsts.push_back(sets.first(group));
  return firsts;
}

/// Points for the search for planes, in the global frame. They include the surroundings of the
/// region, because a region may contain only a little of a surface.
std::vector<Vector3f> surroundings(const Points& points, const std::vector<Label>& labels,
                                   const Isometry3f& global_from_cloud) {
  const std::size_t stride = labels.size() / SupportPlanes::kMaxPoints + 1;
  std::vector<Vector3f> chosen;
  for (std::size_t index = 0; index < labels.size(); index += stride)
    if (labels[index] == Label::kFree || labels[index] == Label::kOutside ||
        labels[index] == Label::kExpected)
      chosen.push_back(global_from_cloud * points.places[index]);
  return chosen;
}

/// Free points in the global frame, and their indices in the cloud.
struct FreePoints {
  Cluster places;
  Indices indices;
};

/// The free points that are on no support plane: first those on no wall, then those of each wall.
std::pair<FreePoints, std::vector<FreePoints>> freePoints(const Points& points,
                                                          const std::vector<Label>& labels,
                                                          const Isometry3f& global_from_cloud,
                                                          const SupportPlanes& planes,
                                                          const Walls& walls) {
  FreePoints free;
  std::vector<FreePoints> of_wall(walls.size());
  for (std::uint32_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kFree) continue;
    const Vector3f place = global_from_cloud * points.places[index];
    if (planes.contain(place)) continue;
    const auto wall = walls.wallAt(place);
    FreePoints& target = wall ? of_wall[*wall] : free;
    target.places.push_back(place);
    target.indices.push_back(index);
  }
  return {std::move(free), std::move(of_wall)};
}

/// An object before it is measured.
struct Candidate {
  Cluster places;
  std::vector<Rim> rim;
  std::size_t points = 0;  ///< in the cloud
};

Cluster chosen(const Cluster& places, const Indices& indices) {
  Cluster cluster;
  cluster.reserve(indices.size());
  for (const std::uint32_t index : indices) cluster.push_back(places[index]);
  return cluster;
}

std::vector<Indices> largest(std::vector<Indices> groups, std::size_t count) {
  if (groups.size() <= count) return groups;
  std::stable_sort(groups.begin(), groups.end(), [](const Indices& one, const Indices& other) {
    return one.size() > other.size();
  });
  groups.resize(count);
  return groups;
}

/// Groups of free points as indices of the cloud.
std::vector<Indices> inCloud(const std::vector<Indices>& groups, const Indices& indices) {
  std::vector<Indices> result = groups;
  for (Indices& group : result)
    for (std::uint32_t& point : group) point = indices[point];
  return result;
}

template <typename Item>
void append(std::vector<Item>& items, const std::vector<Item>& more) {
  items.insert(items.end(), more.begin(), more.end());
}

std::vector<Isometry3f> inGlobalFrame(const Scene& scene) {
  std::vector<Isometry3f> from_body;
  for (const Isometry3f& transform : scene.cloud_from_body)
    from_body.push_back(scene.global_from_cloud * transform);
  return from_body;
}

/// Joins the candidates that have the same first part.
std::vector<Candidate> joined(std::vector<Candidate> candidates,
                              const std::vector<std::uint32_t>& firsts) {
  std::vector<Candidate> result;
  for (std::uint32_t number = 0; number < candidates.size(); ++number) {
    if (firsts[number] == number) continue;
    append(candidates[firsts[number]].places, candidates[number].places);
    append(candidates[firsts[number]].rim, candidates[number].rim);
    candidates[firsts[number]].points += candidates[number].points;
  }
  for (std::uint32_t number = 0; number < candidates.size(); ++number)
    if (firsts[number] == number) result.push_back(std::move(candidates[number]));
  return result;
}

/// Gap between two boxes along an axis, m; negative if they overlap.
float gapAlong(const AlignedBox3f& one, const AlignedBox3f& other, int axis) {
  return std::max(one.min()[axis] - other.max()[axis], other.min()[axis] - one.max()[axis]);
}

/// Returns whether two groups are as near to each other, seen from above, as a limb and its body:
/// most often something above hides the part between them.
bool areNear(const Cluster& one, const Cluster& other) {
  return std::any_of(one.begin(), one.end(), [&](const Vector3f& place) {
    return std::any_of(other.begin(), other.end(), [&](const Vector3f& it) {
      return (it - place).head<2>().squaredNorm() < kMaxLimbGap * kMaxLimbGap;
    });
  });
}

/// Returns whether points are as slender as a limb along their principal axes.
bool isSlender(const Cluster& points) {
  Vector3f middle = Vector3f::Zero();
  for (const Vector3f& point : points) middle += point / static_cast<float>(points.size());
  Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
  for (const Vector3f& point : points) spread += (point - middle) * (point - middle).transpose();
  const Eigen::Matrix3f axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(spread).eigenvectors();
  AlignedBox3f box;
  for (const Vector3f& point : points) box.extend(axes.transpose() * point);
  const Vector3f lengths = box.sizes();
  return lengths.minCoeff() < kMaxLimbThickness &&
         lengths.sum() - lengths.minCoeff() - lengths.maxCoeff() < kMaxLimbWidth;
}

/// Properties of a group that may be a part of a larger object.
struct Group {
  AlignedBox3f box;
  Cluster coarse;                    ///< its points, thinned
  bool is_slender;                   ///< as a limb, in any direction: a leg may swing
  std::optional<std::size_t> owner;  ///< the predicted object of which it is a part
};

std::vector<Group> groupsOf(const std::vector<Candidate>& candidates,
                            const std::vector<std::optional<std::size_t>>& owners) {
  std::vector<Group> groups;
  for (std::size_t number = 0; number < candidates.size(); ++number) {
    const Cluster& places = candidates[number].places;
    Group group{{}, thinned(places, kMaxLimbGap / 5), isSlender(places), owners[number]};
    for (const Vector3f& place : places) group.box.extend(place);
    groups.push_back(std::move(group));
  }
  return groups;
}

/// Returns whether a group may be a person, or a large part of one. A lower object that is known to
/// stand is not: it has no limbs that come into view later.
bool isPersonLike(const AlignedBox3f& box, const PredictedObject* owner) {
  if (!owner) return box.sizes().z() > kMinPersonHeight;
  return mayBePerson(owner->box.size, !owner->stands);
}

const PredictedObject* ownerIn(const std::vector<PredictedObject>& predicted,
                               const std::optional<std::size_t>& owner) {
  return owner ? &predicted[*owner] : nullptr;
}

/// Calls a function with all pairs of groups, the smaller number first, and the horizontal and the
/// vertical gap between them, m.
template <typename Look>
void forPairs(const std::vector<Group>& groups, const Look& look) {
  for (std::uint32_t other = 0; other < groups.size(); ++other) {
    for (std::uint32_t one = 0; one < other; ++one) {
      const AlignedBox3f &a = groups[one].box, &b = groups[other].box;
      look(one, other, std::max(gapAlong(a, b, 0), gapAlong(a, b, 1)), gapAlong(a, b, 2));
    }
  }
}

/// Returns whether one group is right above the other, and they are as high as a person together;
/// lower pairs may be an arm above a box.
/// \param horizontal_gap, vertical_gap  see forPairs
bool formPerson(const Group& a, const Group& b, const std::vector<PredictedObject>& predicted,
                float horizontal_gap, float vertical_gap) {
  const AlignedBox3f both = a.box.merged(b.box);
  return horizontal_gap < kMaxStackOffset && vertical_gap > -kMaxStackOffset &&
         vertical_gap < kMaxStackGap &&
         (both.sizes().z() > kMinPersonHeight || isPersonLike(both, ownerIn(predicted, a.owner)) ||
          isPersonLike(both, ownerIn(predicted, b.owner)));
}

/// Merges two tracked objects that are parts of a person and move together: a head and an arm, for
/// example, may have been seen before the part that joins them.
void mergeOwners(std::vector<Group>& groups, const std::vector<PredictedObject>& predicted) {
  forPairs(groups,
           [&](std::uint32_t one, std::uint32_t other, float horizontal_gap, float vertical_gap) {
             Group &a = groups[one], &b = groups[other];
             const PredictedObject *first = ownerIn(predicted, a.owner),
                                   *second = ownerIn(predicted, b.owner);
             if (!first || !second || !first->is_moving || !second->is_moving) return;
             if ((first->velocity - second->velocity).head<2>().norm() > kMaxSpeedDifference)
               return;
             if (!formPerson(a, b, predicted, horizontal_gap, vertical_gap)) return;
             const bool is_smaller = first->box.size.prod() < second->box.size.prod();
             (is_smaller ? a : b).owner = is_smaller ? b.owner : a.owner;
           });
}

/// Returns whether one group is right above the other with no surface between, and so near that it
/// hides the part that joins them, as the upper disc of a drum hides its core. Moving objects are
/// excluded, as they pass above others.
/// \param horizontal_gap, vertical_gap  see forPairs
bool areStacked(const Group& a, const Group& b, const std::vector<PredictedObject>& predicted,
                float horizontal_gap, float vertical_gap, const SupportPlanes& planes) {
  if (horizontal_gap >= 0 || vertical_gap <= -kMaxStackOffset || vertical_gap >= kMaxPartGap)
    return false;
  for (const Group* group : {&a, &b})
    if (group->owner && predicted[*group->owner].is_moving) return false;
  const bool is_first_above = a.box.min().z() > b.box.min().z();
  const AlignedBox3f &upper = is_first_above ? a.box : b.box,
                     &lower = is_first_above ? b.box : a.box;
  const auto surface = planes.heightBelow(upper.center(), upper.sizes().head<2>().norm() / 2);
  return !surface || *surface < lower.max().z() - kMaxPartGap;
}

/// Joins groups that form a person, such as legs and a chest with too few points between; stacked
/// groups; and parts of one tracked object, such as an arm that swings.
std::vector<Bridge> bridgesByPosition(const std::vector<Group>& groups,
                                      const std::vector<PredictedObject>& predicted,
                                      const SupportPlanes& planes) {
  std::vector<Bridge> bridges;
  forPairs(groups, [&](std::uint32_t one, std::uint32_t other, float horizontal_gap,
                       float vertical_gap) {
    const Group &a = groups[one], &b = groups[other];
    const bool is_above = formPerson(a, b, predicted, horizontal_gap, vertical_gap) ||
                          areStacked(a, b, predicted, horizontal_gap, vertical_gap, planes);
    const bool is_same =
        a.owner && a.owner == b.owner && std::max(horizontal_gap, vertical_gap) < kMaxPartGap;
    if (is_above || is_same) bridges.push_back({one, other, is_above});
  });
  return bridges;
}

/// Joins slender groups with the person beside them, such as an arm partly hidden by the shoulder.
/// \param firsts  of each group the first one of its object so far: legs and a chest that are two
/// groups form a person together
std::vector<Bridge> limbBridges(const std::vector<Group>& groups,
                                const std::vector<PredictedObject>& predicted,
                                const std::vector<std::uint32_t>& firsts) {
  std::vector<AlignedBox3f> boxes(groups.size());
  std::vector<bool> is_person(groups.size());
  for (std::size_t group = 0; group < groups.size(); ++group)
    boxes[firsts[group]].extend(groups[group].box);
  for (std::size_t group = 0; group < groups.size(); ++group)
    if (isPersonLike(boxes[firsts[group]], ownerIn(predicted, groups[group].owner)))
      is_person[firsts[group]] = true;
  const auto isBody = [&](std::uint32_t group) { return is_person[firsts[group]]; };
  const auto isLimb = [&](std::uint32_t group) {
    return groups[group].is_slender || isBody(group);
  };
  std::vector<Bridge> bridges;
  forPairs(groups,
           [&](std::uint32_t one, std::uint32_t other, float horizontal_gap, float vertical_gap) {
             if ((isBody(one) && isLimb(other)) || (isBody(other) && isLimb(one)))
               if (horizontal_gap < kMaxLimbGap && vertical_gap < kMaxLimbGap &&
                   areNear(groups[one].coarse, groups[other].coarse))
                 bridges.push_back({one, other, true});
           });
  return bridges;
}

/// The candidates that groups of free points form.
std::vector<Candidate> candidatesOf(const std::vector<Indices>& groups, const FreePoints& free,
                                    const Points& points, const std::vector<Label>& labels,
                                    const Isometry3f& global_from_cloud,
                                    const std::vector<PredictedObject>& predicted,
                                    const SupportPlanes& planes) {
  const Occlusions occlusions = occlusionsOf(points, labels, inCloud(groups, free.indices));
  std::vector<Candidate> candidates(groups.size());
  std::vector<std::optional<std::size_t>> owners;
  for (std::size_t group = 0; group < groups.size(); ++group) {
    candidates[group].places = chosen(free.places, groups[group]);
    candidates[group].points = groups[group].size();
    for (const RimPoint& it : occlusions.rims[group])
      candidates[group].rim.push_back({global_from_cloud * points.places[it.point],
                                       global_from_cloud.linear() * it.outwards, it.is_truncated});
    owners.push_back(ownerOf(candidates[group].places, predicted));
  }
  std::vector<Group> parts = groupsOf(candidates, owners);
  mergeOwners(parts, predicted);
  for (std::size_t part = 0; part < parts.size(); ++part) owners[part] = parts[part].owner;
  std::vector<Bridge> bridges = bridgesByPosition(parts, predicted, planes);
  append(bridges, occlusions.bridges);
  append(bridges, limbBridges(parts, predicted, firstParts(owners, predicted, bridges)));
  return joined(std::move(candidates), firstParts(owners, predicted, bridges));
}

/// Returns whether noise along the line of sight may have moved a point here from outside of the
/// region, or from an expected object.
bool mayBeDisplaced(const Vector3f& point, const Scene& scene, const DepthNoise& noise) {
  const float range = point.norm(), reach = noise.reachAt(range);
  const auto isExcluded = [&](float away) {
    const Vector3f place = point * (1 + away / range);
    return (scene.region && !(*scene.region)(place)) ||
           std::any_of(scene.expected.begin(), scene.expected.end(),
                       [&](const auto& box) { return box(place); });
  };
  for (float away = 0; away < reach;) {
    away = std::min(away + kNoiseStep, reach);
    if (isExcluded(-away) || isExcluded(away)) return true;
  }
  return false;
}

/// Clusters of too few points for an object, such as the visible part of a hand beside a robot, or
/// the rest of an arm without its mixed pixels.
/// \param groups  of free points, large enough for an object
std::vector<Cluster> tipsOf(const FreePoints& free, const std::vector<Indices>& groups,
                            const Points& points, const std::vector<Label>& labels,
                            const Scene& scene, const SupportPlanes& planes, const Walls& walls,
                            const DepthNoise& noise, float gap) {
  std::vector<bool> is_in_group(free.places.size());
  for (const Indices& group : groups)
    for (const std::uint32_t point : group) is_in_group[point] = true;
  Cluster loose;
  for (std::size_t point = 0; point < free.places.size(); ++point)
    if (!is_in_group[point] && !mayBeDisplaced(points.places[free.indices[point]], scene, noise))
      loose.push_back(free.places[point]);
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kThin || mayBeDisplaced(points.places[index], scene, noise))
      continue;
    const Vector3f place = scene.global_from_cloud * points.places[index];
    if (!planes.contain(place) && !walls.wallAt(place)) loose.push_back(place);
  }
  std::vector<Cluster> tips;
  for (const Indices& tip : clustersOf(loose, gap, kMinTipPoints))
    tips.push_back(chosen(loose, tip));
  return tips;
}

/// Maximum distance of a tip from the rest of its object, m.
float reachOf(const FoundObject& object, const std::vector<PredictedObject>& predicted) {
  const auto isIts = [&](const PredictedObject& it) {
    return distanceTo(it.box, object.box.center) == 0 && it.is_moving &&
           it.box.size.maxCoeff() > kMinMovingPersonSize;
  };
  const bool is_person = object.box.size.z() > kMinPersonHeight ||
                         std::any_of(predicted.begin(), predicted.end(), isIts);
  return is_person && object.box.size.head<2>().maxCoeff() < kMaxPersonWidth ? kMaxReach
                                                                             : kMaxLimbGap;
}

/// Distance between the nearest points of two clusters, m; at most `max_gap`.
float gapBetween(const Cluster& one, const Cluster& other, float max_gap) {
  float min_square = max_gap * max_gap;
  for (const Vector3f& place : one)
    for (const Vector3f& it : other) min_square = std::min(min_square, (it - place).squaredNorm());
  return std::sqrt(min_square);
}

/// Assigns each tip to the nearest object that can reach it. If that is wrong, a distance that is
/// too small does less harm than one that is too large.
std::vector<Cluster> tipsByObject(const std::vector<Cluster>& tips,
                                  const std::vector<FoundObject>& objects,
                                  const std::vector<PredictedObject>& predicted) {
  std::vector<Cluster> coarse, by_object(objects.size());
  for (const FoundObject& it : objects) coarse.push_back(thinned(it.places, kMaxLimbGap / 5));
  for (const Cluster& tip : tips) {
    float nearest_gap = kMaxReach;
    std::size_t nearest = kNone;
    for (std::size_t object = 0; object < objects.size(); ++object) {
      const float max_gap = std::min(nearest_gap, reachOf(objects[object], predicted));
      const float gap = gapBetween(tip, coarse[object], max_gap);
      if (gap >= max_gap) continue;
      nearest_gap = gap;
      nearest = object;
    }
    if (nearest != kNone) append(by_object[nearest], tip);
  }
  return by_object;
}

/// Returns whether a box is too thin for an object, such as the edge of a table seen from the side,
/// or noise that remains of a surface.
bool isSliver(const UprightBox& box) {
  std::array<float, 3> edges{box.size.x(), box.size.y(), box.size.z()};
  std::sort(edges.begin(), edges.end());
  return edges[1] < kMinThickness;
}

/// Extends a box down to the surface on which it stands.
UprightBox extendedDown(const UprightBox& box, const SupportPlanes& planes,
                        const Vector3f& sensor) {
  const Vector3f middle = box.center;
  const auto surface = planes.heightBelow(middle, box.size.head<2>().norm() / 2 + kSurfaceMargin);
  return surface ? standing(box, *surface, planes.tolerance(middle), sensor) : box;
}

/// The body from which noise along the line of sight may have moved a point; null if there is none.
const KnownBody* bodyWithinNoise(const PosedBodies& known, const Vector3f& point, float padding,
                                 const DepthNoise& noise) {
  const float range = point.norm(), reach = noise.reachAt(range) - padding;
  for (float away = 0; away < reach;) {
    away = std::min(away + 2 * padding, reach);
    const Vector3f shift = point * (away / range);
    for (const Vector3f& place : {Vector3f(point - shift), Vector3f(point + shift)})
      if (const KnownBody* body = known.covering(place, padding)) return body;
  }
  return nullptr;
}

/// Removes groups of free points that noise may have moved: a few points of a wall beside the
/// region, for example, appear in it.
std::vector<Indices> withoutNoise(std::vector<Indices> groups, const FreePoints& free,
                                  const Points& points, const Scene& scene, const DepthNoise& noise,
                                  std::size_t min_points) {
  const auto isNoise = [&](const Indices& group) {
    std::size_t certain = 0;
    for (const std::uint32_t point : group) {
      if (!mayBeDisplaced(points.places[free.indices[point]], scene, noise)) ++certain;
      if (certain == min_points) return false;
    }
    return true;
  };
  groups.erase(std::remove_if(groups.begin(), groups.end(), isNoise), groups.end());
  return groups;
}

/// Points for a first estimate of the noise, before the robots' points are known.
std::vector<Vector3f> sampledPoints(const Points& points, const Isometry3f& global_from_cloud) {
  const std::size_t stride = points.places.size() / SupportPlanes::kMaxPoints + 1;
  std::vector<Vector3f> chosen;
  for (std::size_t index = 0; index < points.places.size(); index += stride)
    if (points.places[index].allFinite())
      chosen.push_back(global_from_cloud * points.places[index]);
  return chosen;
}

/// Standard deviation of the noise as a vector, see boxAround.
Vector3f blurOf(const Cluster& places, const Vector3f& sensor, const DepthNoise& noise) {
  const Vector3f sum = std::accumulate(places.begin(), places.end(), Vector3f(Vector3f::Zero()));
  const Vector3f ray = sum / static_cast<float>(places.size()) - sensor;
  return ray * (noise.at(ray.norm()) / std::max(ray.norm(), 1e-3F));
}

/// Returns whether a point is within the range of sensors, and of sufficient float precision.
bool isInRange(const Vector3f& point) { return (point.array().abs() < 1e4F).all(); }

}  // namespace

void ObjectFinder::learnNoise(const DepthNoise& seen) {
  if (!noise_) noise_ = seen;
  noise_->at_one_m += kNoiseWeight * (seen.at_one_m - noise_->at_one_m);
}

std::vector<Label> ObjectFinder::label(const Points& points, const Scene& scene) {
  if (!settings_.noise && !noise_)
    noise_ = SupportPlanes(sampledPoints(points, scene.global_from_cloud),
                           scene.global_from_cloud.translation(), settings_.min_surface_area)
                 .noise();
  const DepthNoise noise = this->noise();
  const PosedBodies known(bodies_, scene.cloud_from_body);
  const auto labelOf = [&](const Vector3f& point) {
    if (!isInRange(point)) return Label::kNowhere;
    if (scene.region && !(*scene.region)(point)) return Label::kOutside;
    const KnownBody* body = known.covering(point, settings_.padding);
    if (!body) body = bodyWithinNoise(known, point, settings_.padding, noise);
    if (body) return body->samples ? Label::kRobot : Label::kKnown;
    const bool is_expected = std::any_of(scene.expected.begin(), scene.expected.end(),
                                         [&](const auto& box) { return box(point); });
    return is_expected ? Label::kExpected : Label::kFree;
  };
  std::vector<Label> labels;
  labels.reserve(points.places.size());
  std::transform(points.places.begin(), points.places.end(), std::back_inserter(labels), labelOf);
  markStrayPoints(points, labels);
  return labels;
}

std::vector<FoundObject> ObjectFinder::find(const Points& points, const std::vector<Label>& labels,
                                            const Scene& scene,
                                            const std::vector<PredictedObject>& predicted) {
  const Vector3f sensor = scene.global_from_cloud.translation();
  ++clouds_;
  const bool is_noise_due = !settings_.noise && clouds_ % kSearchPeriod == 1;
  std::vector<Vector3f> around = surroundings(points, labels, scene.global_from_cloud);
  if (walls_)
    walls_->update(around, sensor, noise(), clouds_ % kSearchPeriod == 0);
  else
    walls_.emplace(around, sensor, noise());
  const auto upright = std::partition(around.begin(), around.end(),
                                      [&](const Vector3f& it) { return !walls_->wallAt(it); });
  const std::vector<Vector3f> others(around.begin(), upright);
  surfaces_ = SupportPlanes(others, sensor, settings_.min_surface_area,
                            is_noise_due ? std::nullopt : std::optional(noise()),
                            surfaces_ ? &*surfaces_ : nullptr, {upright, around.end()});
  const SupportPlanes& planes = *surfaces_;
  if (is_noise_due) learnNoise(planes.noise());
  const auto [free, of_wall] = freePoints(points, labels, scene.global_from_cloud, planes, *walls_);
  const auto clusters = clustersOf(free.places, settings_.gap, settings_.min_points);
  const std::vector<Indices> groups =
      divided(largest(withoutNoise(clusters, free, points, scene, noise(), settings_.min_points),
                      kMaxObjects),
              free.places, predicted, settings_.min_points);
  std::vector<Cluster> tips =
      tipsOf(free, clusters, points, labels, scene, planes, *walls_, noise(), settings_.gap);
  std::vector<Candidate> candidates =
      candidatesOf(groups, free, points, labels, scene.global_from_cloud, predicted, planes);
  for (const FreePoints& wall : of_wall) {
    Indices all(wall.places.size());
    std::iota(all.begin(), all.end(), 0);
    if (!withoutNoise({all}, wall, points, scene, noise(), settings_.min_points).empty())
      candidates.push_back({thinned(wall.places, kWallSpacing), {}, wall.places.size()});
  }
  std::vector<FoundObject> objects;
  for (Candidate& candidate : candidates) {
    const Vector3f blur = blurOf(candidate.places, sensor, noise());
    const UprightBox box = boxAround(candidate.places, blur);
    if (isSliver(box)) {  // too thin for an object, but a person may hold it
      if (box.size.maxCoeff() < kMaxLimbGap) tips.push_back(std::move(candidate.places));
      continue;
    }
    objects.push_back({extendedDown(box, planes, sensor), candidate.points, std::nullopt,
                       std::move(candidate.places), std::move(candidate.rim), blur});
  }
  std::vector<Cluster> measured = tipsByObject(tips, objects, predicted);
  const std::vector<Isometry3f> from_body = inGlobalFrame(scene);
  for (std::size_t object = 0; object < objects.size(); ++object) {
    append(measured[object], objects[object].places);
    objects[object].robot = distanceToRobots(measured[object], bodies_, from_body);
  }
  return objects;
}

std::optional<DetectionLimit> ObjectFinder::detectionLimit(const Points& points,
                                                           const std::vector<Label>& labels) const {
  std::vector<float> ranges;
  for (std::size_t index = 0; index < labels.size(); ++index)
    if (labels[index] != Label::kNowhere && labels[index] != Label::kOutside)
      ranges.push_back(points.places[index].norm());
  if (ranges.empty()) return std::nullopt;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  return DetectionLimit{*middle, noise().toleranceAt(*middle)};
}

bool ObjectFinder::looksIntoRegion(const Points& points, const std::vector<Label>& labels,
                                   const Scene& scene) {
  const auto isInside = [](Label it) { return it != Label::kNowhere && it != Label::kOutside; };
  if (!scene.region || std::any_of(labels.begin(), labels.end(), isInside)) return true;
  const std::size_t stride = points.places.size() / kViewSample + 1;
  for (std::size_t index = 0; index < points.places.size(); index += stride) {
    const Vector3f& point = points.places[index];
    if (!isInRange(point)) continue;
    const float steps = std::ceil(std::min(point.norm(), kMaxRayLength) / kRayStep);
    for (float step = 0; step < steps; ++step)
      if ((*scene.region)(point * (step / steps))) return true;
  }
  return false;
}

Agreement ObjectFinder::agreement(const Points& points, const std::vector<Label>& labels,
                                  const Scene& scene) const {
  const PosedBodies known(bodies_, scene.cloud_from_body);
  const std::size_t stride = points.places.size() / kRobotSample + 1;
  Agreement agreement;
  for (std::size_t index = 0; index < points.places.size(); index += stride) {
    if (labels[index] == Label::kNowhere) continue;
    if (labels[index] == Label::kRobot)
      ++agreement.on;
    else if (known.isBehindRobot(points.places[index], kOccludingDepth))
      ++agreement.through;
  }
  return agreement;
}

std::optional<RobotDistance> ObjectFinder::distanceTo(const Cluster& places,
                                                      const Scene& scene) const {
  return distanceToRobots(places, bodies_, inGlobalFrame(scene));
}

}  // namespace process_visualizer::objects
