// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/support_planes.hpp"

#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;
using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using PlaneModel = pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>;

constexpr int kMostPlanes = 4;
constexpr double kSteepest = 10 * M_PI / 180;  // rad
constexpr float kTile = 0.05F;                 // m: areas are counted in tiles of this size
constexpr float kLeastArea = 0.5F;             // m²
constexpr int kTrials = 150;
constexpr double kSurely = 0.99;  // that a better plane was not missed

Cloud::Ptr toCloud(const std::vector<Vector3f>& points) {
  Cloud::Ptr cloud(new Cloud);
  for (const Vector3f& it : points) cloud->push_back({it.x(), it.y(), it.z()});
  return cloud;
}

/// The area that points cover, seen from above, m².
float areaOf(const std::vector<Vector3f>& points, const pcl::Indices& indices) {
  std::set<std::pair<int, int>> tiles;
  for (const auto index : indices)
    tiles.emplace(static_cast<int>(std::floor(points[index].x() / kTile)),
                  static_cast<int>(std::floor(points[index].y() / kTile)));
  return static_cast<float>(tiles.size()) * kTile * kTile;
}

}  // namespace

SupportPlanes::SupportPlanes(std::vector<Vector3f> points, const Vector3f& sensor)
    : sensor_(sensor) {
  while (planes_.size() < kMostPlanes && findNext(points)) {
  }
}

/// Takes the points of the largest plane out of `points`.
bool SupportPlanes::findNext(std::vector<Vector3f>& points) {
  if (points.size() < 3) return false;
  // The seed is always the same: what is found depends on this cloud alone.
  PlaneModel::Ptr model(new PlaneModel(toCloud(points), false));
  model->setAxis(Vector3f::UnitZ());
  model->setEpsAngle(kSteepest);
  const Vector3f middle = points[points.size() / 2];
  pcl::RandomSampleConsensus<pcl::PointXYZ> search(model, tolerance(middle));
  search.setMaxIterations(kTrials);
  search.setProbability(kSurely);
  if (!search.computeModel()) return false;
  pcl::Indices inliers;
  Eigen::VectorXf found, refined;
  search.getInliers(inliers);
  search.getModelCoefficients(found);
  if (areaOf(points, inliers) < kLeastArea) return false;
  model->optimizeModelCoefficients(inliers, found, refined);
  if (refined[2] < 0) refined = -refined;
  planes_.emplace_back(Vector3f(refined.head<3>()), refined[3]);
  points.erase(std::remove_if(points.begin(), points.end(),
                              [this](const Vector3f& point) { return contain(point); }),
               points.end());
  return true;
}

float SupportPlanes::tolerance(const Vector3f& point) const {
  return 0.012F + 0.003F * (point - sensor_).squaredNorm();
}

bool SupportPlanes::contain(const Vector3f& point) const {
  const float tolerance_m = tolerance(point);
  return std::any_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
    return plane.absDistance(point) < tolerance_m;
  });
}

std::optional<float> SupportPlanes::heightBelow(const Vector3f& place) const {
  std::optional<float> height;
  for (const Plane& plane : planes_) {
    const Vector3f& normal = plane.normal();
    const float here = -(plane.offset() + normal.head<2>().dot(place.head<2>())) / normal.z();
    if (here <= place.z() && (!height || here > *height)) height = here;
  }
  return height;
}

}  // namespace process_visualizer::objects
