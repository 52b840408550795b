// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/object_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "process_visualizer/objects/assignment.hpp"
#include "process_visualizer/objects/partly_hidden.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr int kTimesUntilSure = 3;
constexpr float kFarthest = 0.25F;    // m: an object is not farther from where it is expected,
constexpr float kFastest = 3;         // m/s: but what is new may move so fast,
constexpr float kSharpest = 8;        // m/s²: and what is known change its speed so much
constexpr float kLongestStep = 0.3F;  // s: in which it may
constexpr float kAlike = 0.5F;        // of its size: what is so far away differs no more
constexpr float kMoving = 0.3F;       // m/s
constexpr float kLarge = 0.05F;       // m: two edges of what is no noise
constexpr std::size_t kClear = 80;    // points of it
constexpr double kApproach = 0.5;     // s: in which it is seen whether a distance shrinks
constexpr double kShortestApproach = 0.09;  // s
constexpr float kSlowestApproach = 0.05F;   // m/s
constexpr float kSizeWeight = 0.5F;         // of a difference in size, beside one in place
constexpr float kNewestShare = 0.2F;        // of the newest value in the mean
constexpr float kPartReach = 0.04F;  // m: so far beside an object a part of it may seem to be
constexpr float kWhole = 0.015F;     // m: what differs less from the whole is not a part of it
constexpr double kJump = 2.0;        // s
constexpr std::size_t kKept = 1000;  // places of an object: a centimetre apart on a large one

float mean(float old, float newest) { return old + kNewestShare * (newest - old); }

/// The same box with that of its four descriptions whose first edge is nearest to a direction.
UprightBox turnedTowards(UprightBox box, float yaw) {
  const auto quarters = static_cast<int>(std::lround((yaw - box.yaw) / M_PI_2));
  box.yaw += static_cast<float>(quarters * M_PI_2);
  if (quarters % 2 != 0) std::swap(box.size.x(), box.size.y());
  return box;
}

/// How far apart two boxes are, m. Which of the upper and the lower side is seen depends on the
/// sensor, and the other may be thought to be elsewhere: the one that agrees better counts.
float apart(const UprightBox& one, const UprightBox& other) {
  const Vector3f shift = other.center - one.center;
  const float grown = (other.size.z() - one.size.z()) / 2;
  return std::hypot(shift.head<2>().norm(),
                    std::min(std::abs(shift.z() + grown), std::abs(shift.z() - grown)));
}

/// Whether a box is not too far beside another one to be the same thing or a part of it.
bool isNear(const UprightBox& expected, const UprightBox& found, float farthest) {
  return distanceTo(expected, {found.center.x(), found.center.y(), expected.center.z()}) <=
         farthest;
}

/// Whether something is so large that it is hardly noise.
bool isLarge(const FoundObject& found) {
  const Vector3f size = found.box.size;
  return found.points >= kClear && size.sum() - size.maxCoeff() - size.minCoeff() > kLarge;
}

/// Where the upper side is. How far down an object reaches is not always seen, and jumps then.
Vector3f upperSide(const UprightBox& box) { return box.center + Vector3f(0, 0, box.size.z() / 2); }

/// At most `kKept` of the places, evenly chosen.
Cluster thinned(const Cluster& places) {
  const std::size_t stride = (places.size() + kKept - 1) / kKept;
  if (stride <= 1) return places;
  Cluster kept;
  for (std::size_t index = 0; index < places.size(); index += stride) kept.push_back(places[index]);
  return kept;
}

UprightBox smoothed(const UprightBox& old, const UprightBox& newest) {
  UprightBox box = newest;
  box.yaw = mean(old.yaw, newest.yaw);
  box.size = old.size + kNewestShare * (newest.size - old.size);
  box.center.z() += (newest.size.z() - box.size.z()) / 2;
  return box;
}

}  // namespace

UprightBox ObjectTracks::Track::expectedAt(double stamp) const {
  UprightBox box = object.box;
  box.center += motion.shiftAt(stamp);
  box.yaw += motion.turnAt(stamp);
  return box;
}

