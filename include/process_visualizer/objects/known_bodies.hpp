// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// The links of a robot description that have a shape: what is visible of them, which is what a
/// camera sees, or else their collision geometry.
/// \throws std::invalid_argument that says what is wrong with the description or one of its meshes
std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read);

/// A part of the cell that has a model, such as a robot's link.
struct KnownBody {
  /// \param reach  how near a place must be for its distance to be known, m
  /// \param is_robot  whether distances to it are wanted, however large
  KnownBody(std::string name, const cloud::Surface& mesh, float reach, bool is_robot)
      : frame(std::move(name)), field(mesh, reach) {
    if (is_robot) samples.emplace(mesh);
  }

  std::string frame;
  DistanceField field;
  std::optional<SurfaceSamples> samples;  ///< of robots only
};

/// The bodies where they are at one time. A coarse grid over the space around them says which ones
/// a place may be near, so that most places are dealt with by one look.
class PosedBodies {
 public:
  /// \param bodies  must outlive this
  /// \param cloud_from_body  a transform for each of them into the frame of the places
  PosedBodies(const std::vector<KnownBody>& bodies,
              const std::vector<Eigen::Isometry3f>& cloud_from_body);

  /// The first of the bodies in which a place lies, or to which it is nearer than `padding` (m, at
  /// most the bodies' reach); null if there is none.
  const KnownBody* covering(const Eigen::Vector3f& place, float padding) const;

  /// Whether the way from the origin to a place leads through a robot, deeper than `depth` (m). A
  /// robot around the origin does not count: a sensor may be mounted on it.
  bool isBehindRobot(const Eigen::Vector3f& place, float depth) const;

 private:
  using Word = std::uint64_t;

  void layOut();
  void insert(std::size_t body);

  const std::vector<KnownBody>& bodies_;
  const std::vector<Eigen::Isometry3f>& cloud_from_body_;
  std::vector<Eigen::Isometry3f> body_from_cloud_;
  Eigen::AlignedBox3f bounds_;
  float cell_ = 0;  ///< edge length, m
  Eigen::Vector3i count_ = Eigen::Vector3i::Zero();
  std::size_t words_;        ///< for each cell
  std::vector<Word> masks_;  ///< bit i of a cell: body i may be near
};

/// The shortest way from an object to a robot.
struct RobotDistance {
  std::string link;
  float distance;  ///< m
  Eigen::Vector3f on_object, on_robot;
};

/// The distance of points from the robots among the bodies; nothing if there is none.
/// \param points  at least one, m
/// \param from_body  a transform for each body into the frame of the points
std::optional<RobotDistance> distanceToRobots(const Cluster& points,
                                              const std::vector<KnownBody>& bodies,
                                              const std::vector<Eigen::Isometry3f>& from_body);

}  // namespace process_visualizer::objects
