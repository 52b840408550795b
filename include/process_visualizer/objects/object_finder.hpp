// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Objects in a single cloud: labels its points, and divides the free ones into measured objects.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <vector>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/known_bodies.hpp"
#include "process_visualizer/objects/point_image.hpp"
#include "process_visualizer/objects/support_planes.hpp"
#include "process_visualizer/objects/walls.hpp"

namespace process_visualizer::objects {

/// A tracked object at its predicted place.
struct PredictedObject {
  UprightBox box;
  bool is_complete;        ///< seen at least once with no part of it hidden
  bool is_moving = false;  ///< fast, so it may change its shape, as a person does
  bool stands = false;     ///< known not to move
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< m/s
};

/// Parameters of the search for objects.
struct FinderSettings {
  float padding = 0.03F;          ///< points nearer than this to a known body belong to it, m
  float gap = 0.03F;              ///< objects nearer to each other than this are one, m
  std::size_t min_points = 40;    ///< of an object
  float min_surface_area = 0.5F;  ///< larger level surfaces are supports, not objects, m²
  std::optional<DepthNoise> noise = std::nullopt;  ///< of the sensor; estimated if not given
};

/// Poses and regions at the time of a cloud.
struct Scene {
  Eigen::Isometry3f global_from_cloud;  ///< into a frame whose z axis points up
  std::vector<Eigen::Isometry3f> cloud_from_body;
  std::optional<cloud::InsideBox> region;  ///< only this part is searched
  std::vector<cloud::InsideBox> expected;  ///< objects in these are not reported
};

/// A point on the silhouette of an object, in the global frame.
struct Rim {
  Eigen::Vector3f place;
  Eigen::Vector3f outwards;  ///< unit vector, away from the object
  bool is_truncated;         ///< the object may extend further there, hidden or out of view
};

/// A detection of something that has no model, in the global frame.
struct FoundObject {
  UprightBox box;  ///< around its visible part
  std::size_t points;
  std::optional<RobotDistance> robot;              ///< to the nearest robot, if there is one
  Cluster places = {};                             ///< of its points
  std::vector<Rim> rim = {};                       ///< its silhouette, as the sensor sees it
  Eigen::Vector3f blur = Eigen::Vector3f::Zero();  ///< of its places, see boxAround

  /// Returns whether a part of it may be hidden or out of view.
  bool isTruncated() const {
    return std::any_of(rim.begin(), rim.end(), [](const Rim& it) { return it.is_truncated; });
  }
};

/// The smallest object that a sensor can detect at the distance of the scene.
struct DetectionLimit {
  float range;  ///< median of the points, m
  float size;   ///< an object lower above a surface, or nearer to a robot, may be missed there, m
};

/// Counts of rays that end on robots, and of rays that pass through where a robot should be.
struct Agreement {
  std::size_t on = 0, through = 0;

  /// Returns whether more rays pass through robots than end on them.
  bool isContradiction() const { return through >= kMinThrough && through > on; }

  static constexpr std::size_t kMinThrough = 10;
};

/// Removes known bodies from clouds, and divides the rest into objects.
class ObjectFinder {
 public:
  ObjectFinder(std::vector<KnownBody> bodies, const FinderSettings& settings)
      : bodies_(std::move(bodies)), settings_(settings) {}

  const std::vector<KnownBody>& bodies() const { return bodies_; }

  /// Returns the label of each point. If the noise of the sensor is not given, it is estimated from
  /// the first cloud, and updated by some of the clouds searched later.
  std::vector<Label> label(const Points& points, const Scene& scene);

  /// The noise of the sensor, given or estimated so far.
  DepthNoise noise() const {
    return settings_.noise ? *settings_.noise : noise_.value_or(DepthNoise());
  }

  /// Detection limit in a cloud, by the noise of the sensor; nothing if it has no points.
  std::optional<DetectionLimit> detectionLimit(const Points& points,
                                               const std::vector<Label>& labels) const;

  /// Returns whether the sensor looks into the region. If not, something may be in front of it.
  static bool looksIntoRegion(const Points& points, const std::vector<Label>& labels,
                              const Scene& scene);

  /// Compares the robots' models with a sample of the sensor's points. They disagree if the sensor
  /// was moved, or if the joints or stamps of a robot are wrong. Other models do not count: they
  /// may have windows, or gaps that are not modeled.
  Agreement agreement(const Points& points, const std::vector<Label>& labels,
                      const Scene& scene) const;

  /// Returns the objects among the free points, at most the `kMaxObjects` largest.
  /// \param predicted  objects of earlier clouds, where they are predicted now. They tell which
  /// points belong together where objects touch or are partly hidden; all else depends on this
  /// cloud alone
  std::vector<FoundObject> find(const Points& points, const std::vector<Label>& labels,
                                const Scene& scene,
                                const std::vector<PredictedObject>& predicted = {});

  /// Distance of the robots from places in the global frame; nothing if there is no robot.
  std::optional<RobotDistance> distanceTo(const Cluster& places, const Scene& scene) const;

  static constexpr std::size_t kMaxObjects = 100;

 private:
  void learnNoise(const DepthNoise& seen);

  std::vector<KnownBody> bodies_;
  FinderSettings settings_;
  std::optional<DepthNoise> noise_;        ///< the estimate
  std::size_t clouds_ = 0;                 ///< searched so far
  std::optional<Walls> walls_;             ///< of the newest cloud
  std::optional<SupportPlanes> surfaces_;  ///< of the newest cloud
};

}  // namespace process_visualizer::objects