/// How far from where it is expected it may be, m.
float ObjectTracks::Track::farthestAt(double stamp) const {
  const float passed = std::min(static_cast<float>(stamp - seen), kLongestStep);
  return kFarthest + (is_sure ? kSharpest / 2 * passed * passed : kFastest * passed);
}

/// Whether less than the whole of this object can be measured.
bool ObjectTracks::Track::isPartOf(const UprightBox& expected, const FoundObject& found) const {
  if (!is_whole || !found.isCut()) return false;
  const Vector3f seen = turnedTowards(found.box, expected.yaw).size - expected.size;
  return seen.cwiseAbs().maxCoeff() > kWhole;
}

/// The box that a found object would have as this one.
UprightBox ObjectTracks::Track::measured(const UprightBox& expected,
                                         const FoundObject& found) const {
  if (isPartOf(expected, found)) return completed(expected, found);
  return turnedTowards(found.box, expected.yaw);
}

void ObjectTracks::Track::follow(double stamp, const FoundObject& found) {
  const UprightBox expected = expectedAt(stamp), box = measured(expected, found);
  const bool is_smoothed = is_whole && !isPartOf(expected, found);
  const UprightBox before = object.box;
  motion.add(stamp, upperSide(box), box.yaw);
  is_current = true;
  object = {is_smoothed ? smoothed(expected, box) : box, found.points, found.robot};
  keepPlaces(before, found);
  seen = hidden = stamp;
  is_whole = is_whole || !found.isCut();
  ++times;
}

/// Of an object that is partly hidden the places that were seen before move with it.
void ObjectTracks::Track::keepPlaces(const UprightBox& before, const FoundObject& found) {
  if (!found.isCut() || found.points >= most || places.empty()) {
    places = thinned(found.places);
    most = found.points;
    return;
  }
  const Vector3f shift = upperSide(object.box) - upperSide(before);
  for (Vector3f& place : places) place += shift;
}

/// What is hidden of an object may be nearer to a robot than what is seen of it.
void ObjectTracks::Track::measureDistance(double stamp, const DistanceOf& distance_of) {
  const bool is_now = seen == stamp;
  if (places.empty() || (is_now && object.points >= most)) return;
  const auto kept = distance_of(places);
  const bool is_nearer = kept && object.robot && kept->distance < object.robot->distance;
  if (!is_now || is_nearer) object.robot = kept;
  is_current = is_now && !is_nearer;
}

void ObjectTracks::Track::noteDistance(double stamp) {
  if (!object.robot) return;
  distances.emplace_back(stamp, object.robot->distance);
  while (stamp - distances.front().first > kApproach) distances.pop_front();
}

/// When the distance is gone if it goes on shrinking as of late (least squares).
std::optional<float> ObjectTracks::Track::contact() const {
  if (distances.size() < 2 || distances.back().first - distances.front().first < kShortestApproach)
    return std::nullopt;
  double time = 0, distance = 0, square = 0, product = 0;
  for (const auto& [stamp, value] : distances) {
    time += stamp / static_cast<double>(distances.size());
    distance += value / static_cast<double>(distances.size());
  }
  for (const auto& [stamp, value] : distances) {
    square += (stamp - time) * (stamp - time);
    product += (stamp - time) * (value - distance);
  }
  const auto speed = static_cast<float>(-product / square);
  if (speed < kSlowestApproach) return std::nullopt;
  return std::max(0.0F, distances.back().second) / speed;
}

TrackedObject ObjectTracks::Track::shown(double stamp) const {
  return {*number, object, seen == stamp, is_sure, is_current, motion.velocity(), contact()};
}

void ObjectTracks::reset() { *this = {}; }

bool ObjectTracks::isJump(double stamp) const {
  return last_ && (stamp < *last_ || stamp - *last_ > kJump);
}

