// SPDX-License-Identifier: BSD-3-Clause
// Thresholds and costs for matching detections to tracks; smoothing, occlusion, time to contact.

#include "process_visualizer/objects/object_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "process_visualizer/objects/assignment.hpp"
#include "process_visualizer/objects/person.hpp"

namespace process_visualizer::objects {

// Completion of partly hidden boxes.

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kSideMargin = 0.02F;       // m: rim points this near to a side belong to it
constexpr float kMinOutwardCosine = 0.6F;  // between a rim point's outward direction and a side's
constexpr int kMinEnds = 3;                // rim points that show where a side is
constexpr float kMaxExcess = 0.02F;  // m: an object larger than its known size by more has grown

/// Visible range along one direction. For either end, it counts rim points where the object really
/// ends, minus those where it is truncated.
struct Extent {
  float min, max;
  int ends_at_min = 0, ends_at_max = 0;

  void add(float place, float outwards, bool is_truncated) {
    if (place < min + kSideMargin && outwards < -kMinOutwardCosine)
      ends_at_min += is_truncated ? -1 : 1;
    if (place > max - kSideMargin && outwards > kMinOutwardCosine)
      ends_at_max += is_truncated ? -1 : 1;
  }
};

/// Range of the complete object.
/// \param size  of the complete object, unless it is seen to be larger
Extent completedExtent(const Extent& seen, float size, float predicted_center) {
  const float length = seen.max - seen.min, half = size / 2;
  if (length > size + kMaxExcess) return seen;
  const bool has_min = seen.ends_at_min >= kMinEnds, has_max = seen.ends_at_max >= kMinEnds;
  float center = (seen.min + seen.max) / 2;
  if (has_min != has_max)
    center = has_min ? seen.min + half : seen.max - half;
  else if (!has_min && length < size)
    center = std::clamp(predicted_center, seen.max - half, seen.min + half);
  return {center - half, center + half};
}

/// Top of the object: the visible one if it is about where it is predicted, or higher. If it is
/// lower, something hides the upper part.
float topOf(const UprightBox& predicted, const UprightBox& seen) {
  const float known = predicted.center.z() + predicted.size.z() / 2;
  const float top = seen.center.z() + seen.size.z() / 2;
  return top > known - kSideMargin ? top : known;
}

}  // namespace

UprightBox completed(const UprightBox& predicted, const FoundObject& found) {
  const Eigen::Rotation2Df turned(-predicted.yaw);
  const Eigen::AlignedBox2f seen = footprint(found.places, predicted.yaw, found.blur.head<2>());
  Extent along{seen.min().x(), seen.max().x()}, across{seen.min().y(), seen.max().y()};
  for (const Rim& it : found.rim) {
    const Vector2f place = turned * Vector2f(it.place.head<2>());
    const Vector2f outwards = turned * Vector2f(it.outwards.head<2>());
    along.add(place.x(), outwards.x(), it.is_truncated);
    across.add(place.y(), outwards.y(), it.is_truncated);
  }
  const Vector2f center = turned * Vector2f(predicted.center.head<2>());
  along = completedExtent(along, predicted.size.x(), center.x());
  across = completedExtent(across, predicted.size.y(), center.y());
  const Vector2f middle((along.min + along.max) / 2, (across.min + across.max) / 2);
  UprightBox box = predicted;
  box.center.head<2>() = turned.inverse() * middle;
  box.center.z() = topOf(predicted, found.box) - predicted.size.z() / 2;
  box.size.head<2>() << along.max - along.min, across.max - across.min;
  return box;
}

// Tracks.

