// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Distance of a place from a modeled body: a signed grid near its surface, samples farther away.

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::objects {

/// Signed distances from a surface, near it: exact at the nodes of a grid that is computed once,
/// and interpolated between them.
///
/// Distances inside a closed surface are negative, those in an open cavity are not. Gaps narrower
/// than a grid step count as closed.
class DistanceField {
 public:
  /// \param reach  distances are computed up to this one, m
  DistanceField(const cloud::Surface& mesh, float reach);

  /// Distance of a place from the surface, m, negative inside; at most about `reach`.
  float distance(const Eigen::Vector3f& place) const;

  /// Box outside of which all distances are `reach` or more.
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

/// The nearest place of a body, and its distance, m.
struct NearestPlace {
  Eigen::Vector3f place;
  float distance;
};

/// A surface as points, for larger distances: exact to half a millimeter from 0.1 m on, and to
/// `kSpacing` at the surface itself.
class SurfaceSamples {
 public:
  explicit SurfaceSamples(const cloud::Surface& mesh);

  NearestPlace nearest(const Eigen::Vector3f& place) const;

  const Eigen::Vector3f& center() const { return center_; }  ///< of a sphere around all points, m
  float radius() const { return radius_; }                   ///< of that sphere, m

  static constexpr float kSpacing = 0.01F;  ///< m

 private:
  class Tree;

  std::shared_ptr<const Tree> tree_;
  Eigen::Vector3f center_;
  float radius_;
};

}  // namespace process_visualizer::objects
