// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/object_tracks.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "process_visualizer/objects/somebody.hpp"

namespace process_visualizer::objects {
// How an object moves on.

namespace {

using Eigen::Index;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::size_t kMostSights = 60;
constexpr std::size_t kFewestSights = 2, kFewestForTurn = 4, kFewestForBend = 6;
constexpr double kShortest = 0.09, kShortestForBend = 0.3;  // s
constexpr float kSlowest = 0.03F;                           // m/s
constexpr float kSlowestTurn = 0.15F;                       // rad/s
constexpr float kUneven = 0.1F;                             // rad: RMS beside an even turn
constexpr float kSharpestBend = 3;                          // rad/s

}  // namespace

void Motion::add(double stamp, const Vector3f& place, float yaw) {
  sights_.push_back({stamp, {place.x(), place.y(), place.z(), yaw}});
  while (sights_.size() > kMostSights || stamp - sights_.front().stamp > kWindow)
    sights_.pop_front();
  fit();
}

/// Fits polynomials to what was seen (least squares): of first order in time, and of second order
/// if there is enough of it.
void Motion::fit() {
  velocity_.setZero();
  bend_ = turn_ = 0;
  const double last = sights_.back().stamp, span = last - sights_.front().stamp;
  if (!isKnown()) return;
  const auto count = static_cast<Eigen::Index>(sights_.size());
  Eigen::MatrixX3f powers(count, 3);
  Eigen::MatrixX4f states(count, 4);
  for (Eigen::Index row = 0; row < count; ++row) {
    const auto time = static_cast<float>(sights_[row].stamp - last);
    powers.row(row) << 1, time, time * time;
    states.row(row) = sights_[row].state.transpose();
  }
  const Eigen::MatrixX2f linear = powers.leftCols<2>();
  const Eigen::MatrixXf even = linear.colPivHouseholderQr().solve(states);
  velocity_ = even.row(1).head<3>().transpose();
  const float rms =
      ((linear * even.col(3)) - states.col(3)).norm() / std::sqrt(static_cast<float>(count));
  if (sights_.size() >= kFewestForTurn && std::abs(even(1, 3)) > kSlowestTurn && rms < kUneven)
    turn_ = even(1, 3);
  if (sights_.size() < kFewestForBend || span < kShortestForBend || velocity_.norm() < kSlowest)
    return;
  const Eigen::MatrixXf bent = powers.colPivHouseholderQr().solve(states);
  velocity_.head<2>() = bent.row(1).head<2>().transpose();
  const Eigen::Vector2f speed = velocity_.head<2>(), change = 2 * bent.row(2).head<2>().transpose();
  const float square = std::max(speed.squaredNorm(), kSlowest * kSlowest);
  bend_ = (speed.x() * change.y() - speed.y() * change.x()) / square;
  bend_ = std::clamp(bend_, -kSharpestBend, kSharpestBend);
}

bool Motion::isKnown() const {
  return sights_.size() >= kFewestSights &&
         sights_.back().stamp - sights_.front().stamp >= kShortest;
}

Vector3f Motion::shiftAt(double stamp) const {
  if (sights_.empty() || velocity_.norm() < kSlowest) return Vector3f::Zero();
  const auto passed = static_cast<float>(std::min(stamp - sights_.back().stamp, kLongestCoast));
  Vector3f shift = velocity_ * passed;
  if (std::abs(bend_) < 1e-3F) return shift;
  const float along = std::sin(bend_ * passed) / bend_,
              aside = (1 - std::cos(bend_ * passed)) / bend_;
  shift.x() = along * velocity_.x() - aside * velocity_.y();
  shift.y() = along * velocity_.y() + aside * velocity_.x();
  return shift;
}

Vector3f Motion::velocity() const {
  return velocity_.norm() < kSlowest ? Vector3f(Vector3f::Zero()) : velocity_;
}

float Motion::turnAt(double stamp) const {
  if (sights_.empty()) return 0;
  return turn_ * static_cast<float>(std::min(stamp - sights_.back().stamp, kLongestCoast));
}

// The box of an object of which something hides a part.

namespace {

constexpr float kAtSide = 0.02F;   // m: the points so near to a side tell whether it is hidden
constexpr float kOutwards = 0.6F;  // cosine: of directions that lead out of a side
constexpr int kFewestEnds = 3;     // that show a side
constexpr float kGrown = 0.02F;    // m: an object that reaches farther is larger than it was

/// Along one direction: what is seen, and how much more of its rim at either end is a real end than
/// is cut.
struct Extent {
  float least, most;
  int ends_at_least = 0, ends_at_most = 0;