std::vector<ExpectedObject> ObjectTracks::expectedAt(double stamp) const {
  std::vector<ExpectedObject> expected;
  if (isJump(stamp)) return expected;
  for (const Track& track : tracks_)
    if (track.number)
      expected.push_back(
          {track.expectedAt(stamp), track.is_whole, track.motion.velocity().norm() > kMoving});
  return expected;
}

std::vector<TrackedObject> ObjectTracks::update(double stamp, const std::vector<FoundObject>& found,
                                                const IsHidden& is_hidden,
                                                const DistanceOf& distance_of) {
  if (isJump(stamp)) reset();
  assign(stamp, found);
  last_ = stamp;
  forget(stamp, is_hidden);
  if (distance_of)
    for (Track& track : tracks_)
      if (track.number) track.measureDistance(stamp, distance_of);
  std::vector<TrackedObject> objects;
  for (Track& track : tracks_) {
    track.noteDistance(stamp);
    if (track.number) objects.push_back(track.shown(stamp));
  }
  std::sort(objects.begin(), objects.end(),
            [](const auto& one, const auto& other) { return one.number < other.number; });
  return objects;
}

/// Of each track (row) with each found object: how far away it is, and how much larger or smaller.
Eigen::MatrixXf ObjectTracks::costs(double stamp, const std::vector<FoundObject>& found) const {
  Eigen::MatrixXf costs(tracks_.size(), found.size());
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    const UprightBox expected = tracks_[track].expectedAt(stamp);
    const float farthest = tracks_[track].farthestAt(stamp);
    for (std::size_t object = 0; object < found.size(); ++object) {
      costs(track, object) = kForbidden;
      if (!isNear(expected, found[object].box, farthest)) continue;
      const UprightBox box = tracks_[track].measured(expected, found[object]);
      const float away = apart(expected, box), grown = (box.size - expected.size).norm();
      const bool is_alike = away < kFarthest || grown < kAlike * expected.size.norm();
      if (away < farthest && is_alike) costs(track, object) = away + kSizeWeight * grown;
    }
  }
  return costs;
}

/// What is left over is new.
void ObjectTracks::assign(double stamp, const std::vector<FoundObject>& found) {
  std::vector<bool> is_new(found.size(), true);
  const auto pairs = bestPairs(costs(stamp, found));
  for (std::size_t track = 0; track < pairs.size(); ++track) {
    if (!pairs[track]) continue;
    follow(tracks_[track], stamp, found[*pairs[track]]);
    is_new[*pairs[track]] = false;
  }
  for (std::size_t object = 0; object < found.size(); ++object)
    if (is_new[object] && !isPart(stamp, found[object])) begin(stamp, found[object]);
}

void ObjectTracks::follow(Track& track, double stamp, const FoundObject& found) {
  track.follow(stamp, found);
  track.is_sure = track.is_sure || track.times >= kTimesUntilSure;
  if ((track.is_sure || isLarge(found)) && !track.number) track.number = ++count_;
}

/// Whether it is no new object, but may be a part of a known one that something divides.
bool ObjectTracks::isPart(double stamp, const FoundObject& found) const {
  if (!found.isCut()) return false;
  return std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    return track.number && distanceTo(track.expectedAt(stamp), found.box.center) < kPartReach;
  });
}

/// There is nothing to compare the first cloud with, such as that at a position in a recording at
/// which the player stands: all that it shows is believed.
void ObjectTracks::begin(double stamp, const FoundObject& found) {
  tracks_.push_back(
      {std::nullopt, {found.box, found.points, found.robot}, {}, 0, {}, stamp, stamp});
  tracks_.back().is_sure = !last_;
  follow(tracks_.back(), stamp, found);
}

/// What may be noise must be seen in every cloud.
void ObjectTracks::forget(double stamp, const IsHidden& is_hidden) {
  const auto isGone = [&](Track& track) {
    if (track.seen == stamp) return false;
    if (!track.is_sure) return true;
    if (is_hidden(track.expectedAt(stamp))) track.hidden = stamp;
    return stamp - track.hidden > kLongestOcclusion;
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), isGone), tracks_.end());
}

}  // namespace process_visualizer::objects
