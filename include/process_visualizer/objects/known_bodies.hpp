// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/objects/distance_field.hpp"
#include "process_visualizer/objects/surface_samples.hpp"

namespace process_visualizer::objects {

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

}  // namespace process_visualizer::objects
