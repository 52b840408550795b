// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/surface_samples.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {

/// Samples of many small triangles are thinned: a mesh with fine detail has thousands.
SurfaceSamples::SurfaceSamples(const TriangleMesh& mesh)
    : points_(new pcl::PointCloud<pcl::PointXYZ>), center_(boundsOf(mesh).center()), radius_(0) {
  for (const Eigen::Vector3f& it : thinned(samplesOf(mesh, kSpacing), kSpacing)) {
    points_->push_back({it.x(), it.y(), it.z()});
    radius_ = std::max(radius_, (it - center_).norm());
  }
  tree_.setInputCloud(points_);
}

NearestPlace SurfaceSamples::nearest(const Eigen::Vector3f& place) const {
  std::vector<int> index(1);
  std::vector<float> square(1);
  tree_.nearestKSearch({place.x(), place.y(), place.z()}, 1, index, square);
  return {points_->at(index[0]).getVector3fMap(), std::sqrt(square[0])};
}

}  // namespace process_visualizer::objects
