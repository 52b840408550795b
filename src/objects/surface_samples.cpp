// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/surface_samples.hpp"

#include <pcl/filters/voxel_grid.h>

#include <cmath>
#include <vector>

namespace process_visualizer::objects {

/// Samples of many small triangles are thinned: a mesh with fine detail has thousands.
SurfaceSamples::SurfaceSamples(const TriangleMesh& mesh)
    : points_(new pcl::PointCloud<pcl::PointXYZ>), center_(boundsOf(mesh).center()), radius_(0) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr all(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3f& it : samplesOf(mesh, kSpacing)) {
    all->push_back({it.x(), it.y(), it.z()});
    radius_ = std::max(radius_, (it - center_).norm());
  }
  pcl::VoxelGrid<pcl::PointXYZ> thinning;
  thinning.setLeafSize(kSpacing, kSpacing, kSpacing);
  thinning.setInputCloud(all);
  thinning.filter(*points_);
  tree_.setInputCloud(points_);
}

NearestPlace SurfaceSamples::nearest(const Eigen::Vector3f& place) const {
  std::vector<int> index(1);
  std::vector<float> square(1);
  tree_.nearestKSearch({place.x(), place.y(), place.z()}, 1, index, square);
  return {points_->at(index[0]).getVector3fMap(), std::sqrt(square[0])};
}

}  // namespace process_visualizer::objects
