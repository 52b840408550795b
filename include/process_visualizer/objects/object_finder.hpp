// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// Where an object that is followed is thought to be.
struct PredictedObject {
  UprightBox box;
  bool is_whole;           ///< whether it has been seen without anything that hid a part of it
  bool is_moving = false;  ///< fast: what moves may change its shape, as a person does
  bool stands = false;     ///< it is known not to move
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< m/s
};

/// What is looked at, and how.
struct FinderSettings {
  float padding = 0.03F;    ///< points nearer than this to a known body are on it, m
  float gap = 0.03F;        ///< things that are nearer to each other are one, m
  std::size_t fewest = 40;  ///< points of an object
  float surface = 0.5F;     ///< larger level surfaces are supports, not objects, m²
  std::optional<DepthNoise> noise = std::nullopt;  ///< of the sensor; else it is estimated
};

/// Where everything was when a cloud was taken.
struct Scene {
  Eigen::Isometry3f global_from_cloud;  ///< into a frame whose z axis points up
  std::vector<Eigen::Isometry3f> cloud_from_body;
  std::optional<cloud::InsideBox> region;  ///< the only part searched; from the cloud's frame
  std::vector<cloud::InsideBox> expected;  ///< what is in these is known
};

/// A place where an object ends, in the global frame.
struct Rim {
  Eigen::Vector3f place;
  Eigen::Vector3f outwards;  ///< the direction in which it ends, of length 1
  bool is_cut;               ///< whether it may go on behind something
};

/// Something that nobody modeled, in the global frame.
struct FoundObject {
  UprightBox box;  ///< around what is seen of it
  std::size_t points;
  std::optional<RobotDistance> robot;              ///< the nearest one, if there are any
  Cluster places = {};                             ///< of its points
  std::vector<Rim> rim = {};                       ///< where it ends, as the sensor sees it
  Eigen::Vector3f blur = Eigen::Vector3f::Zero();  ///< of its places, see boxAround

  /// Whether something may hide a part of it.
  bool isCut() const {
    return std::any_of(rim.begin(), rim.end(), [](const Rim& it) { return it.is_cut; });
  }
};

/// What a sensor can see at the distance of what it looks at.
struct Sight {
  float range;     ///< the middle one of the points that are looked at, m
  float smallest;  ///< what is lower above a surface, or nearer to a robot, may be missed there, m
};

/// How often a sensor sees robots, and how often it sees through where a robot should be.
struct Agreement {
  std::size_t on = 0, through = 0;  ///< sights

  /// Whether more sights pass through robots than end on them.
  bool isContradiction() const { return through >= kFewestThrough && through > on; }

  static constexpr std::size_t kFewestThrough = 10;
};

/// Takes what is known out of clouds, and divides the rest into objects.
class ObjectFinder {
 public:
  ObjectFinder(std::vector<KnownBody> bodies, const FinderSettings& settings)
      : bodies_(std::move(bodies)), settings_(settings) {}

  const std::vector<KnownBody>& bodies() const { return bodies_; }

  /// What is known about each point. Where the noise of the sensor is not given it is estimated, by
  /// the first cloud, and then by each in which objects are sought.
  std::vector<Label> label(const Points& points, const Scene& scene);

  /// The noise of the sensor, given or estimated so far.
  DepthNoise noise() const {
    return settings_.noise ? *settings_.noise : noise_.value_or(DepthNoise());
  }

  /// What can be seen of a cloud, by the noise of the sensor; nothing if it has no points.
  std::optional<Sight> sight(const Points& points, const std::vector<Label>& labels) const;

  /// Whether the sensor looks into the region at all: something may be in front of it.
  static bool looksIntoRegion(const Points& points, const std::vector<Label>& labels,
                              const Scene& scene);

  /// Compares the robots' models with what the sensor sees, by a sample of its points. They differ
  /// if somebody has moved the sensor, or if the joints or stamps of a robot are wrong. Other
  /// models do not count: they may have windows, or gaps that are not modeled.
  Agreement agreement(const Points& points, const std::vector<Label>& labels,
                      const Scene& scene) const;

  /// The objects among the points that are free, at most the `kMostObjects` largest.
  /// \param expected  objects of earlier clouds, where they are thought to be now. They tell what
  /// belongs together where objects touch, or something hides a part of one; the rest is judged by
  /// this cloud alone
  std::vector<FoundObject> find(const Points& points, const std::vector<Label>& labels,
                                const Scene& scene,
                                const std::vector<PredictedObject>& predicted = {});

  /// How far the robots are from places in the global frame; nothing if there is none.
  std::optional<RobotDistance> distanceTo(const Cluster& places, const Scene& scene) const;

  static constexpr std::size_t kMostObjects = 100;

 private:
  void learnNoise(const DepthNoise& seen);

  std::vector<KnownBody> bodies_;
  FinderSettings settings_;
  std::optional<DepthNoise> noise_;        ///< as estimated
  std::size_t clouds_ = 0;                 ///< in which objects were sought
  std::optional<Walls> walls_;             ///< of the newest cloud
  std::optional<SupportPlanes> surfaces_;  ///< of the newest cloud
};

}  // namespace process_visualizer::objects
