// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::objects {

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
