// SPDX-License-Identifier: BSD-3-Clause
// Least-squares fit of an object's motion, and when it is taken to be stationary.

#include "process_visualizer/objects/motion.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kMaxObservations = 60;
constexpr std::size_t kMinObservations = 2, kMinForYawRate = 4, kMinForHeadingRate = 6;
constexpr double kMinDuration = 0.09, kMinDurationForHeadingRate = 0.3;  // s
constexpr float kMinSpeed = 0.03F;                                       // m/s
constexpr float kMinYawRate = 0.15F;                                     // rad/s
constexpr float kMaxYawResidual = 0.1F;  // rad: RMS from a constant yaw rate
constexpr float kMaxHeadingRate = 3;     // rad/s

}  // namespace

void Motion::add(double stamp, const Vector3f& place, float yaw) {
  observations_.push_back({stamp, {place.x(), place.y(), place.z(), yaw}});
  while (observations_.size() > kMaxObservations || stamp - observations_.front().stamp > kWindow)
    observations_.pop_front();
  fit();
}

/// Fits polynomials in time to the observations (least squares): of first order, and of second
/// order if there are enough of them.
void Motion::fit() {
  velocity_.setZero();
  heading_rate_ = yaw_rate_ = 0;
  const double last = observations_.back().stamp, span = last - observations_.front().stamp;
  if (!hasEstimate()) return;
  const auto count = static_cast<Eigen::Index>(observations_.size());
  Eigen::MatrixX3f powers(count, 3);
  Eigen::MatrixX4f states(count, 4);
  for (Eigen::Index row = 0; row < count; ++row) {
    const auto time = static_cast<float>(observations_[row].stamp - last);
    powers.row(row) << 1, time, time * time;
    states.row(row) = observations_[row].state.transpose();
  }
  const Eigen::MatrixX2f linear = powers.leftCols<2>();
  const Eigen::MatrixXf line = linear.colPivHouseholderQr().solve(states);
  velocity_ = line.row(1).head<3>().transpose();
  const float rms =
      ((linear * line.col(3)) - states.col(3)).norm() / std::sqrt(static_cast<float>(count));
  if (observations_.size() >= kMinForYawRate && std::abs(line(1, 3)) > kMinYawRate &&
      rms < kMaxYawResidual)
    yaw_rate_ = line(1, 3);
  if (observations_.size() < kMinForHeadingRate || span < kMinDurationForHeadingRate ||
      velocity_.norm() < kMinSpeed)
    return;
  const Eigen::MatrixXf parabola = powers.colPivHouseholderQr().solve(states);
  velocity_.head<2>() = parabola.row(1).head<2>().transpose();
  const Eigen::Vector2f speed = velocity_.head<2>(),
                        change = 2 * parabola.row(2).head<2>().transpose();
  const float square = std::max(speed.squaredNorm(), kMinSpeed * kMinSpeed);
  heading_rate_ = (speed.x() * change.y() - speed.y() * change.x()) / square;
  heading_rate_ = std::clamp(heading_rate_, -kMaxHeadingRate, kMaxHeadingRate);
}

bool Motion::hasEstimate() const {
  return observations_.size() >= kMinObservations &&
         observations_.back().stamp - observations_.front().stamp >= kMinDuration;
}

Vector3f Motion::displacementAt(double stamp) const {
  if (observations_.empty() || velocity_.norm() < kMinSpeed) return Vector3f::Zero();
  const auto passed = static_cast<float>(std::min(stamp - observations_.back().stamp, kMaxCoast));
  Vector3f displacement = velocity_ * passed;
  if (std::abs(heading_rate_) < 1e-3F) return displacement;
  const float along = std::sin(heading_rate_ * passed) / heading_rate_,
              aside = (1 - std::cos(heading_rate_ * passed)) / heading_rate_;
  displacement.x() = along * velocity_.x() - aside * velocity_.y();
  displacement.y() = along * velocity_.y() + aside * velocity_.x();
  return displacement;
}

Vector3f Motion::velocity() const {
  return velocity_.norm() < kMinSpeed ? Vector3f(Vector3f::Zero()) : velocity_;
}

float Motion::rotationAt(double stamp) const {
  if (observations_.empty()) return 0;
  return yaw_rate_ * static_cast<float>(std::min(stamp - observations_.back().stamp, kMaxCoast));
}

}  // namespace process_visualizer::objects