  void add(float place, float outwards, bool is_cut) {
    if (place < least + kAtSide && outwards < -kOutwards) ends_at_least += is_cut ? -1 : 1;
    if (place > most - kAtSide && outwards > kOutwards) ends_at_most += is_cut ? -1 : 1;
  }
};

/// Where the whole begins and ends.
/// \param size  of the whole; a larger one that is seen is believed
Extent whole(const Extent& seen, float size, float predicted_center) {
  const float length = seen.most - seen.least, half = size / 2;
  if (length > size + kGrown) return seen;
  const bool has_least = seen.ends_at_least >= kFewestEnds,
             has_most = seen.ends_at_most >= kFewestEnds;
  float center = (seen.least + seen.most) / 2;
  if (has_least != has_most)
    center = has_least ? seen.least + half : seen.most - half;
  else if (!has_least && length < size)
    center = std::clamp(predicted_center, seen.most - half, seen.least + half);
  return {center - half, center + half};
}

/// The top is believed if it is about where it is predicted, or higher: if it is lower, something
/// hides what is above.
float topOf(const UprightBox& predicted, const UprightBox& seen) {
  const float known = predicted.center.z() + predicted.size.z() / 2;
  const float top = seen.center.z() + seen.size.z() / 2;
  return top > known - kAtSide ? top : known;
}

}  // namespace

UprightBox completed(const UprightBox& predicted, const FoundObject& found) {
  const Eigen::Rotation2Df turned(-predicted.yaw);
  const Eigen::AlignedBox2f seen = footprint(found.places, predicted.yaw, found.blur.head<2>());
  Extent along{seen.min().x(), seen.max().x()}, across{seen.min().y(), seen.max().y()};
  for (const Rim& it : found.rim) {
    const Vector2f place = turned * Vector2f(it.place.head<2>());
    const Vector2f outwards = turned * Vector2f(it.outwards.head<2>());
    along.add(place.x(), outwards.x(), it.is_cut);
    across.add(place.y(), outwards.y(), it.is_cut);
  }
  const Vector2f center = turned * Vector2f(predicted.center.head<2>());
  along = whole(along, predicted.size.x(), center.x());
  across = whole(across, predicted.size.y(), center.y());
  const Vector2f middle((along.least + along.most) / 2, (across.least + across.most) / 2);
  UprightBox box = predicted;
  box.center.head<2>() = turned.inverse() * middle;
  box.center.z() = topOf(predicted, found.box) - predicted.size.z() / 2;
  box.size.head<2>() << along.most - along.least, across.most - across.least;
  return box;
}

// Which of the things that are found is which object.

namespace {

/// The Hungarian method with potentials: rows are added one after the other, each along the
/// shortest path of alternating pairs. Row and column 0 stand for none.
class Hungarian {
 public:
  /// \param costs  not more rows than columns
  explicit Hungarian(const Eigen::MatrixXf& costs)
      : costs_(costs),
        row_potentials_(costs.rows() + 1, 0),
        column_potentials_(costs.cols() + 1, 0),
        row_of_(costs.cols() + 1, 0) {
    for (Index row = 1; row <= costs.rows(); ++row) add(row);
  }

  /// The row of a column (both from 0); -1 for none.
  Index rowOf(Index column) const { return row_of_[column + 1] - 1; }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  void add(Index row) {
    distances_.assign(costs_.cols() + 1, kInfinity);
    before_.assign(costs_.cols() + 1, 0);
    is_visited_.assign(costs_.cols() + 1, false);
    row_of_[0] = row;
    Index column = 0;
    while (row_of_[column] != 0) column = nextAfter(column);
    for (; column != 0; column = before_[column]) row_of_[column] = row_of_[before_[column]];
  }

