// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Numbers of detected objects from cloud to cloud: which detection continues which track, and when
// a hidden one is forgotten.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "process_visualizer/objects/motion.hpp"
#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// Completes the box of a partly hidden object. A hidden side is placed by the opposite one and the
/// known size. If both are hidden, the box stays as near to its prediction as the visible part
/// permits.
/// \param predicted  the complete object at its predicted place
UprightBox completed(const UprightBox& predicted, const FoundObject& found);

/// An object that is tracked from cloud to cloud.
struct TrackedObject {
  std::uint32_t number;  ///< stays the same, from 1
  FoundObject object;    ///< at its last observation, with a smoothed box and the current distance
  bool is_seen;          ///< in the last cloud; if not, something may hide it
  bool is_confirmed = true;  ///< observed often enough not to be noise
  bool is_current = true;    ///< the distance is that of the part visible in the last cloud
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< m/s
  std::optional<float> contact_s = std::nullopt;       ///< time to contact, if it approaches, s
};

/// Gives objects stable numbers, also while they are partly or completely hidden.
///
/// A new object is confirmed after three clouds in a row. Until then it may be noise; it is shown
/// only if it is large, as unconfirmed, because a fast object may be gone after three clouds. An
/// object that is not seen is kept for `kMaxUnseen`, and as long as its place is hidden. A part of
/// an object next to its occluder does not become a new object. Nothing is kept across a jump in
/// time: a cloud that is older than the last one, or much newer.
class ObjectTracks {
 public:
  /// Returns whether a place is hidden from the sensor.
  using IsHidden = std::function<bool(const UprightBox&)>;

  /// Returns the distance between the places and the robots at the time of the cloud.
  using DistanceOf = std::function<std::optional<RobotDistance>(const Cluster&)>;

  /// The objects that have a number, at their predicted places.
  /// \param stamp  of the next cloud, s
  std::vector<PredictedObject> predictedAt(double stamp) const;

  /// \param stamp  of the cloud, s
  /// \param distance_of  for objects of which less is visible than before; a robot keeps moving
  ///                     while it occludes one
  /// \return all objects that have a number, in order of number
  std::vector<TrackedObject> update(
      double stamp, const std::vector<FoundObject>& found,
      const IsHidden& is_hidden = [](const UprightBox&) { return false; },
      const DistanceOf& distance_of = nullptr);

  /// Forgets all objects; numbers start at 1 again.
  void reset();

  static constexpr double kMaxUnseen = 0.6;  ///< s, while its place is visible

 private:
  struct Track {
    std::optional<std::uint32_t> number;
    FoundObject object;
    Cluster places;          ///< of its surface, from its best view, moved to its last position
    std::size_t max_points;  ///< of that view; `places` are some of them
    Motion motion;
    double last_seen;           ///< s
    double last_hidden;         ///< last time at which its place was hidden or the object seen, s
    bool is_complete = false;   ///< seen at least once with no part of it hidden
    bool is_confirmed = false;  ///< not noise
    bool is_current = true;     ///< the distance is that of the part seen last
    bool is_vanishing = false;  ///< it was moving, and less than half of it was left in view
    int observations = 0;
    std::deque<std::pair<double, float>> recent_distances = {};  ///< s, m

    UprightBox predictedAt(double stamp) const;
    float gateAt(double stamp) const;
    bool isPart(const UprightBox& predicted, const FoundObject& found) const;
    bool stands() const;
    bool mayBePerson() const;
    bool isReplacedBy(const UprightBox& predicted, const FoundObject& found) const;
    bool mayBeLeaving(const UprightBox& predicted, const FoundObject& found) const;
    bool mayBePartOf(const UprightBox& predicted, const UprightBox& found) const;
    UprightBox measuredBox(const UprightBox& predicted, const FoundObject& found) const;
    void observe(double stamp, const FoundObject& found);
    void addPart(const FoundObject& part);
    void updatePlaces(const UprightBox& before, const FoundObject& found);
    void measureDistance(double stamp, const DistanceOf& distance_of);
    void recordDistance(double stamp);
    std::optional<float> timeToContact() const;
    TrackedObject toTrackedObject(double stamp) const;
  };

  bool isJump(double stamp) const;
  Eigen::MatrixXf costs(double stamp, const std::vector<FoundObject>& found) const;
  void assign(double stamp, const std::vector<FoundObject>& found);
  void observe(Track& track, double stamp, const FoundObject& found);
  Track* ownerOf(double stamp, const FoundObject& found);
  void startTrack(double stamp, const FoundObject& found);
  void shareDistances(double stamp);
  bool isAbsorbed(const Track& track, double stamp) const;
  void removeLost(double stamp, const IsHidden& is_hidden);

  std::vector<Track> tracks_;
  std::optional<double> last_stamp_;  ///< s
  std::uint32_t count_ = 0;           ///< of objects so far
};

}  // namespace process_visualizer::objects