namespace {

constexpr int kConfirmingObservations = 3;
constexpr float kGate = 0.25F;           // m: maximum distance from the prediction
constexpr float kMaxSpeed = 3;           // m/s: of a new object
constexpr float kMaxAcceleration = 8;    // m/s²: of an object with known motion
constexpr float kMaxGateTime = 0.3F;     // s: the gate grows by these two for no longer
constexpr float kMaxSizeChange = 0.5F;   // share of its size, for a match beyond kGate
constexpr float kMinMovingSpeed = 0.3F;  // m/s
constexpr float kMaxEdgeGrowth = 1.5F;   // of an object that goes out of view
constexpr std::size_t kMaxPointGrowth = 3;
constexpr float kMinLargeEdge = 0.05F;  // m: two edges of a large object are longer
constexpr std::size_t kMinLargePoints = 80;
constexpr double kApproachWindow = 0.5;        // s: over which the approach speed is estimated
constexpr double kMinApproachDuration = 0.09;  // s
constexpr float kMinApproachSpeed = 0.05F;     // m/s
constexpr float kSizeWeight = 0.5F;       // of a difference in size, relative to one in position
constexpr float kMissingWeight = 0.1F;    // likewise, if a part of the object has left the view
constexpr float kNewestWeight = 0.2F;     // of the newest value, in exponential smoothing
constexpr float kPartMargin = 0.04F;      // m: maximum distance of a part from its object's box
constexpr float kSizeTolerance = 0.015F;  // m: an object that differs by less is complete
constexpr double kTimeJump = 2.0;         // s
constexpr std::size_t kMaxPlaces = 1000;  // of an object: a centimeter apart on a large one

float smoothed(float old, float newest) { return old + kNewestWeight * (newest - old); }

/// The same box in the one of its four equivalent descriptions whose yaw is nearest to `yaw` (rad).
UprightBox withYawNear(UprightBox box, float yaw) {
  const auto quarters = static_cast<int>(std::lround((yaw - box.yaw) / M_PI_2));
  box.yaw += static_cast<float>(quarters * M_PI_2);
  if (quarters % 2 != 0) std::swap(box.size.x(), box.size.y());
  return box;
}

/// Distance between two boxes, m. The sensor may see only the upper or only the lower side, and the
/// estimate of the other may jump, so the side that agrees better counts for the height.
float distanceBetween(const UprightBox& one, const UprightBox& other) {
  const Vector3f shift = other.center - one.center;
  const float grown = (other.size.z() - one.size.z()) / 2;
  return std::hypot(shift.head<2>().norm(),
                    std::min(std::abs(shift.z() + grown), std::abs(shift.z() - grown)));
}

/// Returns whether the boxes are near enough, seen from above, to be one object or a part of it.
bool isNear(const UprightBox& predicted, const UprightBox& found, float gate) {
  return distanceTo(predicted, {found.center.x(), found.center.y(), predicted.center.z()}) <= gate;
}

/// Returns whether a detection is too large to be noise.
bool isLarge(const FoundObject& found) {
  const Vector3f size = found.box.size;
  return found.points >= kMinLargePoints &&
         size.sum() - size.maxCoeff() - size.minCoeff() > kMinLargeEdge;
}

/// Center of the upper side. It is tracked because the lower side is not always visible, and its
/// estimate jumps then.
Vector3f topCenter(const UprightBox& box) { return box.center + Vector3f(0, 0, box.size.z() / 2); }

/// At most `kMaxPlaces` of the places, evenly chosen.
Cluster subsampled(const Cluster& places) {
  const std::size_t stride = (places.size() + kMaxPlaces - 1) / kMaxPlaces;
  if (stride <= 1) return places;
  Cluster kept;
  for (std::size_t index = 0; index < places.size(); index += stride) kept.push_back(places[index]);
  return kept;
}

UprightBox smoothed(const UprightBox& old, const UprightBox& newest) {
  UprightBox box = newest;
  box.yaw = smoothed(old.yaw, newest.yaw);
  box.size = old.size + kNewestWeight * (newest.size - old.size);
  box.center.z() += (newest.size.z() - box.size.z()) / 2;
  return box;
}

}  // namespace

UprightBox ObjectTracks::Track::predictedAt(double stamp) const {
  UprightBox box = object.box;
  box.center += motion.displacementAt(stamp);
  box.yaw += motion.rotationAt(stamp);
  return box;
}

/// Gate: maximum distance from the predicted position, m. It grows with time, but not for an object
/// that was hidden while it stood: a detection far from there is another object.
float ObjectTracks::Track::gateAt(double stamp) const {
  if (stands() && stamp - last_seen > kMaxGateTime) return kGate;
  const float passed = std::min(static_cast<float>(stamp - last_seen), kMaxGateTime);
  const bool is_motion_known = observations >= kConfirmingObservations;
  return kGate + (is_motion_known ? kMaxAcceleration / 2 * passed * passed : kMaxSpeed * passed);
}

/// Returns whether a detection shows only a part of this object.
bool ObjectTracks::Track::isPart(const UprightBox& predicted, const FoundObject& found) const {
  if (!is_complete || !found.isTruncated()) return false;
  const Vector3f seen = withYawNear(found.box, predicted.yaw).size - predicted.size;
  return seen.cwiseAbs().maxCoeff() > kSizeTolerance;
}