  /// Visits a column, and returns the one that is nearest then.
  Index nextAfter(Index column) {
    is_visited_[column] = true;
    const Index row = row_of_[column];
    Index nearest = 0;
    double step = kInfinity;
    for (Index other = 1; other <= costs_.cols(); ++other) {
      if (is_visited_[other]) continue;
      const double way =
          costs_(row - 1, other - 1) - row_potentials_[row] - column_potentials_[other];
      if (way < distances_[other]) {
        distances_[other] = way;
        before_[other] = column;
      }
      if (distances_[other] < step) {
        step = distances_[other];
        nearest = other;
      }
    }
    lower(step);
    return nearest;
  }

  void lower(double step) {
    for (Index column = 0; column <= costs_.cols(); ++column) {
      if (is_visited_[column]) {
        row_potentials_[row_of_[column]] += step;
        column_potentials_[column] -= step;
      } else {
        distances_[column] -= step;
      }
    }
  }

  const Eigen::MatrixXf& costs_;
  std::vector<double> row_potentials_, column_potentials_, distances_;
  std::vector<Index> row_of_, before_;
  std::vector<bool> is_visited_;
};

}  // namespace

std::vector<std::optional<std::size_t>> bestPairs(const Eigen::MatrixXf& costs) {
  std::vector<std::optional<std::size_t>> columns(costs.rows());
  const bool is_wide = costs.rows() <= costs.cols();
  const Eigen::MatrixXf wide = is_wide ? costs : costs.transpose();
  const Hungarian hungarian(wide);
  for (Index column = 0; column < wide.cols(); ++column) {
    const Index row = hungarian.rowOf(column);
    if (row < 0 || wide(row, column) >= kForbidden) continue;
    columns[is_wide ? row : column] = static_cast<std::size_t>(is_wide ? column : row);
  }
  return columns;
}

// Tracks.

namespace {

constexpr int kTimesUntilSure = 3;
constexpr float kFarthest = 0.25F;          // m: maximum distance of an object from its prediction
constexpr float kFastest = 3;               // m/s: maximum speed of a new object
constexpr float kSharpest = 8;              // m/s²: maximum change of a known object's speed
constexpr float kLongestStep = 0.3F;        // s: maximum time for which these two count
constexpr float kAlike = 0.5F;              // of its size: maximum distance of the same object
constexpr float kMoving = 0.3F;             // m/s
constexpr float kLarge = 0.05F;             // m: two edges of what is no noise
constexpr std::size_t kClear = 80;          // points of it
constexpr double kApproach = 0.5;           // s: in which it is seen whether a distance shrinks
constexpr double kShortestApproach = 0.09;  // s
constexpr float kSlowestApproach = 0.05F;   // m/s
constexpr float kSizeWeight = 0.5F;         // of a difference in size, beside one in place
constexpr float kMissingWeight = 0.1F;      // of a size of which a part has left the view
constexpr float kNewestShare = 0.2F;        // of the newest value in the mean
constexpr float kPartReach = 0.04F;  // m: so far beside an object a part of it may seem to be
constexpr float kWhole = 0.015F;     // m: what differs less from the whole is not a part of it
constexpr double kJump = 2.0;        // s
constexpr std::size_t kKept = 1000;  // places of an object: a centimeter apart on a large one

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
bool isNear(const UprightBox& predicted, const UprightBox& found, float farthest) {
  return distanceTo(predicted, {found.center.x(), found.center.y(), predicted.center.z()}) <=
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

UprightBox ObjectTracks::Track::predictedAt(double stamp) const {
  UprightBox box = object.box;
  box.center += motion.shiftAt(stamp);
  box.yaw += motion.turnAt(stamp);
  return box;
}

/// Maximum distance from the predicted place, m.
float ObjectTracks::Track::farthestAt(double stamp) const {
  const float passed = std::min(static_cast<float>(stamp - seen), kLongestStep);
  const bool is_known = times >= kTimesUntilSure;  // how it moves
  return kFarthest + (is_known ? kSharpest / 2 * passed * passed : kFastest * passed);
}

/// Whether less than the whole of this object can be measured.
bool ObjectTracks::Track::isPartOf(const UprightBox& predicted, const FoundObject& found) const {
  if (!is_whole || !found.isCut()) return false;
  const Vector3f seen = turnedTowards(found.box, predicted.yaw).size - predicted.size;
  return seen.cwiseAbs().maxCoeff() > kWhole;
}

bool ObjectTracks::Track::stands() const {
  return motion.isKnown() && motion.velocity().norm() < kMoving;
}

/// Whether it may be somebody, of whom parts are seen apart from the rest.
bool ObjectTracks::Track::mayBeSomebody() const {
  return objects::mayBeSomebody(object.box.size, motion.velocity().norm() > kMoving);
}

/// Whether a found object may be what is left in view of somebody who goes away: it is smaller, and
/// goes on beyond the picture or behind something.
bool ObjectTracks::Track::mayBeRestOf(const UprightBox& predicted, const FoundObject& found) const {
  return number && motion.velocity().norm() > kMoving && predicted.size.maxCoeff() > kLimbed &&
         found.isCut() && found.box.size.norm() < predicted.size.norm();
}

/// Whether what was seen of it so far may be a part of something larger, such as the hand of
/// somebody who comes in.
bool ObjectTracks::Track::mayBePartOf(const UprightBox& predicted, const UprightBox& found) const {
  const bool is_still = times >= kTimesUntilSure && stands();
  return !is_whole && !is_still && found.size.norm() > predicted.size.norm();
}

/// The box that a found object would have as this one.
UprightBox ObjectTracks::Track::measured(const UprightBox& predicted,
                                         const FoundObject& found) const {
  if (isPartOf(predicted, found)) return completed(predicted, found);
  return turnedTowards(found.box, predicted.yaw);
}

void ObjectTracks::Track::follow(double stamp, const FoundObject& found) {
  const UprightBox predicted = predictedAt(stamp), box = measured(predicted, found);
  const bool is_smoothed = is_whole && !isPartOf(predicted, found);
  const UprightBox before = object.box;
  motion.add(stamp, upperSide(box), box.yaw);
  is_current = true;
  object = {is_smoothed ? smoothed(predicted, box) : box, found.points, found.robot};
  keepPlaces(before, found);
  seen = hidden = stamp;
  is_whole = is_whole || !found.isCut();
  ++times;
}

/// Takes another part of it that was seen: it may be nearer to a robot.
void ObjectTracks::Track::add(const FoundObject& part) {
  object.points += part.points;
  if (part.robot && object.robot && part.robot->distance < object.robot->distance)
    object.robot = part.robot;
}

/// Keeps earlier places of a partly hidden object, moved along with it.
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

/// Time to contact if the distance keeps shrinking at its recent rate (least squares).
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

std::vector<PredictedObject> ObjectTracks::predictedAt(double stamp) const {
  std::vector<PredictedObject> predicted;
  if (isJump(stamp)) return predicted;
  for (const Track& track : tracks_) {
    const Vector3f velocity = track.motion.velocity();
    if (track.number)
      predicted.push_back({track.predictedAt(stamp), track.is_whole, velocity.norm() > kMoving,
                           track.stands(), velocity});
  }
  return predicted;
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
  lendDistances(stamp);
  std::vector<TrackedObject> objects;
  for (Track& track : tracks_) {
    track.noteDistance(stamp);
    if (track.number) objects.push_back(track.shown(stamp));
  }
  std::sort(objects.begin(), objects.end(),
            [](const auto& one, const auto& other) { return one.number < other.number; });
  return objects;
}

/// What has no number yet is not shown, but may be the hand or the head of somebody who is: its
/// distance counts for the object beside which it is.
void ObjectTracks::lendDistances(double stamp) {
  for (const Track& small : tracks_) {
    if (small.number || small.seen != stamp || !small.object.robot) continue;
    Track* nearest = nullptr;
    float least = kArm;
    for (Track& track : tracks_) {
      if (!track.number || track.seen != stamp) continue;
      const float away = distanceTo(track.object.box, small.object.box.center);
      if (away >= std::min(least, track.mayBeSomebody() ? kArm : kLimbGap)) continue;
      least = away;
      nearest = &track;
    }
    if (nearest && nearest->object.robot &&
        small.object.robot->distance < nearest->object.robot->distance)
      nearest->object.robot = small.object.robot;
  }
}

/// Of each track (row) with each found object: how far away it is, and how much larger or smaller.
Eigen::MatrixXf ObjectTracks::costs(double stamp, const std::vector<FoundObject>& found) const {
  Eigen::MatrixXf costs(tracks_.size(), found.size());
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    const UprightBox predicted = tracks_[track].predictedAt(stamp);
    const float farthest = tracks_[track].farthestAt(stamp);
    for (std::size_t object = 0; object < found.size(); ++object) {
      costs(track, object) = kForbidden;
      if (!isNear(predicted, found[object].box, farthest)) continue;
      const UprightBox box = tracks_[track].measured(predicted, found[object]);
      const float grown = (box.size - predicted.size).norm();
      float away = apart(predicted, box);
      bool is_alike = away < kFarthest || grown < kAlike * predicted.size.norm();
      if (tracks_[track].mayBePartOf(predicted, box)) {
        away = std::min(away, distanceTo(box, predicted.center));
        is_alike = true;
      }
      if (tracks_[track].mayBeRestOf(predicted, found[object])) {
        const float beside = distanceTo(predicted, found[object].box.center);
        const float missing = (predicted.size - found[object].box.size).norm();
        if (beside < farthest) costs(track, object) = beside + kMissingWeight * missing;
      }
      if (away < farthest && is_alike)
        costs(track, object) = std::min(costs(track, object), away + kSizeWeight * grown);
    }
  }
  return costs;
}

/// Unassigned finds start new tracks, unless they may be part of a known object that something
/// divides. All that is seen of an object may be such a part.
void ObjectTracks::assign(double stamp, const std::vector<FoundObject>& found) {
  std::vector<bool> is_new(found.size(), true);
  const auto pairs = bestPairs(costs(stamp, found));
  for (std::size_t track = 0; track < pairs.size(); ++track) {
    if (!pairs[track]) continue;
    follow(tracks_[track], stamp, found[*pairs[track]]);
    is_new[*pairs[track]] = false;
  }
  std::vector<std::size_t> order(found.size());  // the largest first: it tells where the whole is
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t one, std::size_t other) {
    return found[one].points > found[other].points;
  });
  for (const std::size_t object : order) {
    if (!is_new[object]) continue;
    Track* const whole = wholeOf(stamp, found[object]);
    if (!whole)
      begin(stamp, found[object]);
    else if (whole->seen != stamp)
      follow(*whole, stamp, found[object]);
    else
      whole->add(found[object]);
  }
}

