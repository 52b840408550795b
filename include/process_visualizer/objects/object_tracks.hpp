// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// How an object moves on: on a circle in the plane, evenly upwards or downwards, and turning
/// evenly, as it did in the last `kWindow` seconds in which it was seen.
class Motion {
 public:
  /// \param stamp  later than those before, s
  /// \param place  m
  /// \param yaw  rad, without jumps
  void add(double stamp, const Eigen::Vector3f& place, float yaw);

  /// By how much it has moved since it was seen last, m. What is slower than 3 cm/s stands: that is
  /// less than what noise may look like.
  Eigen::Vector3f shiftAt(double stamp) const;

  /// Whether it has been seen for long enough to tell how it moves.
  bool isKnown() const;

  /// How fast it moved when it was seen last, m/s; nothing where it stands, or is seen too shortly.
  Eigen::Vector3f velocity() const;

  /// By how much it has turned since then, rad; nothing if it turned slowly or unevenly.
  float turnAt(double stamp) const;

  static constexpr double kWindow = 0.6;        ///< s
  static constexpr double kLongestCoast = 1.0;  ///< s: then it is thought to stand

 private:
  struct Sight {
    double stamp;
    Eigen::Vector4f state;  ///< place, yaw
  };

  void fit();

  std::deque<Sight> sights_;
  Eigen::Vector3f velocity_ = Eigen::Vector3f::Zero();  ///< m/s, at the last sight
  float bend_ = 0;                                      ///< of the direction, rad/s
  float turn_ = 0;                                      ///< of the yaw, rad/s
};

/// A cost of pairs that must not be.
constexpr float kForbidden = 1e3F;

/// Pairs rows with columns so that as many as possible have a partner and the sum of the costs is
/// then the least (Kuhn 1955, Munkres 1957), in O(n² m) for n rows and m columns or the reverse.
/// \param costs  from 0 to 1, or kForbidden
/// \return the column of each row, if it has one
std::vector<std::optional<std::size_t>> bestPairs(const Eigen::MatrixXf& costs);

/// The box of an object of which something may hide a part. Where a side is hidden, it is as far
/// from the opposite one as it is known to be; between two that are hidden, the box stays where it
/// is expected as far as what is seen of it permits.
/// \param expected  the whole object where it is thought to be
UprightBox completed(const UprightBox& predicted, const FoundObject& found);

/// An object that is followed from cloud to cloud.
struct TrackedObject {
  std::uint32_t number;  ///< stays the same, from 1
  FoundObject object;    ///< as it was seen last, its box smoothed; its distance is the present one
  bool is_seen;          ///< in the last cloud; if not, something may hide it
  bool is_confirmed = true;  ///< seen often enough that it is no noise
  bool is_current = true;    ///< whether the distance is to what the last cloud shows
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< m/s
  std::optional<float> contact_s = std::nullopt;       ///< till contact, if it gets nearer, s
};

/// Gives objects steady numbers, also while something hides them or a part of them.
///
/// What is new and seen in three clouds in a row is an object; until then it may be noise, and is
/// shown only if it is large, as unconfirmed: what moves fast is gone after three clouds. One that
/// is not seen is remembered for `kKeptUnseen`, and as long as its place is hidden. A part of an
/// object beside something that hides the rest is no new one. Nothing is remembered across a
/// jump of time: a cloud that is older than the last one, or much younger.
class ObjectTracks {
 public:
  /// Tells whether a place is hidden from the sensor.
  using IsHidden = std::function<bool(const UprightBox&)>;

  /// Measures how far the robots are from places, as they stand when the cloud was taken.
  using DistanceOf = std::function<std::optional<RobotDistance>(const Cluster&)>;

  /// The objects that have a number, where they are thought to be.
  /// \param stamp  of the next cloud, s
  std::vector<PredictedObject> predictedAt(double stamp) const;

  /// \param stamp  of the cloud, s
  /// \param distance_of  for objects of which less is seen than before; a robot goes on moving
  ///                     while it hides one
  /// \return all objects that have a number, in its order
  std::vector<TrackedObject> update(
      double stamp, const std::vector<FoundObject>& found,
      const IsHidden& is_hidden = [](const UprightBox&) { return false; },
      const DistanceOf& distance_of = nullptr);

  /// Forgets everything; numbers begin with 1 again.
  void reset();

  static constexpr double kKeptUnseen = 0.6;  ///< s, while its place is seen

 private:
  struct Track {
    std::optional<std::uint32_t> number;
    FoundObject object;
    Cluster places;    ///< of its surface, as much as was seen at once, where it was seen last
    std::size_t most;  ///< points were seen at once, of which these places are some
    Motion motion;
    double seen;             ///< s
    double hidden;           ///< when its place was hidden, or it was seen, last, s
    bool is_whole = false;   ///< whether nothing has hidden a part of it, once at least
    bool is_sure = false;    ///< whether it is no noise
    bool is_current = true;  ///< whether the distance is to what was seen last
    int times = 0;           ///< how often it was seen
    std::deque<std::pair<double, float>> distances = {};  ///< of late: s, m

    UprightBox predictedAt(double stamp) const;
    float farthestAt(double stamp) const;
    bool isPartOf(const UprightBox& predicted, const FoundObject& found) const;
    bool stands() const;
    bool mayBeSomebody() const;
    bool mayBeRestOf(const UprightBox& predicted, const FoundObject& found) const;
    bool mayBePartOf(const UprightBox& predicted, const UprightBox& found) const;
    UprightBox measured(const UprightBox& predicted, const FoundObject& found) const;
    void follow(double stamp, const FoundObject& found);
    void add(const FoundObject& part);
    void keepPlaces(const UprightBox& before, const FoundObject& found);
    void measureDistance(double stamp, const DistanceOf& distance_of);
    void noteDistance(double stamp);
    std::optional<float> contact() const;
    TrackedObject shown(double stamp) const;
  };

  bool isJump(double stamp) const;
  Eigen::MatrixXf costs(double stamp, const std::vector<FoundObject>& found) const;
  void assign(double stamp, const std::vector<FoundObject>& found);
  void follow(Track& track, double stamp, const FoundObject& found);
  Track* wholeOf(double stamp, const FoundObject& found);
  void begin(double stamp, const FoundObject& found);
  void lendDistances(double stamp);
  bool isTakenUp(const Track& track, double stamp) const;
  void forget(double stamp, const IsHidden& is_hidden);

  std::vector<Track> tracks_;
  std::optional<double> last_;  ///< stamp, s
  std::uint32_t count_ = 0;     ///< of objects so far
};

}  // namespace process_visualizer::objects
