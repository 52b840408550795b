// SPDX-License-Identifier: BSD-3-Clause
// ICP in rounds, refinement of its result, and the thresholds that refuse a fit.

#include "process_visualizer/cloud/pose_fit.hpp"

#include <pcl/common/common.h>
#include <pcl/common/transforms.h>
#include <pcl/filters/crop_box.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "process_visualizer/cloud/line_of_sight.hpp"
#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Vector3d center(const SurfaceCloud& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += placeOf(point).cast<double>();
  return sum / static_cast<double>(points.size());
}

/// Root mean square distance of points from a position; never 0.
double radius(const SurfaceCloud& points, const Eigen::Vector3d& place) {
  double sum = 0.0;
  for (const auto& point : points) sum += (placeOf(point).cast<double>() - place).squaredNorm();
  return std::max(std::sqrt(sum / static_cast<double>(points.size())), 1e-6);
}

/// The name of the axis along a direction, or its components if it is along none.
std::string axis(const Eigen::Vector3d& direction) {
  Eigen::Index largest;
  const Eigen::Vector3d unit = direction.normalized();
  if (unit.cwiseAbs().maxCoeff(&largest) > 0.95) return std::string(1, "xyz"[largest]);
  std::ostringstream text;
  text.precision(2);
  text << "(" << unit.x() << ", " << unit.y() << ", " << unit.z() << ")";
  return text.str();
}

}  // namespace