bool ObjectTracks::Track::stands() const {
  return motion.hasEstimate() && motion.velocity().norm() < kMinMovingSpeed;
}

/// Returns whether it may be a person, parts of whom may be seen separately.
bool ObjectTracks::Track::mayBePerson() const {
  return objects::mayBePerson(object.box.size, motion.velocity().norm() > kMinMovingSpeed);
}

/// Returns whether a detection is something else that came into view where this object went out of
/// view: the rest of an object does not become much larger. The outline of a person changes too
/// much to tell.
bool ObjectTracks::Track::isReplacedBy(const UprightBox& predicted,
                                       const FoundObject& found) const {
  if (!is_vanishing || mayBePerson()) return false;
  const Vector3f size = withYawNear(found.box, predicted.yaw).size;
  return found.points > kMaxPointGrowth * object.points &&
         (size - kMaxEdgeGrowth * predicted.size).maxCoeff() > kMaxExcess;
}

/// Returns whether a detection may be the part of a leaving person that is still in view: it is
/// smaller, and truncated by the image border or an occluder.
bool ObjectTracks::Track::mayBeLeaving(const UprightBox& predicted,
                                       const FoundObject& found) const {
  return number && motion.velocity().norm() > kMinMovingSpeed &&
         predicted.size.maxCoeff() > kMinMovingPersonSize && found.isTruncated() &&
         found.box.size.norm() < predicted.size.norm();
}

/// Returns whether only a part of a larger object may have been observed so far, such as the hand
/// of a person who enters.
bool ObjectTracks::Track::mayBePartOf(const UprightBox& predicted, const UprightBox& found) const {
  const bool is_still = observations >= kConfirmingObservations && stands();
  return !is_complete && !is_still && found.size.norm() > predicted.size.norm();
}

/// Box of this object, measured by a detection of it.
UprightBox ObjectTracks::Track::measuredBox(const UprightBox& predicted,
                                            const FoundObject& found) const {
  if (isPart(predicted, found)) return completed(predicted, found);
  return withYawNear(found.box, predicted.yaw);
}

void ObjectTracks::Track::observe(double stamp, const FoundObject& found) {
  const UprightBox predicted = predictedAt(stamp), box = measuredBox(predicted, found);
  const bool is_smoothed = is_complete && !isPart(predicted, found);
  const UprightBox before = object.box;
  motion.add(stamp, topCenter(box), box.yaw);
  is_current = true;
  object = {is_smoothed ? smoothed(predicted, box) : box, found.points, found.robot};
  updatePlaces(before, found);
  last_seen = last_hidden = stamp;
  is_vanishing =
      !is_complete && motion.velocity().norm() > kMinMovingSpeed && 2 * found.points < max_points;
  is_complete = is_complete || !found.isTruncated();
  ++observations;
}

/// Adds another visible part of the object, which may be nearer to a robot.
void ObjectTracks::Track::addPart(const FoundObject& part) {
  object.points += part.points;
  if (part.robot && object.robot && part.robot->distance < object.robot->distance)
    object.robot = part.robot;
}

/// Keeps earlier places of a partly hidden object, and moves them along with it.
void ObjectTracks::Track::updatePlaces(const UprightBox& before, const FoundObject& found) {
  if (!found.isTruncated() || found.points >= max_points || places.empty()) {
    places = subsampled(found.places);
    max_points = found.points;
    return;
  }
  const Vector3f shift = topCenter(object.box) - topCenter(before);
  for (Vector3f& place : places) place += shift;
}

/// Measures the distance again if a part is hidden: it may be nearer to a robot than the visible
/// one.
void ObjectTracks::Track::measureDistance(double stamp, const DistanceOf& distance_of) {
  const bool is_now = last_seen == stamp;
  if (places.empty() || (is_now && object.points >= max_points)) return;
  const auto kept = distance_of(places);
  const bool is_nearer = kept && object.robot && kept->distance < object.robot->distance;
  if (!is_now || is_nearer) object.robot = kept;
  is_current = is_now && !is_nearer;
}

void ObjectTracks::Track::recordDistance(double stamp) {
  if (!object.robot) return;
  recent_distances.emplace_back(stamp, object.robot->distance);
  while (stamp - recent_distances.front().first > kApproachWindow) recent_distances.pop_front();
}

