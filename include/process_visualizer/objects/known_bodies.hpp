// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bodies with a model (robots and others): points that belong to them, lines of sight through them,
// distances of objects from robots.

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"
#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/distance_field.hpp"

namespace process_visualizer::objects {

/// The surface of a link of a model, in the link's frame.
struct LinkGeometry {
  std::string frame;
  cloud::Surface mesh;
};

/// Returns the bytes of a resource (`package://…`, `file://…`).
using ReadResource = std::function<std::vector<std::uint8_t>(const std::string& url)>;

/// The links of a robot description that have a shape: the visual geometry, as a camera sees it, or
/// else the collision geometry.
/// \throws std::invalid_argument that names the problem of the description or one of its meshes
std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read);

/// A part of the cell that has a model, such as a robot's link.
struct KnownBody {
  /// \param reach  of its distance field, m
  /// \param is_robot  true if distances to it are needed beyond `reach`
  KnownBody(std::string name, const cloud::Surface& mesh, float reach, bool is_robot)
      : frame(std::move(name)), field(mesh, reach) {
    if (is_robot) samples.emplace(mesh);
  }

  std::string frame;
  DistanceField field;
  std::optional<SurfaceSamples> samples;  ///< of robots only
};

/// The bodies in their poses at one time. A coarse grid lists those that may be near a place, so
/// that most places need a single lookup.
class PosedBodies {
 public:
  /// \param bodies  must outlive this
  /// \param cloud_from_body  a transform of each of them into the frame of the places
  PosedBodies(const std::vector<KnownBody>& bodies,
              const std::vector<Eigen::Isometry3f>& cloud_from_body);

  /// The first body that contains a place or is nearer to it than `padding` (m, at most the bodies'
  /// reach); null if there is none.
  const KnownBody* covering(const Eigen::Vector3f& place, float padding) const;

  /// Returns whether the line of sight from the origin to a place passes through a robot, deeper
  /// than `depth` (m). A robot around the origin does not count: a sensor may be mounted on it.
  bool isBehindRobot(const Eigen::Vector3f& place, float depth) const;

 private:
  using Word = std::uint64_t;

  void createGrid();
  void insert(std::size_t body);

  const std::vector<KnownBody>& bodies_;
  const std::vector<Eigen::Isometry3f>& cloud_from_body_;
  std::vector<Eigen::Isometry3f> body_from_cloud_;
  Eigen::AlignedBox3f bounds_;
  float cell_ = 0;  ///< edge length, m
  Eigen::Vector3i count_ = Eigen::Vector3i::Zero();
  std::size_t words_;        ///< of each cell
  std::vector<Word> masks_;  ///< bit i of a cell: body i may be near
};

/// The shortest connection between an object and a robot.
struct RobotDistance {
  std::string link;
  float distance;  ///< m
  Eigen::Vector3f on_object, on_robot;
};

/// Distance of points from the robots among the bodies; nothing if there is no robot.
/// \param points  at least one, m
/// \param from_body  a transform of each body into the frame of the points
std::optional<RobotDistance> distanceToRobots(const Cluster& points,
                                              const std::vector<KnownBody>& bodies,
                                              const std::vector<Eigen::Isometry3f>& from_body);

}  // namespace process_visualizer::objects
