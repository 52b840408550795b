// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/pose_fit.hpp"

#include <pcl/common/common.h>
#include <pcl/common/transforms.h>
#include <pcl/filters/crop_box.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "process_visualizer/cloud/determination.hpp"
#include "process_visualizer/cloud/fit_refinement.hpp"
#include "process_visualizer/cloud/neighbours.hpp"

namespace process_visualizer::cloud {
namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;
using Tree = pcl::search::KdTree<pcl::PointNormal>;
using Icp = pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal, double>;

/// How far a point and its surface may be from each other, in a round, and how often ICP repeats.
struct Round {
  double reach_m;
  int iterations;
};
constexpr std::array<Round, 7> kRounds{
    {{0.12, 25}, {0.06, 20}, {0.03, 20}, {0.015, 30}, {0.008, 50}, {0.005, 50}, {0.0035, 50}}};

constexpr double kSourceReach = 1.5;  ///< times that of a round: what ICP looks at in it
constexpr double kStillM = 1e-6;      ///< ICP ends when it moves the cloud less

constexpr std::size_t kFewestPoints = 300;    ///< 0.03 m² of the model
constexpr double kSolvable = 1e-3;            ///< `Determination::weakest` that ICP needs
constexpr double kLeastDetermination = 0.01;  ///< `Determination::weakest`
constexpr double kLargestResidualM = 0.006;   ///< a cloud of noise has about half of the reach
constexpr double kFarthestM = 0.25;           ///< a correction of more is a wrong one

pcl::PointNormal pointAt(const Eigen::Vector3f& place) {
  pcl::PointNormal point;
  point.getVector3fMap() = place;
  return point;
}

/// The points of a cloud within a reach of a model's extent.
Points::Ptr near(const Points& cloud, const SurfaceCloud& model) {
  Eigen::Vector4f low, high;
  pcl::getMinMax3D(model, low, high);
  const auto reach = static_cast<float>(kRounds.front().reach_m);
  const Eigen::Vector4f margin(reach, reach, reach, 0.0F);
  auto input = std::make_shared<Points>(cloud);
  input->is_dense = false;  // else NaN would pass
  pcl::CropBox<pcl::PointXYZ> crop;
  crop.setInputCloud(input);
  crop.setMin(low - margin);
  crop.setMax(high + margin);
  auto found = std::make_shared<Points>();
  crop.filter(*found);
  return found;
}

/// The means of neighbours, which have less noise.
SurfaceCloud meansOf(const std::vector<Neighbours>& groups) {
  SurfaceCloud means;
  for (const Neighbours& group : groups) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f& place : group) sum += place;
    means.push_back(pointAt(sum / static_cast<float>(group.size())));
  }
  return means;
}

/// Pairs of a cloud's points and the model's, and the model's points in them.
struct Contact {
  SurfaceCloud surface;
  double rms_m = 0.0;  ///< distance from the surfaces
};

Contact contact(const SurfaceCloud& cloud, const SurfaceCloud& model, const Tree& tree,
                double reach_m) {
  Contact found;
  double sum = 0.0;
  std::vector<int> indices(1);
  std::vector<float> squares(1);
  for (const auto& point : cloud) {
    if (tree.nearestKSearch(point, 1, indices, squares) == 0) continue;
    const auto& nearest = model[indices[0]];
    const Eigen::Vector3f normal = normalOf(nearest);
    if (squares[0] > reach_m * reach_m) continue;
    const double distance = normal.dot(placeOf(point) - placeOf(nearest));
    sum += distance * distance;
    found.surface.push_back(nearest);
  }
  found.rms_m = std::sqrt(sum / std::max<double>(1.0, static_cast<double>(found.surface.size())));
  return found;
}

std::unique_ptr<Icp> pointToPlane(const SurfaceCloud& model, const Tree::Ptr& tree) {
  using Estimation =
      pcl::registration::TransformationEstimationPointToPlaneLLS<pcl::PointNormal, pcl::PointNormal,
                                                                 double>;
  auto icp = std::make_unique<Icp>();
  icp->setInputTarget(model.makeShared());
  icp->setSearchMethodTarget(tree, /*force_no_recompute=*/true);
  icp->setTransformationEstimation(std::make_shared<Estimation>());
  icp->setTransformationEpsilon(kStillM * kStillM);
  return icp;
}