/// Time to contact if the distance keeps shrinking at its recent rate (least squares), s.
std::optional<float> ObjectTracks::Track::timeToContact() const {
  if (recent_distances.size() < 2 ||
      recent_distances.back().first - recent_distances.front().first < kMinApproachDuration)
    return std::nullopt;
  double time = 0, distance = 0, square = 0, product = 0;
  for (const auto& [stamp, value] : recent_distances) {
    time += stamp / static_cast<double>(recent_distances.size());
    distance += value / static_cast<double>(recent_distances.size());
  }
  for (const auto& [stamp, value] : recent_distances) {
    square += (stamp - time) * (stamp - time);
    product += (stamp - time) * (value - distance);
  }
  const auto speed = static_cast<float>(-product / square);
  if (speed < kMinApproachSpeed) return std::nullopt;
  return std::max(0.0F, recent_distances.back().second) / speed;
}

TrackedObject ObjectTracks::Track::toTrackedObject(double stamp) const {
  return {*number,           object,         last_seen == stamp, is_confirmed, is_current,
          motion.velocity(), timeToContact()};
}

void ObjectTracks::reset() { *this = {}; }

bool ObjectTracks::isJump(double stamp) const {
  return last_stamp_ && (stamp < *last_stamp_ || stamp - *last_stamp_ > kTimeJump);
}

std::vector<PredictedObject> ObjectTracks::predictedAt(double stamp) const {
  std::vector<PredictedObject> predicted;
  if (isJump(stamp)) return predicted;
  for (const Track& track : tracks_) {
    const Vector3f velocity = track.motion.velocity();
    if (track.number)
      predicted.push_back({track.predictedAt(stamp), track.is_complete,
                           velocity.norm() > kMinMovingSpeed, track.stands(), velocity});
  }
  return predicted;
}

std::vector<TrackedObject> ObjectTracks::update(double stamp, const std::vector<FoundObject>& found,
                                                const IsHidden& is_hidden,
                                                const DistanceOf& distance_of) {
  if (isJump(stamp)) reset();
  assign(stamp, found);
  last_stamp_ = stamp;
  removeLost(stamp, is_hidden);
  if (distance_of)
    for (Track& track : tracks_)
      if (track.number) track.measureDistance(stamp, distance_of);
  shareDistances(stamp);
  std::vector<TrackedObject> objects;
  for (Track& track : tracks_) {
    track.recordDistance(stamp);
    if (track.number) objects.push_back(track.toTrackedObject(stamp));
  }
  std::sort(objects.begin(), objects.end(),
            [](const auto& one, const auto& other) { return one.number < other.number; });
  return objects;
}

/// Gives the distances of tracks without a number to the objects beside them. Such a track is not
/// shown yet, but may be a hand or the head of a person who is.
void ObjectTracks::shareDistances(double stamp) {
  for (const Track& unnumbered : tracks_) {
    if (unnumbered.number || unnumbered.last_seen != stamp || !unnumbered.object.robot) continue;
    Track* nearest = nullptr;
    float nearest_distance = kMaxReach;
    for (Track& track : tracks_) {
      if (!track.number || track.last_seen != stamp) continue;
      const float away = distanceTo(track.object.box, unnumbered.object.box.center);
      if (away >= std::min(nearest_distance, track.mayBePerson() ? kMaxReach : kMaxLimbGap))
        continue;
      nearest_distance = away;
      nearest = &track;
    }
    if (nearest && nearest->object.robot &&
        unnumbered.object.robot->distance < nearest->object.robot->distance)
      nearest->object.robot = unnumbered.object.robot;
  }
}

