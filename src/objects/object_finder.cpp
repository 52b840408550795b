// SPDX-License-Identifier: BSD-3-Clause
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
#include "process_visualizer/objects/somebody.hpp"
#include "process_visualizer/objects/support_planes.hpp"
#include "process_visualizer/objects/walls.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kThinnest = 0.025F;       // m: smaller in two directions is no object
constexpr float kBesideAbove = 0.03F;     // m: what is one above the other is no farther aside
constexpr float kAboveGap = 0.3F;         // m: nor farther apart
constexpr float kThickest = 0.14F;        // m: limbs are no thicker,
constexpr float kWidest = 0.32F;          // m: nor wider, with a foot
constexpr float kSpread = 1.5F;           // m: somebody is less wide; a wall is not
constexpr std::size_t kFewestInTip = 5;   // points
constexpr float kPartGap = 0.1F;          // m: parts of one object are no farther apart
constexpr float kTogether = 1.2F;         // m/s: what comes into view seems to be slower or faster
constexpr float kWallStep = 0.02F;        // m: between the places of a wall that are measured
constexpr float kNoiseStep = 0.03F;       // m: along the line of sight
constexpr std::size_t kSearchClouds = 5;  // one of so many is searched for walls, one for noise
constexpr float kNoiseShare = 0.3F;       // of a cloud, in the estimate of the noise
constexpr float kAround = 0.1F;           // m: so far around an object its surface is measured
constexpr float kNear = 0.04F;            // m: how wrong the predicted place may be
constexpr float kFewestShare = 0.15F;     // of a group's points, of each object in it
constexpr std::size_t kSightSample = 2000;  // points of a cloud tell where it looks,
constexpr std::size_t kRobotSample = 4000;  // and whether robots are there
constexpr float kSightStep = 0.05F;         // m, along a line of sight
constexpr float kFarthestLook = 20;         // m
constexpr float kHiddenDepth = 0.02F;       // m: depth at which a robot hides what is behind
constexpr std::size_t kSample = 200;        // points of a group tell whose it is
constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

/// Which predicted object is nearest to a place, of those that are nearer than `farthest` (m).
std::size_t nearestTo(const Vector3f& place, const std::vector<PredictedObject>& predicted,
                      const std::vector<std::size_t>& candidates, float farthest) {
  std::size_t nearest = kNobody;
  for (const std::size_t object : candidates) {
    const UprightBox& box = predicted[object].box;
    const float reach = farthest + box.size.norm() / 2;
    if ((place - box.center).squaredNorm() >= reach * reach) continue;
    const float away = distanceTo(box, place);
    if (away >= farthest) continue;
    farthest = away;
    nearest = object;
  }
  return nearest;
}

/// Whether the middle of one box lies in the other: such boxes are one thing.
bool areOne(const UprightBox& one, const UprightBox& other) {
  return distanceTo(one, other.center) == 0 || distanceTo(other, one.center) == 0;
}

/// How many points of a sample belong to each predicted object.
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
  for (std::size_t point = 0; point < points; point += points / kSample + 1) {
    const std::size_t object = nearestTo(pointAt(point), predicted, all, kNear);
    if (object != kNobody) ++counts.of_object[object];
    ++counts.sample;
  }
  return counts;
}

/// The predicted objects of which a group has points of their own.
std::vector<std::size_t> objectsIn(const Indices& group, const Cluster& places,
                                   const std::vector<PredictedObject>& predicted,
                                   std::size_t fewest) {
  const Counts counts = countsOf(
      group.size(), [&](std::size_t point) { return places[group[point]]; }, predicted);
  const float least =
      std::max(kFewestShare, static_cast<float>(fewest) / static_cast<float>(group.size()));
  std::vector<std::size_t> objects;
  for (std::size_t object = 0; object < predicted.size(); ++object) {
    const bool is_other = std::none_of(objects.begin(), objects.end(), [&](std::size_t it) {
      return areOne(predicted[it].box, predicted[object].box);
    });
    const auto count = static_cast<float>(counts.of_object[object]);
    if (is_other && count >= least * static_cast<float>(counts.sample)) objects.push_back(object);
  }
  return objects;
}

