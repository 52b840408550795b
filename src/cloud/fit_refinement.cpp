// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/fit_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "process_visualizer/cloud/determination.hpp"

namespace process_visualizer::cloud {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Tree = pcl::search::KdTree<pcl::PointNormal>;

constexpr double kReachM = 0.0035;    ///< mean distance of a group that lies on the model
constexpr double kNoiseM = 0.03;      ///< distance of a point of it
constexpr double kBeside = 1.4;       ///< spacings, along the surface: farther is beyond its rim
constexpr double kEdge = 2.0;         ///< spacings from an edge that a point must have to count
constexpr float kEvenCosine = 0.94F;  ///< of normals without an edge between them: 20 degrees
constexpr std::size_t kFewestInGroup = 4;
constexpr std::size_t kFewest = 2000;  ///< points in all
constexpr double kHeld = 1e-3;         ///< `Determination::weakest` of pairs that suffice
constexpr int kSteps = 8;
constexpr double kStill = 1e-5;  ///< m and rad

/// A point of the cloud, and the point of the model next to it.
struct Pair {
  Eigen::Vector3d place;
  const pcl::PointNormal* model;
  double distance_m;  ///< along the model's normal
};

using Pairs = std::vector<Pair>;

/// The points of a model around which it has no edge; found when they are asked for.
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

  /// Pairs of the points that lie on even parts of the model when they are moved.
  Pairs pairs(const std::vector<Neighbours>& groups, const Eigen::Isometry3d& motion) {
    Pairs found;
    for (const Neighbours& group : groups) {
      const Pairs of_group = pairsOf(group, motion);
      double sum = 0.0;
      for (const Pair& pair : of_group) sum += pair.distance_m;
      const auto count = static_cast<double>(of_group.size());
      if (of_group.size() >= kFewestInGroup && std::abs(sum) < kReachM * count)
        found.insert(found.end(), of_group.begin(), of_group.end());
    }
    return found;
  }

 private:
  Pairs pairsOf(const Neighbours& group, const Eigen::Isometry3d& motion) {
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

/// Whether pairs are enough to say where the cloud has to be.
bool suffice(const Pairs& pairs) {
  if (pairs.size() < kFewest) return false;
  SurfaceCloud surface;
  for (const Pair& pair : pairs) surface.push_back(*pair.model);
  return Determination(surface).weakest() > kHeld;
}

/// The small motion that makes the squares of the pairs' distances least: a Gauss-Newton step.
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

/// The motion of a small turn vector and a shift.
Eigen::Isometry3d motionOf(const Vector6& step) {
  const Eigen::Vector3d turn = step.head<3>();
  Eigen::Isometry3d motion(Eigen::Translation3d(step.tail<3>()));
  if (turn.norm() > 0.0) motion.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  return motion;
}

}  // namespace

Eigen::Isometry3d refined(const std::vector<Neighbours>& groups, const SurfaceCloud& model,
                          const Tree& tree, double spacing_m, const Eigen::Isometry3d& start) {
  Refinement refinement(model, tree, spacing_m);
  Eigen::Isometry3d motion = start;
  for (int i = 0; i < kSteps; ++i) {
    const Pairs pairs = refinement.pairs(groups, motion);
    if (!suffice(pairs)) return start;
    const Vector6 change = step(pairs);
    motion = motionOf(change) * motion;
    if (change.norm() < kStill) break;
  }
  return motion;
}

}  // namespace process_visualizer::cloud