void ObjectTracks::follow(Track& track, double stamp, const FoundObject& found) {
  track.follow(stamp, found);
  track.is_sure = track.is_sure || track.times >= kTimesUntilSure;
  if ((track.is_sure || isLarge(found)) && !track.number) track.number = ++count_;
}

/// The known object of which a found one may be a part.
ObjectTracks::Track* ObjectTracks::wholeOf(double stamp, const FoundObject& found) {
  if (!found.isCut()) return nullptr;
  const auto whole = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    const UprightBox box = track.seen == stamp ? track.object.box : track.predictedAt(stamp);
    return track.number && distanceTo(box, found.box.center) < kPartReach;
  });
  return whole == tracks_.end() ? nullptr : &*whole;
}

/// Everything in the first cloud (or the only one, at the position of a paused player) is accepted,
/// as there is nothing to compare it with.
void ObjectTracks::begin(double stamp, const FoundObject& found) {
  tracks_.push_back(
      {std::nullopt, {found.box, found.points, found.robot}, {}, 0, {}, stamp, stamp});
  tracks_.back().is_sure = !last_;
  follow(tracks_.back(), stamp, found);
}

/// Whether it was seen only as a part of something that is seen as one now, such as the upper half
/// of a pole that something divided: two things are not in one place. What was seen for longer may
/// stand there, hidden.
bool ObjectTracks::isTakenUp(const Track& track, double stamp) const {
  if (track.seen == stamp || track.times >= kTimesUntilSure) return false;
  const Vector3f place = track.predictedAt(stamp).center;
  return std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
    return other.seen == stamp && distanceTo(other.object.box, place) < kPartReach;
  });
}

/// What may be noise must be seen in every cloud.
void ObjectTracks::forget(double stamp, const IsHidden& is_hidden) {
  std::vector<Track> kept;
  std::copy_if(tracks_.begin(), tracks_.end(), std::back_inserter(kept),
               [&](const Track& track) { return !isTakenUp(track, stamp); });
  tracks_ = std::move(kept);
  const auto isGone = [&](Track& track) {
    if (track.seen == stamp) return false;
    if (!track.is_sure) return true;
    if (is_hidden(track.predictedAt(stamp))) track.hidden = stamp;
    return stamp - track.hidden > kKeptUnseen;
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), isGone), tracks_.end());
}

}  // namespace process_visualizer::objects