/// Costs of matching each track (row) with each detection: their distance and difference in size.
Eigen::MatrixXf ObjectTracks::costs(double stamp, const std::vector<FoundObject>& found) const {
  Eigen::MatrixXf costs(tracks_.size(), found.size());
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    const UprightBox predicted = tracks_[track].predictedAt(stamp);
    const float gate = tracks_[track].gateAt(stamp);
    for (std::size_t object = 0; object < found.size(); ++object) {
      costs(track, object) = kForbidden;
      if (!isNear(predicted, found[object].box, gate) ||
          tracks_[track].isReplacedBy(predicted, found[object]))
        continue;
      const UprightBox box = tracks_[track].measuredBox(predicted, found[object]);
      const float grown = (box.size - predicted.size).norm();
      float away = distanceBetween(predicted, box);
      bool is_alike = away < kGate || grown < kMaxSizeChange * predicted.size.norm();
      if (tracks_[track].mayBePartOf(predicted, box)) {
        away = std::min(away, distanceTo(box, predicted.center));
        is_alike = true;
      }
      if (tracks_[track].mayBeLeaving(predicted, found[object])) {
        const float beside = distanceTo(predicted, found[object].box.center);
        const float missing = (predicted.size - found[object].box.size).norm();
        if (beside < gate) costs(track, object) = beside + kMissingWeight * missing;
      }
      if (away < gate && is_alike)
        costs(track, object) = std::min(costs(track, object), away + kSizeWeight * grown);
    }
  }
  return costs;
}

/// Unassigned detections start new tracks, unless they may be parts of a known object that an
/// occluder divides. Such a part may be all that is visible of the object.
void ObjectTracks::assign(double stamp, const std::vector<FoundObject>& found) {
  std::vector<bool> is_new(found.size(), true);
  const auto pairs = bestPairs(costs(stamp, found));
  for (std::size_t track = 0; track < pairs.size(); ++track) {
    if (!pairs[track]) continue;
    observe(tracks_[track], stamp, found[*pairs[track]]);
    is_new[*pairs[track]] = false;
  }
  std::vector<std::size_t> order(found.size());  // largest first: it locates the object best
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t one, std::size_t other) {
    return found[one].points > found[other].points;
  });
  for (const std::size_t object : order) {
    if (!is_new[object]) continue;
    Track* const owner = ownerOf(stamp, found[object]);
    if (!owner)
      startTrack(stamp, found[object]);
    else if (owner->last_seen != stamp)
      observe(*owner, stamp, found[object]);
    else
      owner->addPart(found[object]);
  }
}

void ObjectTracks::observe(Track& track, double stamp, const FoundObject& found) {
  track.observe(stamp, found);
  track.is_confirmed = track.is_confirmed || track.observations >= kConfirmingObservations;
  if ((track.is_confirmed || isLarge(found)) && !track.number) track.number = ++count_;
}

/// The known object of which a detection may be a part; null if there is none.
ObjectTracks::Track* ObjectTracks::ownerOf(double stamp, const FoundObject& found) {
  if (!found.isTruncated()) return nullptr;
  const auto owner = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    const UprightBox box = track.last_seen == stamp ? track.object.box : track.predictedAt(stamp);
    return track.number && distanceTo(box, found.box.center) < kPartMargin;
  });
  return owner == tracks_.end() ? nullptr : &*owner;
}

/// Starts a track. Everything in the first cloud (or the only one, while a player is paused) is
/// confirmed at once, as there is nothing to compare it with.
void ObjectTracks::startTrack(double stamp, const FoundObject& found) {
  tracks_.push_back(
      {std::nullopt, {found.box, found.points, found.robot}, {}, 0, {}, stamp, stamp});
  tracks_.back().is_confirmed = !last_stamp_;
  observe(tracks_.back(), stamp, found);
}

/// Returns whether a track was a part of an object that is seen as one now, such as the upper half
/// of a pole that something divided: two objects are not in one place. A track that was observed
/// for longer is kept, as its object may stand there, hidden.
bool ObjectTracks::isAbsorbed(const Track& track, double stamp) const {
  if (track.last_seen == stamp || track.observations >= kConfirmingObservations) return false;
  const Vector3f place = track.predictedAt(stamp).center;
  return std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
    return other.last_seen == stamp && distanceTo(other.object.box, place) < kPartMargin;
  });
}

/// Removes tracks that were absorbed or lost. An unconfirmed one is lost at the first cloud without
/// it.
void ObjectTracks::removeLost(double stamp, const IsHidden& is_hidden) {
  std::vector<Track> kept;
  std::copy_if(tracks_.begin(), tracks_.end(), std::back_inserter(kept),
               [&](const Track& track) { return !isAbsorbed(track, stamp); });
  tracks_ = std::move(kept);
  const auto isLost = [&](Track& track) {
    if (track.last_seen == stamp) return false;
    if (!track.is_confirmed) return true;
    if (is_hidden(track.predictedAt(stamp))) track.last_hidden = stamp;
    return stamp - track.last_hidden > kMaxUnseen;
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), isLost), tracks_.end());
}

}  // namespace process_visualizer::objects
