// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::objects {

/// How far places near a surface are from it: exact at the nodes of a grid, made once, and
/// interpolated between them.
///
/// What a surface encloses has negative distances, cavities that are open have not. A surface with
/// gaps narrower than a grid step still encloses.
class DistanceField {
 public:
  /// \param reach  up to this distance from the surface it is known, m
  DistanceField(const cloud::Surface& mesh, float reach);

  /// The distance of a place from the surface, m, negative inside; at most about `reach`.
  float distance(const Eigen::Vector3f& place) const;

  /// The box outside of which all distances are `reach` or more.
  const Eigen::AlignedBox3f& bounds() const { return bounds_; }

  float step() const { return step_; }  ///< of the grid, m

 private:
  using Node = Eigen::Vector3i;

  std::size_t indexOf(const Node& node) const;
  void measure(const cloud::Triangle& triangle);
  void markInside();
  std::vector<bool> reachableFromOutside() const;

  float reach_, step_;
  Eigen::AlignedBox3f bounds_;
  Node count_;
  std::vector<float> distances_;
};

/// The place of a body that is nearest to another place, and how far it is, m.
struct NearestPlace {
  Eigen::Vector3f place;
  float distance;
};

/// A surface as points, for distances that may be large: right to half a millimetre from 0.1 m on,
/// to `kSpacing` at the surface itself.
class SurfaceSamples {
 public:
  explicit SurfaceSamples(const cloud::Surface& mesh);

  NearestPlace nearest(const Eigen::Vector3f& place) const;

  const Eigen::Vector3f& center() const { return center_; }  ///< of a sphere around all, m
  float radius() const { return radius_; }                   ///< of that sphere, m

  static constexpr float kSpacing = 0.01F;  ///< m

 private:
  class Tree;

  std::shared_ptr<const Tree> tree_;
  Eigen::Vector3f center_;
  float radius_;
};

}  // namespace process_visualizer::objects
