// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/surface_samples.hpp"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {

/// PCL's tree, of which nothing else here needs to know.
class SurfaceSamples::Tree {
 public:
  explicit Tree(const std::vector<Eigen::Vector3f>& samples)
      : points_(new pcl::PointCloud<pcl::PointXYZ>) {
    for (const Eigen::Vector3f& it : samples) points_->push_back({it.x(), it.y(), it.z()});
    tree_.setInputCloud(points_);
  }

  NearestPlace nearest(const Eigen::Vector3f& place) const {
    std::vector<int> index(1);
    std::vector<float> square(1);
    tree_.nearestKSearch({place.x(), place.y(), place.z()}, 1, index, square);
    return {points_->at(index[0]).getVector3fMap(), std::sqrt(square[0])};
  }

 private:
  pcl::PointCloud<pcl::PointXYZ>::Ptr points_;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
};

/// Samples of many small triangles are thinned: a mesh with fine detail has thousands.
SurfaceSamples::SurfaceSamples(const cloud::Surface& mesh)
    : center_(cloud::boundsOf(mesh).center()), radius_(0) {
  const std::vector<Eigen::Vector3f> samples = thinned(cloud::samplesOf(mesh, kSpacing), kSpacing);
  for (const Eigen::Vector3f& it : samples) radius_ = std::max(radius_, (it - center_).norm());
  tree_ = std::make_shared<const Tree>(samples);
}

NearestPlace SurfaceSamples::nearest(const Eigen::Vector3f& place) const {
  return tree_->nearest(place);
}

}  // namespace process_visualizer::objects
