// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/determination.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace process_visualizer::cloud {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Vector3d center(const SurfaceCloud& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += placeOf(point).cast<double>();
  return sum / static_cast<double>(points.size());
}

/// Root of the mean squared distance of points from a place; never 0.
double radius(const SurfaceCloud& points, const Eigen::Vector3d& place) {
  double sum = 0.0;
  for (const auto& point : points) sum += (placeOf(point).cast<double>() - place).squaredNorm();
  return std::max(std::sqrt(sum / static_cast<double>(points.size())), 1e-6);
}

/// A direction as an axis, or its components if it is none.
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

Determination::Determination(const SurfaceCloud& points) {
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

std::string Determination::freeMotion() const {
  const Eigen::Vector3d turn = motion_.head<3>(), shift = motion_.tail<3>();
  return turn.norm() > shift.norm() ? "a turn about " + axis(turn) : "a shift along " + axis(shift);
}

}  // namespace process_visualizer::cloud