/// Which predicted object, if any, more than half of a group's points belong to, as they lie in its
/// box or near to it.
std::optional<std::size_t> ownerOf(const Cluster& points,
                                   const std::vector<PredictedObject>& predicted) {
  const Counts counts = countsOf(
      points.size(), [&](std::size_t point) { return points[point]; }, predicted);
  const auto most = std::max_element(counts.of_object.begin(), counts.of_object.end());
  if (most == counts.of_object.end() || 2 * *most <= counts.sample) return std::nullopt;
  return static_cast<std::size_t>(most - counts.of_object.begin());
}

/// Divides groups in which several predicted objects touch: each point belongs to the nearest one.
/// \param places  of all points
/// \param fewest  points of an object
std::vector<Indices> divided(const std::vector<Indices>& groups, const Cluster& places,
                             const std::vector<PredictedObject>& predicted, std::size_t fewest) {
  std::vector<Indices> parts;
  for (const Indices& group : groups) {
    const std::vector<std::size_t> objects = objectsIn(group, places, predicted, fewest);
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

/// Which groups are parts of one thing that something hides in between: those that belong to one
/// predicted object, and those that may go on as one surface, and belong to none that is known to
/// be smaller. \return for each group the first one of its thing
std::vector<std::uint32_t> wholes(const std::vector<std::optional<std::size_t>>& owners,
                                  const std::vector<PredictedObject>& predicted,
                                  const std::vector<Bridge>& bridges) {
  const auto mayGrow = [&](const std::optional<std::size_t>& owner) {
    return !owner || !predicted[*owner].is_whole || predicted[*owner].is_moving;
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

/// Points for the search of planes, in the global frame. What surrounds the region tells more about
/// a surface than the little of it that a region may contain.
std::vector<Vector3f> surroundings(const Points& points, const std::vector<Label>& labels,
                                   const Isometry3f& global_from_cloud) {
  const std::size_t stride = labels.size() / SupportPlanes::kMostPoints + 1;
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

/// Those that are on no surface: those that are on no wall either, and those of each wall.
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

/// The parts of a FoundObject that are known before it is measured.
struct Thing {
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

/// The indices in the cloud of groups of free points.
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

/// The things, those joined that have the same first one.
std::vector<Thing> joined(std::vector<Thing> things, const std::vector<std::uint32_t>& firsts) {
  std::vector<Thing> result;
  for (std::uint32_t number = 0; number < things.size(); ++number) {
    if (firsts[number] == number) continue;
    append(things[firsts[number]].places, things[number].places);
    append(things[firsts[number]].rim, things[number].rim);
    things[firsts[number]].points += things[number].points;
  }
  for (std::uint32_t number = 0; number < things.size(); ++number)
    if (firsts[number] == number) result.push_back(std::move(things[number]));
  return result;
}

/// How far apart two ranges along an axis are, m; negative where they overlap.
float gapAlong(const AlignedBox3f& one, const AlignedBox3f& other, int axis) {
  return std::max(one.min()[axis] - other.max()[axis], other.min()[axis] - one.max()[axis]);
}

/// Whether some points of two groups are as near to each other, seen from above, as a limb and what
/// carries it: what is between is hidden most often by what is above it.
bool areNear(const Cluster& one, const Cluster& other) {
  return std::any_of(one.begin(), one.end(), [&](const Vector3f& place) {
    return std::any_of(other.begin(), other.end(), [&](const Vector3f& it) {
      return (it - place).head<2>().squaredNorm() < kLimbGap * kLimbGap;
    });
  });
}

/// Whether points are as slender as a limb along their principal axes.
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
  return lengths.minCoeff() < kThickest &&
         lengths.sum() - lengths.minCoeff() - lengths.maxCoeff() < kWidest;
}

/// What groups are like that may be parts of one thing.
struct Group {
  AlignedBox3f box;
  Cluster coarse;                    ///< its points, thinned
  bool is_slender;                   ///< as a limb is, in its own direction: a leg may swing
  std::optional<std::size_t> owner;  ///< the predicted object of which it is a part
};

std::vector<Group> groupsOf(const std::vector<Thing>& things,
                            const std::vector<std::optional<std::size_t>>& owners) {
  std::vector<Group> groups;
  for (std::size_t number = 0; number < things.size(); ++number) {
    const Cluster& places = things[number].places;
    Group group{{}, thinned(places, kLimbGap / 5), isSlender(places), owners[number]};
    for (const Vector3f& place : places) group.box.extend(place);
    groups.push_back(std::move(group));
  }
  return groups;
}

/// Whether something may be a person, or a large part of one. What is known to stand and is lower
/// is none: it has no limbs that come in later.
bool isSomebody(const AlignedBox3f& box, const PredictedObject* owner) {
  if (!owner) return box.sizes().z() > kTall;
  return mayBeSomebody(owner->box.size, !owner->stands);
}

const PredictedObject* ownerIn(const std::vector<PredictedObject>& predicted,
                               const std::optional<std::size_t>& owner) {
  return owner ? &predicted[*owner] : nullptr;
}

/// Calls a function with all pairs of groups, the smaller number first, and how far apart they are
/// seen from above and in height, m.
template <typename Look>
void forPairs(const std::vector<Group>& groups, const Look& look) {
  for (std::uint32_t other = 0; other < groups.size(); ++other) {
    for (std::uint32_t one = 0; one < other; ++one) {
      const AlignedBox3f &a = groups[one].box, &b = groups[other].box;
      look(one, other, std::max(gapAlong(a, b, 0), gapAlong(a, b, 1)), gapAlong(a, b, 2));
    }
  }
}

/// Whether one group is right above the other, and they are as high as a person together; what is
/// lower together may be an arm above a box.
/// \param aside, apart  see forPairs
bool areSomebody(const Group& a, const Group& b, const std::vector<PredictedObject>& predicted,
                 float aside, float apart) {
  const AlignedBox3f both = a.box.merged(b.box);
  return aside < kBesideAbove && apart > -kBesideAbove && apart < kAboveGap &&
         (both.sizes().z() > kTall || isSomebody(both, ownerIn(predicted, a.owner)) ||
          isSomebody(both, ownerIn(predicted, b.owner)));
}

/// Makes one object of two that are somebody and move together: a head and an arm, for example, may
/// have been seen before what joins them.
void unite(std::vector<Group>& groups, const std::vector<PredictedObject>& predicted) {
  forPairs(groups, [&](std::uint32_t one, std::uint32_t other, float aside, float apart) {
    Group &a = groups[one], &b = groups[other];
    const PredictedObject *first = ownerIn(predicted, a.owner),
                          *second = ownerIn(predicted, b.owner);
    if (!first || !second || !first->is_moving || !second->is_moving) return;
    if ((first->velocity - second->velocity).head<2>().norm() > kTogether) return;
    if (!areSomebody(a, b, predicted, aside, apart)) return;
    const bool is_smaller = first->box.size.prod() < second->box.size.prod();
    (is_smaller ? a : b).owner = is_smaller ? b.owner : a.owner;
  });
}

/// Whether one group is right above the other and so near that it hides what joins them, such as
/// the upper disc of a drum its core, and no surface carries it. What moves passes above others.
/// \param aside, apart  see forPairs
bool areStacked(const Group& a, const Group& b, const std::vector<PredictedObject>& predicted,
                float aside, float apart, const SupportPlanes& planes) {
  if (aside >= 0 || apart <= -kBesideAbove || apart >= kPartGap) return false;
  for (const Group* group : {&a, &b})
    if (group->owner && predicted[*group->owner].is_moving) return false;
  const bool is_first_above = a.box.min().z() > b.box.min().z();
  const AlignedBox3f &upper = is_first_above ? a.box : b.box,
                     &lower = is_first_above ? b.box : a.box;
  const auto surface = planes.heightBelow(upper.center(), upper.sizes().head<2>().norm() / 2);
  return !surface || *surface < lower.max().z() - kPartGap;
}

/// Groups that are somebody, such as legs and a chest between which too little is seen; those that
/// are stacked. And parts of one object that is followed, such as an arm that swings.
std::vector<Bridge> bridgesByPlace(const std::vector<Group>& groups,
                                   const std::vector<PredictedObject>& predicted,
                                   const SupportPlanes& planes) {
  std::vector<Bridge> bridges;
  forPairs(groups, [&](std::uint32_t one, std::uint32_t other, float aside, float apart) {
    const Group &a = groups[one], &b = groups[other];
    const bool is_above = areSomebody(a, b, predicted, aside, apart) ||
                          areStacked(a, b, predicted, aside, apart, planes);
    const bool is_same = a.owner && a.owner == b.owner && std::max(aside, apart) < kPartGap;
    if (is_above || is_same) bridges.push_back({one, other, is_above});
  });
  return bridges;
}

/// What is new, long and near to somebody, such as an arm of which the shoulder hides a part.
/// \param firsts  of each group the first one of its thing so far: legs and a chest that are two
/// groups are somebody together
std::vector<Bridge> bridgesOfLimbs(const std::vector<Group>& groups,
                                   const std::vector<PredictedObject>& predicted,
                                   const std::vector<std::uint32_t>& firsts) {
  std::vector<AlignedBox3f> boxes(groups.size());
  std::vector<bool> has_somebody(groups.size());
  for (std::size_t group = 0; group < groups.size(); ++group)
    boxes[firsts[group]].extend(groups[group].box);
  for (std::size_t group = 0; group < groups.size(); ++group)
    if (isSomebody(boxes[firsts[group]], ownerIn(predicted, groups[group].owner)))
      has_somebody[firsts[group]] = true;
  const auto isBody = [&](std::uint32_t group) { return has_somebody[firsts[group]]; };
  const auto isLimb = [&](std::uint32_t group) {
    return groups[group].is_slender || isBody(group);
  };
  std::vector<Bridge> bridges;
  forPairs(groups, [&](std::uint32_t one, std::uint32_t other, float aside, float apart) {
    if ((isBody(one) && isLimb(other)) || (isBody(other) && isLimb(one)))
      if (aside < kLimbGap && apart < kLimbGap && areNear(groups[one].coarse, groups[other].coarse))
        bridges.push_back({one, other, true});
  });
  return bridges;
}

/// The things that groups of free points are.
std::vector<Thing> thingsOf(const std::vector<Indices>& groups, const FreePoints& free,
                            const Points& points, const std::vector<Label>& labels,
                            const Isometry3f& global_from_cloud,
                            const std::vector<PredictedObject>& predicted,
                            const SupportPlanes& planes) {
  const Occlusions occlusions = occlusionsOf(points, labels, inCloud(groups, free.indices));
  std::vector<Thing> things(groups.size());
  std::vector<std::optional<std::size_t>> owners;
  for (std::size_t group = 0; group < groups.size(); ++group) {
    things[group].places = chosen(free.places, groups[group]);
    things[group].points = groups[group].size();
    for (const RimPoint& it : occlusions.rims[group])
      things[group].rim.push_back({global_from_cloud * points.places[it.point],
                                   global_from_cloud.linear() * it.outwards, it.is_cut});
    owners.push_back(ownerOf(things[group].places, predicted));
  }
  std::vector<Group> parts = groupsOf(things, owners);
  unite(parts, predicted);
  for (std::size_t part = 0; part < parts.size(); ++part) owners[part] = parts[part].owner;
  std::vector<Bridge> bridges = bridgesByPlace(parts, predicted, planes);
  append(bridges, occlusions.bridges);
  append(bridges, bridgesOfLimbs(parts, predicted, wholes(owners, predicted, bridges)));
  return joined(std::move(things), wholes(owners, predicted, bridges));
}

/// Whether noise along the line of sight may have moved a point here from outside of the region, or
/// from something that is expected.
bool mayBeElsewhere(const Vector3f& point, const Scene& scene, const DepthNoise& noise) {
  const float range = point.norm(), farthest = noise.reachAt(range);
  const auto isElsewhere = [&](float away) {
    const Vector3f place = point * (1 + away / range);
    return (scene.region && !(*scene.region)(place)) ||
           std::any_of(scene.expected.begin(), scene.expected.end(),
                       [&](const auto& box) { return box(place); });
  };
  for (float away = 0; away < farthest;) {
    away = std::min(away + kNoiseStep, farthest);
    if (isElsewhere(-away) || isElsewhere(away)) return true;
  }
  return false;
}

/// Points that are too few for an object of their own, such as what is seen of a hand beside a
/// robot, or what the sensor's edges leave of an arm.
/// \param groups  of free points that are enough
std::vector<Cluster> tipsOf(const FreePoints& free, const std::vector<Indices>& groups,
                            const Points& points, const std::vector<Label>& labels,
                            const Scene& scene, const SupportPlanes& planes, const Walls& walls,
                            const DepthNoise& noise, float gap) {
  std::vector<bool> is_in_group(free.places.size());
  for (const Indices& group : groups)
    for (const std::uint32_t point : group) is_in_group[point] = true;
  Cluster loose;
  for (std::size_t point = 0; point < free.places.size(); ++point)
    if (!is_in_group[point] && !mayBeElsewhere(points.places[free.indices[point]], scene, noise))
      loose.push_back(free.places[point]);
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kThin || mayBeElsewhere(points.places[index], scene, noise))
      continue;
    const Vector3f place = scene.global_from_cloud * points.places[index];
    if (!planes.contain(place) && !walls.wallAt(place)) loose.push_back(place);
  }
  std::vector<Cluster> tips;
  for (const Indices& tip : clustersOf(loose, gap, kFewestInTip))
    tips.push_back(chosen(loose, tip));
  return tips;
}

/// How far from the rest of an object a tip of it may be, m.
float reachOf(const FoundObject& object, const std::vector<PredictedObject>& predicted) {
  const auto isIts = [&](const PredictedObject& it) {
    return distanceTo(it.box, object.box.center) == 0 && it.is_moving &&
           it.box.size.maxCoeff() > kLimbed;
  };
  const bool is_somebody =
      object.box.size.z() > kTall || std::any_of(predicted.begin(), predicted.end(), isIts);
  return is_somebody && object.box.size.head<2>().maxCoeff() < kSpread ? kArm : kLimbGap;
}

/// How far apart the nearest points of two clusters are, m; `farthest` if that is less.
float gapBetween(const Cluster& one, const Cluster& other, float farthest) {
  float least = farthest * farthest;
  for (const Vector3f& place : one)
    for (const Vector3f& it : other) least = std::min(least, (it - place).squaredNorm());
  return std::sqrt(least);
}

/// The tips of each object: each tip is of the nearest object within whose reach it is. Whatever it
/// is, a distance that is too small does less harm than one that is too large.
std::vector<Cluster> tipsByObject(const std::vector<Cluster>& tips,
                                  const std::vector<FoundObject>& objects,
                                  const std::vector<PredictedObject>& predicted) {
  std::vector<Cluster> coarse, by_object(objects.size());
  for (const FoundObject& it : objects) coarse.push_back(thinned(it.places, kLimbGap / 5));
  for (const Cluster& tip : tips) {
    float least = kArm;
    std::size_t nearest = kNobody;
    for (std::size_t object = 0; object < objects.size(); ++object) {
      const float farthest = std::min(least, reachOf(objects[object], predicted));
      const float gap = gapBetween(tip, coarse[object], farthest);
      if (gap >= farthest) continue;
      least = gap;
      nearest = object;
    }
    if (nearest != kNobody) append(by_object[nearest], tip);
  }
  return by_object;
}

/// The edge of a table, seen from the side, or what noise leaves of a surface.
bool isSliver(const UprightBox& box) {
  std::array<float, 3> edges{box.size.x(), box.size.y(), box.size.z()};
  std::sort(edges.begin(), edges.end());
  return edges[1] < kThinnest;
}

/// The box, down to the surface on which it stands.
UprightBox reachingDown(const UprightBox& box, const SupportPlanes& planes,
                        const Vector3f& sensor) {
  const Vector3f middle = box.center;
  const auto surface = planes.heightBelow(middle, box.size.head<2>().norm() / 2 + kAround);
  return surface ? standing(box, *surface, planes.tolerance(middle), sensor) : box;
}

/// The body on which a point is, if noise along the line of sight may have moved it off.
const KnownBody* bodyBeside(const PosedBodies& known, const Vector3f& point, float padding,
                            const DepthNoise& noise) {
  const float range = point.norm(), farthest = noise.reachAt(range) - padding;
  for (float away = 0; away < farthest;) {
    away = std::min(away + 2 * padding, farthest);
    const Vector3f shift = point * (away / range);
    for (const Vector3f& place : {Vector3f(point - shift), Vector3f(point + shift)})
      if (const KnownBody* body = known.covering(place, padding)) return body;
  }
  return nullptr;
}

/// Removes groups of free points that the noise may have moved: a wall beside the region, for
/// example, is seen in it here and there.
std::vector<Indices> withoutNoise(std::vector<Indices> groups, const FreePoints& free,
                                  const Points& points, const Scene& scene, const DepthNoise& noise,
                                  std::size_t fewest) {
  const auto isNoise = [&](const Indices& group) {
    std::size_t sure = 0;
    for (const std::uint32_t point : group) {
      if (!mayBeElsewhere(points.places[free.indices[point]], scene, noise)) ++sure;
      if (sure == fewest) return false;
    }
    return true;
  };
  groups.erase(std::remove_if(groups.begin(), groups.end(), isNoise), groups.end());
  return groups;
}

/// Points for a first estimate of the noise, before it is known which ones are on a robot.
std::vector<Vector3f> anyPoints(const Points& points, const Isometry3f& global_from_cloud) {
  const std::size_t stride = points.places.size() / SupportPlanes::kMostPoints + 1;
  std::vector<Vector3f> chosen;
  for (std::size_t index = 0; index < points.places.size(); index += stride)
    if (points.places[index].allFinite())
      chosen.push_back(global_from_cloud * points.places[index]);
  return chosen;
}

/// What noise does to places: see boxAround.
Vector3f blurOf(const Cluster& places, const Vector3f& sensor, const DepthNoise& noise) {
  const Vector3f sum = std::accumulate(places.begin(), places.end(), Vector3f(Vector3f::Zero()));
  const Vector3f ray = sum / static_cast<float>(places.size()) - sensor;
  return ray * (noise.at(ray.norm()) / std::max(ray.norm(), 1e-3F));
}

/// Whether a point is within what a sensor can see, and float can represent.
bool isInReach(const Vector3f& point) { return (point.array().abs() < 1e4F).all(); }

}  // namespace

void ObjectFinder::learnNoise(const DepthNoise& seen) {
  if (!noise_) noise_ = seen;
  noise_->at_one_m += kNoiseShare * (seen.at_one_m - noise_->at_one_m);
}

std::vector<Label> ObjectFinder::label(const Points& points, const Scene& scene) {
  if (!settings_.noise && !noise_)
    noise_ = SupportPlanes(anyPoints(points, scene.global_from_cloud),
                           scene.global_from_cloud.translation(), settings_.surface)
                 .noise();
  const DepthNoise noise = this->noise();
  const PosedBodies known(bodies_, scene.cloud_from_body);
  const auto labelOf = [&](const Vector3f& point) {
    if (!isInReach(point)) return Label::kNowhere;
    if (scene.region && !(*scene.region)(point)) return Label::kOutside;
    const KnownBody* body = known.covering(point, settings_.padding);
    if (!body) body = bodyBeside(known, point, settings_.padding, noise);
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
  const bool is_noise_due = !settings_.noise && clouds_ % kSearchClouds == 1;
  std::vector<Vector3f> around = surroundings(points, labels, scene.global_from_cloud);
  if (walls_)
    walls_->update(around, sensor, noise(), clouds_ % kSearchClouds == 0);
  else
    walls_.emplace(around, sensor, noise());
  const auto upright = std::partition(around.begin(), around.end(),
                                      [&](const Vector3f& it) { return !walls_->wallAt(it); });
  const std::vector<Vector3f> others(around.begin(), upright);
  surfaces_ = SupportPlanes(others, sensor, settings_.surface,
                            is_noise_due ? std::nullopt : std::optional(noise()),
                            surfaces_ ? &*surfaces_ : nullptr, {upright, around.end()});
  const SupportPlanes& planes = *surfaces_;
  if (is_noise_due) learnNoise(planes.noise());
  const auto [free, of_wall] = freePoints(points, labels, scene.global_from_cloud, planes, *walls_);
  const auto clusters = clustersOf(free.places, settings_.gap, settings_.fewest);
  const std::vector<Indices> groups = divided(
      largest(withoutNoise(clusters, free, points, scene, noise(), settings_.fewest), kMostObjects),
      free.places, predicted, settings_.fewest);
  std::vector<Cluster> tips =
      tipsOf(free, clusters, points, labels, scene, planes, *walls_, noise(), settings_.gap);
  std::vector<Thing> things =
      thingsOf(groups, free, points, labels, scene.global_from_cloud, predicted, planes);
  for (const FreePoints& wall : of_wall) {
    Indices all(wall.places.size());
    std::iota(all.begin(), all.end(), 0);
    if (!withoutNoise({all}, wall, points, scene, noise(), settings_.fewest).empty())
      things.push_back({thinned(wall.places, kWallStep), {}, wall.places.size()});
  }
  std::vector<FoundObject> objects;
  for (Thing& thing : things) {
    const Vector3f blur = blurOf(thing.places, sensor, noise());
    const UprightBox box = boxAround(thing.places, blur);
    if (isSliver(box)) {  // too thin for an object, but somebody may hold it
      if (box.size.maxCoeff() < kLimbGap) tips.push_back(std::move(thing.places));
      continue;
    }
    objects.push_back({reachingDown(box, planes, sensor), thing.points, std::nullopt,
                       std::move(thing.places), std::move(thing.rim), blur});
  }
  std::vector<Cluster> measured = tipsByObject(tips, objects, predicted);
  const std::vector<Isometry3f> from_body = inGlobalFrame(scene);
  for (std::size_t object = 0; object < objects.size(); ++object) {
    append(measured[object], objects[object].places);
    objects[object].robot = distanceToRobots(measured[object], bodies_, from_body);
  }
  return objects;
}

std::optional<Sight> ObjectFinder::sight(const Points& points,
                                         const std::vector<Label>& labels) const {
  std::vector<float> ranges;
  for (std::size_t index = 0; index < labels.size(); ++index)
    if (labels[index] != Label::kNowhere && labels[index] != Label::kOutside)
      ranges.push_back(points.places[index].norm());
  if (ranges.empty()) return std::nullopt;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  return Sight{*middle, noise().toleranceAt(*middle)};
}

bool ObjectFinder::looksIntoRegion(const Points& points, const std::vector<Label>& labels,
                                   const Scene& scene) {
  const auto isInside = [](Label it) { return it != Label::kNowhere && it != Label::kOutside; };
  if (!scene.region || std::any_of(labels.begin(), labels.end(), isInside)) return true;
  const std::size_t stride = points.places.size() / kSightSample + 1;
  for (std::size_t index = 0; index < points.places.size(); index += stride) {
    const Vector3f& point = points.places[index];
    if (!isInReach(point)) continue;
    const float steps = std::ceil(std::min(point.norm(), kFarthestLook) / kSightStep);
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
    else if (known.isBehindRobot(points.places[index], kHiddenDepth))
      ++agreement.through;
  }
  return agreement;
}

std::optional<RobotDistance> ObjectFinder::distanceTo(const Cluster& places,
                                                      const Scene& scene) const {
  return distanceToRobots(places, bodies_, inGlobalFrame(scene));
}

}  // namespace process_visualizer::objects
