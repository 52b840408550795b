// SPDX-License-Identifier: BSD-3-Clause
// Computes the grid of distances, finds its inside by flood fill, and interpolates.

#include "process_visualizer/objects/distance_field.hpp"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr float kMinStep = 0.008F;     // m
constexpr double kMaxNodes = 600'000;  // 2.4 MB for each body

float stepFor(const Vector3f& size) {
  const double volume = size.cast<double>().prod();
  return std::max(kMinStep, static_cast<float>(std::cbrt(volume / kMaxNodes)));
}

}  // namespace

DistanceField::DistanceField(const cloud::Surface& mesh, float reach) : reach_(reach) {
  bounds_ = cloud::boundsOf(mesh);
  bounds_.min().array() -= reach;
  bounds_.max().array() += reach;
  step_ = stepFor(bounds_.sizes());
  count_ = (bounds_.sizes() / step_).array().ceil().cast<int>() + 1;
  distances_.assign(static_cast<std::size_t>(count_.x()) * count_.y() * count_.z(), reach);
  for (const cloud::Triangle& triangle : mesh) measure(triangle);
  markInside();
}

std::size_t DistanceField::indexOf(const Node& node) const {
  return (static_cast<std::size_t>(node.z()) * count_.y() + node.y()) * count_.x() + node.x();
}

/// Updates the distances of the nodes near a triangle.
void DistanceField::measure(const cloud::Triangle& triangle) {
  const Eigen::AlignedBox3f box = cloud::boundsOf(cloud::Surface{triangle});
  const Vector3f middle = box.center();
  const float radius = box.sizes().norm() / 2;
  const auto toNode = [this](const Vector3f& place) -> Node {
    return ((place - bounds_.min()) / step_).array().floor().cast<int>();
  };
  const Node first = toNode(box.min().array() - reach_).cwiseMax(0);
  const Node last = (toNode(box.max().array() + reach_).array() + 1).min(count_.array() - 1);
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vector3f place = bounds_.min() + step_ * Vector3f(x, y, z);
        float& distance = distances_[indexOf({x, y, z})];
        const float reach = distance + radius;
        if ((place - middle).squaredNorm() >= reach * reach)
          continue;  // no nearer than the triangles before
        distance = std::min(distance, (cloud::closestPoint(triangle, place) - place).norm());
      }
    }
  }
}

void DistanceField::markInside() {
  const std::vector<bool> is_outside = reachableFromOutside();
  for (std::size_t index = 0; index < distances_.size(); ++index)
    if (!is_outside[index]) distances_[index] = -distances_[index];
}

/// Flood fill. An edge of the grid that crosses the surface has a node within half a step of it:
/// such nodes are reached, but nothing beyond them.
std::vector<bool> DistanceField::reachableFromOutside() const {
  std::vector<bool> is_reached(distances_.size());
  std::vector<Node> open{Node::Zero()};
  is_reached[0] = true;
  while (!open.empty()) {
    const Node node = open.back();
    open.pop_back();
    if (distances_[indexOf(node)] <= step_ / 2) continue;
    for (int side = 0; side < 6; ++side) {
      Node next = node;
      next[side / 2] += side % 2 == 0 ? 1 : -1;
      if ((next.array() < 0).any() || (next.array() >= count_.array()).any()) continue;
      if (is_reached[indexOf(next)]) continue;
      is_reached[indexOf(next)] = true;
      open.push_back(next);
    }
  }
  return is_reached;
}

float DistanceField::distance(const Vector3f& place) const {
  const Vector3f position = (place - bounds_.min()) / step_;
  const bool is_in_grid =
      (position.array() >= 0).all() && (position.array() < count_.cast<float>().array() - 1).all();
  if (!is_in_grid) return reach_;  // NaN as well
  const Vector3i node = position.cast<int>();
  const Vector3f part = position - node.cast<float>();
  const std::size_t row = count_.x(), layer = row * count_.y();
  const float* corner = &distances_[indexOf(node)];
  const auto along_x = [&](const float* begin) {
    return begin[0] + (begin[1] - begin[0]) * part.x();
  };
  const auto along_y = [&](const float* begin) {
    const float low = along_x(begin);
    return low + (along_x(begin + row) - low) * part.y();
  };
  const float low = along_y(corner);
  return low + (along_y(corner + layer) - low) * part.z();
}

/// PCL's k-d tree, hidden from users of the header.
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

/// Thins the samples, as a mesh with fine detail has thousands of small triangles.
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