/// The points of a cloud that lie within a distance of the model when they are moved.
SurfaceCloud::Ptr within(double distance_m, const SurfaceCloud& cloud, const SurfaceCloud& moved,
                         const Tree& tree) {
  auto found = std::make_shared<SurfaceCloud>();
  std::vector<int> indices(1);
  std::vector<float> squares(1);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (tree.nearestKSearch(moved[i], 1, indices, squares) == 1 &&
        squares[0] < distance_m * distance_m)
      found->push_back(cloud[i]);
  return found;
}

std::string millimetres(double length_m) {
  return std::to_string(std::lround(1000.0 * length_m)) + " mm";
}

void refuseFewPoints(std::size_t count) {
  if (count >= kFewestPoints) return;
  throw FitRefused("only " + std::to_string(count) + " points lie on the models (at least " +
                   std::to_string(kFewestPoints) +
                   " are needed); bring more of them into view, or move "
                   "the sensor closer to where it is by hand first");
}

[[noreturn]] void refuseFreeMotion(const Determination& determination) {
  throw FitRefused("nothing that is in view holds the sensor against " +
                   determination.freeMotion() + "; bring surfaces of other directions into view");
}

void refuseBadFit(const PoseFit& fit, const Determination& determination, double shift_m) {
  if (determination.weakest() < kLeastDetermination) refuseFreeMotion(determination);
  if (fit.residual_m > kLargestResidualM || !(shift_m < kFarthestM))
    throw FitRefused(
        "the cloud does not come to lie on the models: " + millimetres(fit.residual_m) +
        " are left, after a motion of " + millimetres(shift_m) +
        "; move the sensor closer to where it is by hand first");
}

/// A round of ICP is solvable only if it has points, and they hold the cloud in all directions.
void refuseUnsolvable(const Contact& contact) {
  refuseFewPoints(contact.surface.size());
  const Determination determination(contact.surface);
  if (determination.weakest() < kSolvable) refuseFreeMotion(determination);
}

/// ICP from point to plane in rounds; returns what moves the cloud onto the model.
Eigen::Isometry3d aligned(const SurfaceCloud& cloud, const SurfaceCloud& model,
                          const Tree::Ptr& tree) {
  const std::unique_ptr<Icp> icp = pointToPlane(model, tree);
  Eigen::Matrix4d found = Eigen::Matrix4d::Identity();
  for (const Round& round : kRounds) {
    SurfaceCloud moved;
    pcl::transformPointCloud(cloud, moved, found);
    refuseUnsolvable(contact(moved, model, *tree, round.reach_m));
    icp->setInputSource(within(kSourceReach * round.reach_m, cloud, moved, *tree));
    icp->setMaxCorrespondenceDistance(round.reach_m);
    icp->setMaximumIterations(round.iterations);
    icp->align(moved, found);
    found = icp->getFinalTransformation();
  }
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Matrix3d rotation = found.topLeftCorner<3, 3>();
  result.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  result.translation() = found.topRightCorner<3, 1>();
  return result;
}

}  // namespace

PoseFit fitPose(const pcl::PointCloud<pcl::PointXYZ>& cloud, const Eigen::Vector3f& sensor,
                const SurfaceCloud& model, double spacing_m) {
  const SurfaceCloud surface = visibleFrom(sensor, model, spacing_m);
  const std::vector<Neighbours> groups = neighboursOf(*near(cloud, surface), sensor);
  const SurfaceCloud points = meansOf(groups);
  refuseFewPoints(std::min(points.size(), surface.size()));
  auto tree = std::make_shared<Tree>();
  tree->setInputCloud(surface.makeShared());
  const Contact before = contact(points, surface, *tree, kRounds.front().reach_m);
  const Eigen::Isometry3d correction =
      refined(groups, surface, *tree, spacing_m, aligned(points, surface, tree));
  SurfaceCloud moved;
  pcl::transformPointCloud(points, moved, correction.matrix().cast<float>());
  const Contact after = contact(moved, surface, *tree, kRounds.back().reach_m);
  refuseFewPoints(after.surface.size());
  const Determination determination(after.surface);
  PoseFit fit{correction, before.rms_m, after.rms_m, after.surface.size(), determination.weakest()};
  const Eigen::Vector3d eye = sensor.cast<double>();
  refuseBadFit(fit, determination, (correction * eye - eye).norm());
  return fit;
}

}  // namespace process_visualizer::cloud