PoseObservability::PoseObservability(const SurfaceCloud& points) {
  const Eigen::Vector3d middle = center(points);
  const double length = radius(points, middle);
  Matrix6 information = Matrix6::Zero();
  for (const auto& point : points) {
    const Eigen::Vector3d normal = normalOf(point).cast<double>();
    const Eigen::Vector3d arm = placeOf(point).cast<double>() - middle;
    Vector6 row;
    row << arm.cross(normal) / length, normal;
    information += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(information /
                                                      static_cast<double>(points.size()));
  weakest_ = std::max(solver.eigenvalues()(0), 0.0);
  motion_ = solver.eigenvectors().col(0);
}

std::string PoseObservability::freeMotion() const {
  const Eigen::Vector3d turn = motion_.head<3>(), shift = motion_.tail<3>();
  return turn.norm() > shift.norm() ? "a turn about " + axis(turn) : "a shift along " + axis(shift);
}

namespace {

using Tree = pcl::search::KdTree<pcl::PointNormal>;
using Points = pcl::PointCloud<pcl::PointXYZ>;
using Icp = pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal, double>;

constexpr double kReachM = 0.0035;    ///< maximum mean distance of a group that lies on the model
constexpr double kNoiseM = 0.03;      ///< maximum distance of one of its points
constexpr double kBeside = 1.4;       ///< maximum distance along the surface, in spacings
constexpr double kEdge = 2.0;         ///< minimum distance of a point from an edge, in spacings
constexpr float kEvenCosine = 0.94F;  ///< of normals without an edge between them: 20 degrees
constexpr std::size_t kMinInGroup = 4;
constexpr std::size_t kMinPairs = 2000;     ///< points in all
constexpr double kMinObservability = 1e-3;  ///< of `PoseObservability::weakest` of pairs
constexpr int kSteps = 8;
constexpr double kConverged = 1e-5;  ///< a step below this ends the refinement, m and rad

/// A point of the cloud and the nearest point of the model.
struct Pair {
  Eigen::Vector3d place;
  const pcl::PointNormal* model;
  double distance_m;  ///< along the model's normal
};

using Pairs = std::vector<Pair>;

/// The points of a model that are not near an edge; computed on demand.
class EvenParts {
 public:
  EvenParts(const SurfaceCloud& model, const Tree& tree, double radius_m)
      : model_(model), tree_(tree), radius_m_(radius_m), known_(model.size()) {}

  bool contain(std::size_t index) {
    if (!known_[index]) known_[index] = isEven(model_[index]);
    return *known_[index];
  }

 private:
  bool isEven(const pcl::PointNormal& point) const {
    std::vector<int> indices;
    std::vector<float> squares;
    tree_.radiusSearch(point, radius_m_, indices, squares);
    return std::all_of(indices.begin(), indices.end(), [&](int index) {
      return normalOf(model_[index]).dot(normalOf(point)) > kEvenCosine;
    });
  }

  const SurfaceCloud& model_;
  const Tree& tree_;
  double radius_m_;
  std::vector<std::optional<bool>> known_;
};

class Refinement {
 public:
  Refinement(const SurfaceCloud& model, const Tree& tree, double spacing_m)
      : model_(model),
        tree_(tree),
        beside_m_(kBeside * spacing_m),
        even_(model, tree, kEdge * spacing_m) {}

  /// Pairs of the points that, when moved, lie on even parts of the model.
  Pairs pairs(const std::vector<Neighbors>& groups, const Eigen::Isometry3d& motion) {
    Pairs found;
    for (const Neighbors& group : groups) {
      const Pairs of_group = pairsOf(group, motion);
      double sum = 0.0;
      for (const Pair& pair : of_group) sum += pair.distance_m;
      const auto count = static_cast<double>(of_group.size());
      if (of_group.size() >= kMinInGroup && std::abs(sum) < kReachM * count)
        found.insert(found.end(), of_group.begin(), of_group.end());
    }
    return found;
  }

 private:
  Pairs pairsOf(const Neighbors& group, const Eigen::Isometry3d& motion) {
    Pairs found;
    for (const Eigen::Vector3f& point : group) {
      const auto pair = pairOf(motion * point.cast<double>());
      if (pair) found.push_back(*pair);
    }
    return found;
  }

  std::optional<Pair> pairOf(const Eigen::Vector3d& place) {
    pcl::PointNormal point;
    point.getVector3fMap() = place.cast<float>();
    if (tree_.nearestKSearch(point, 1, indices_, squares_) == 0) return std::nullopt;
    const pcl::PointNormal& nearest = model_[indices_[0]];
    const Eigen::Vector3d normal = normalOf(nearest).cast<double>();
    const Eigen::Vector3d offset = place - placeOf(nearest).cast<double>();
    const double distance_m = normal.dot(offset);
    const bool is_on_it =
        std::abs(distance_m) < kNoiseM && (offset - distance_m * normal).norm() < beside_m_;
    if (!is_on_it || !even_.contain(indices_[0])) return std::nullopt;
    return Pair{place, &nearest, distance_m};
  }

  const SurfaceCloud& model_;
  const Tree& tree_;
  double beside_m_;
  EvenParts even_;
  std::vector<int> indices_{0};
  std::vector<float> squares_{0.0F};
};

/// Returns whether pairs determine the pose of the cloud.
bool suffice(const Pairs& pairs) {
  if (pairs.size() < kMinPairs) return false;
  SurfaceCloud surface;
  for (const Pair& pair : pairs) surface.push_back(*pair.model);
  return PoseObservability(surface).weakest() > kMinObservability;
}

/// The small motion that minimizes the squared distances of the pairs: a Gauss-Newton step.
Vector6 step(const Pairs& pairs) {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (const Pair& pair : pairs) {
    const Eigen::Vector3d normal = normalOf(*pair.model).cast<double>();
    Vector6 row;
    row << pair.place.cross(normal), normal;
    information += row * row.transpose();
    gradient += pair.distance_m * row;
  }
  return -information.ldlt().solve(gradient);
}

/// The motion for a small rotation vector and a shift.
Eigen::Isometry3d motionOf(const Vector6& step) {
  const Eigen::Vector3d turn = step.head<3>();
  Eigen::Isometry3d motion(Eigen::Translation3d(step.tail<3>()));
  if (turn.norm() > 0.0) motion.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  return motion;
}

/// Moves a cloud that nearly lies on a model onto it: least squares of the distances of single
/// points from the planes through the nearest points of the model.
///
/// Means of neighbors have little noise, but lie inside convex surfaces and edges, so ICP with them
/// leaves a cloud some tenths of a millimeter off the model. Here the mean distance of neighbors
/// only decides whether they lie on it. Points near an edge are left out.
///
/// \param groups  of the cloud's points; `start` moves them into the model's frame
/// \param model   visible points with normals
/// \param tree    of the model
/// \param spacing_m  of the model's points
/// \param start   the motion that puts the cloud nearly onto the model
/// \return the motion that puts it onto the model; `start` if too little of it lies on parts
///         without edges, or if these do not constrain it in all directions
Eigen::Isometry3d refined(const std::vector<Neighbors>& groups, const SurfaceCloud& model,
                          const Tree& tree, double spacing_m, const Eigen::Isometry3d& start) {
  Refinement refinement(model, tree, spacing_m);
  Eigen::Isometry3d motion = start;
  for (int i = 0; i < kSteps; ++i) {
    const Pairs pairs = refinement.pairs(groups, motion);
    if (!suffice(pairs)) return start;
    const Vector6 change = step(pairs);
    motion = motionOf(change) * motion;
    if (change.norm() < kConverged) break;
  }
  return motion;
}

/// Round of ICP: largest distance between a point and its surface, and number of repetitions.
struct Round {
  double reach_m;
  int iterations;
};
constexpr std::array<Round, 7> kRounds{
    {{0.12, 25}, {0.06, 20}, {0.03, 20}, {0.015, 30}, {0.008, 50}, {0.005, 50}, {0.0035, 50}}};

constexpr double kSourceReach = 1.5;  ///< reach of the points given to ICP, relative to the round's
constexpr double kStillM = 1e-6;      ///< ICP ends when it moves the cloud by less

constexpr std::size_t kMinPoints = 300;        ///< 0.03 m² of the model
constexpr double kSolvable = 1e-3;             ///< minimum `PoseObservability::weakest` for ICP
constexpr double kMinFitObservability = 0.01;  ///< minimum `PoseObservability::weakest` of a fit
constexpr double kMaxResidualM = 0.006;        ///< a cloud of noise has about half of the reach
constexpr double kMaxShiftM = 0.25;            ///< a larger correction is wrong

pcl::PointNormal pointAt(const Eigen::Vector3f& place) {
  pcl::PointNormal point;
  point.getVector3fMap() = place;
  return point;
}

/// The points of a cloud within reach of a model's extent.
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

/// The means of groups of neighbors, which have less noise.
SurfaceCloud meansOf(const std::vector<Neighbors>& groups) {
  SurfaceCloud means;
  for (const Neighbors& group : groups) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f& place : group) sum += place;
    means.push_back(pointAt(sum / static_cast<float>(group.size())));
  }
  return means;
}

