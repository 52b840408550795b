// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/surface.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::cloud {
namespace {

constexpr int kSides = 48;  ///< of a round shape; a tube of 10 cm is 0.1 mm beside its circle

/// The corners of a quadrilateral, anticlockwise, as two triangles.
void addFace(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
             const Eigen::Vector3f& d, Surface& surface) {
  surface.push_back({a, b, c});
  surface.push_back({a, c, d});
}

/// A point of a round shape. \param turn  from 0 to kSides about z, \param height  its z
Eigen::Vector3f onCircle(int turn, double radius, double height) {
  const double angle = 2.0 * M_PI * turn / kSides;
  return Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), height).cast<float>();
}

Surface scaled(Surface surface, const Eigen::Vector3f& size) {
  for (auto& triangle : surface)
    for (auto& corner : triangle) corner = corner.cwiseProduct(size);
  return surface;
}

/// Six times the volume that a surface encloses: below 0 if its triangles are clockwise.
double signedVolume(const Surface& surface) {
  double volume = 0.0;
  for (const auto& [a, b, c] : surface) volume += a.dot(b.cross(c));
  return volume;
}

/// Places of a sequence that fills the unit square evenly, the k-th of which is (k a, k b) mod 1
/// (M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018: the sequence R2).
class EvenSequence {
 public:
  /// The next place as weights of two edges of a triangle.
  Eigen::Vector2d next() {
    constexpr double kStepA = 0.7548776662466927, kStepB = 0.5698402909980532;
    a_ = std::fmod(a_ + kStepA, 1.0);
    b_ = std::fmod(b_ + kStepB, 1.0);
    return a_ + b_ > 1.0 ? Eigen::Vector2d(1.0 - a_, 1.0 - b_) : Eigen::Vector2d(a_, b_);
  }

 private:
  double a_ = 0.0, b_ = 0.0;
};

pcl::PointNormal pointOf(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) {
  pcl::PointNormal point;
  point.getVector3fMap() = place.cast<float>();
  point.getNormalVector3fMap() = normal.cast<float>();
  return point;
}

}  // namespace

Surface boxSurface(const Eigen::Vector3f& size) {
  Surface surface;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-0.5F, 0.5F}) {
      const Eigen::Vector3f center = side * Eigen::Vector3f::Unit(axis);
      const Eigen::Vector3f u = 0.5F * Eigen::Vector3f::Unit((axis + 1) % 3);
      const Eigen::Vector3f v = (side > 0 ? 0.5F : -0.5F) * Eigen::Vector3f::Unit((axis + 2) % 3);
      addFace(center - u - v, center + u - v, center + u + v, center - u + v, surface);
    }
  }
  return scaled(std::move(surface), size);
}

Surface cylinderSurface(const Eigen::Vector3f& size) {
  Surface surface;
  const Eigen::Vector3f top(0, 0, 0.5F), bottom(0, 0, -0.5F);
  for (int i = 0; i < kSides; ++i) {
    const Eigen::Vector3f a = onCircle(i, 0.5, -0.5), b = onCircle(i + 1, 0.5, -0.5);
    const Eigen::Vector3f c = onCircle(i + 1, 0.5, 0.5), d = onCircle(i, 0.5, 0.5);
    addFace(a, b, c, d, surface);
    surface.push_back({top, d, c});
    surface.push_back({bottom, b, a});
  }
  return scaled(std::move(surface), size);
}

Surface sphereSurface(const Eigen::Vector3f& size) {
  Surface surface;
  const auto place = [](int turn, int rise) {
    const double angle = M_PI * rise / kSides - M_PI_2;
    return onCircle(turn, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
  };
  for (int rise = 0; rise < kSides; ++rise)
    for (int turn = 0; turn < kSides; ++turn)
      addFace(place(turn, rise), place(turn + 1, rise), place(turn + 1, rise + 1),
              place(turn, rise + 1), surface);
  return scaled(std::move(surface), size);
}

void addPoints(const Surface& surface, const Eigen::Affine3d& pose, double spacing_m,
               SurfaceCloud& cloud) {
  const double outward = signedVolume(surface) * pose.linear().determinant() < 0.0 ? -1.0 : 1.0;
  EvenSequence sequence;
  double owed = 0.5;  // points, of the triangles so far
  for (const auto& triangle : surface) {
    const Eigen::Vector3d a = pose * triangle[0].cast<double>();
    const Eigen::Vector3d u = pose * triangle[1].cast<double>() - a;
    const Eigen::Vector3d v = pose * triangle[2].cast<double>() - a;
    const Eigen::Vector3d across = u.cross(v);
    if (!(across.norm() > 0.0) || !across.allFinite()) continue;
    const Eigen::Vector3d normal = outward * across.normalized();
    for (owed += across.norm() / (2.0 * spacing_m * spacing_m); owed >= 1.0; owed -= 1.0) {
      const Eigen::Vector2d weights = sequence.next();
      cloud.push_back(pointOf(a + weights.x() * u + weights.y() * v, normal));
    }
  }
}

}  // namespace process_visualizer::cloud
