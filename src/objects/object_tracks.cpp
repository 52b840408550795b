// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/object_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr int kTimesUntilSure = 3;
constexpr float kFarthest = 0.25F;      // m: an object is not farther from where it is expected
constexpr float kSizeWeight = 0.5F;     // of a difference in size, beside one in place
constexpr float kVelocityShare = 0.3F;  // of the newest value in the mean
constexpr float kSizeShare = 0.2F;
constexpr double kCoasting = 0.3;  // s: how long a hidden object is thought to move on
constexpr double kJump = 2.0;      // s

float mean(float old, float newest, float share) { return old + share * (newest - old); }

/// The same box with that of its four descriptions whose first edge is nearest to a direction.
UprightBox turnedTowards(UprightBox box, float yaw) {
  const auto quarters = static_cast<int>(std::lround((yaw - box.yaw) / M_PI_2));
  box.yaw += static_cast<float>(quarters * M_PI_2);
  if (quarters % 2 != 0) std::swap(box.size.x(), box.size.y());
  return box;
}

UprightBox smoothed(const UprightBox& old, const UprightBox& newest) {
  UprightBox box = turnedTowards(newest, old.yaw);
  box.yaw = mean(old.yaw, box.yaw, kSizeShare);
  box.size = old.size + kSizeShare * (box.size - old.size);
  return box;
}

/// Diagonals do not change when the edges of a box are taken in another order.
float sizeOf(const UprightBox& box) { return box.size.norm(); }

}  // namespace

Vector3f ObjectTracks::Track::expectedAt(double stamp) const {
  return object.box.center + velocity * static_cast<float>(std::min(stamp - seen, kCoasting));
}

void ObjectTracks::reset() { *this = {}; }

std::vector<TrackedObject> ObjectTracks::update(double stamp,
                                                const std::vector<FoundObject>& found) {
  if (last_ && (stamp < *last_ || stamp - *last_ > kJump)) reset();
  assign(stamp, found);
  last_ = stamp;
  forget(stamp);
  std::vector<TrackedObject> objects;
  for (const Track& track : tracks_)
    if (track.number) objects.push_back({*track.number, track.object, track.seen == stamp});
  std::sort(objects.begin(), objects.end(),
            [](const auto& one, const auto& other) { return one.number < other.number; });
  return objects;
}

/// The pairs that fit best come first; what is left over is new.
void ObjectTracks::assign(double stamp, const std::vector<FoundObject>& found) {
  std::vector<std::tuple<float, std::size_t, std::size_t>> pairs;
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    for (std::size_t object = 0; object < found.size(); ++object) {
      const float away = (tracks_[track].expectedAt(stamp) - found[object].box.center).norm();
      const float other = std::abs(sizeOf(tracks_[track].object.box) - sizeOf(found[object].box));
      if (away < kFarthest) pairs.emplace_back(away + kSizeWeight * other, track, object);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<bool> has_object(tracks_.size()), has_track(found.size());
  for (const auto& [cost, track, object] : pairs) {
    if (has_object[track] || has_track[object]) continue;
    has_object[track] = has_track[object] = true;
    follow(tracks_[track], stamp, found[object]);
  }
  for (std::size_t object = 0; object < found.size(); ++object)
    if (!has_track[object]) begin(stamp, found[object]);
}

/// There is nothing to compare the first cloud with, such as that at a position in a recording at
/// which the player stands: all that it shows is believed.
void ObjectTracks::begin(double stamp, const FoundObject& found) {
  tracks_.push_back({std::nullopt, found, {0, 0, 0}, stamp});
  if (!last_) tracks_.back().number = ++count_;
}

void ObjectTracks::follow(Track& track, double stamp, const FoundObject& found) {
  const auto passed = static_cast<float>(stamp - track.seen);
  if (passed > 0) {
    const Vector3f velocity = (found.box.center - track.object.box.center) / passed;
    track.velocity += kVelocityShare * (velocity - track.velocity);
  }
  const UprightBox box = smoothed(track.object.box, found.box);
  track.object = found;
  track.object.box = box;
  track.seen = stamp;
  if (++track.times >= kTimesUntilSure && !track.number) track.number = ++count_;
}

/// What has no number yet must be seen in every cloud.
void ObjectTracks::forget(double stamp) {
  const auto isGone = [stamp](const Track& track) {
    return track.seen != stamp && (!track.number || stamp - track.seen > kLongestOcclusion);
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), isGone), tracks_.end());
}

}  // namespace process_visualizer::objects