/// The points of a model that are paired with points of a cloud.
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

/// The points of a cloud that, when moved, lie within a distance of the model.
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

std::string millimeters(double length_m) {
  return std::to_string(std::lround(1000.0 * length_m)) + " mm";
}

void refuseFewPoints(std::size_t count) {
  if (count >= kMinPoints) return;
  throw FitRefused("only " + std::to_string(count) + " points lie on the models (at least " +
                   std::to_string(kMinPoints) +
                   " are needed); bring more of them into view, or first set the "
                   "sensor's pose by hand, closer to the true one");
}

[[noreturn]] void refuseFreeMotion(const PoseObservability& observability) {
  throw FitRefused("nothing in view holds the sensor against " + observability.freeMotion() +
                   "; bring surfaces that face other directions into view");
}

void refuseBadFit(const PoseFit& fit, const PoseObservability& observability, double shift_m) {
  if (observability.weakest() < kMinFitObservability) refuseFreeMotion(observability);
  if (fit.residual_m > kMaxResidualM || !(shift_m < kMaxShiftM))
    throw FitRefused("the cloud does not fit the models: " + millimeters(fit.residual_m) +
                     " remain after a motion of " + millimeters(shift_m) +
                     "; first set the sensor's pose by hand, closer to the true one");
}

/// Refuses a round of ICP without enough points, or whose points do not constrain the cloud.
void refuseUnsolvable(const Contact& contact) {
  refuseFewPoints(contact.surface.size());
  const PoseObservability observability(contact.surface);
  if (observability.weakest() < kSolvable) refuseFreeMotion(observability);
}

/// Point-to-plane ICP in rounds; returns the motion that puts the cloud onto the model.
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
  const std::vector<Neighbors> groups = neighborsOf(*near(cloud, surface), sensor);
  const SurfaceCloud points = meansOf(groups);
  refuseFewPoints(std::min(points.size(), surface.size()));
  auto tree = std::make_shared<Tree>();
  tree->setInputCloud(surface.makeShared());
  const Eigen::Isometry3d correction =
      refined(groups, surface, *tree, spacing_m, aligned(points, surface, tree));
  SurfaceCloud moved;
  pcl::transformPointCloud(points, moved, correction.matrix().cast<float>());
  const Contact after = contact(moved, surface, *tree, kRounds.back().reach_m);
  refuseFewPoints(after.surface.size());
  const SurfaceCloud::Ptr same = within(kRounds.back().reach_m, points, moved, *tree);
  const Contact before = contact(*same, surface, *tree, kRounds.front().reach_m);
  const PoseObservability observability(after.surface);
  PoseFit fit{correction, before.rms_m, after.rms_m, after.surface.size(), observability.weakest()};
  const Eigen::Vector3d eye = sensor.cast<double>();
  refuseBadFit(fit, observability, (correction * eye - eye).norm());
  return fit;
}

}  // namespace process_visualizer::cloud
