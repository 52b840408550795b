// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/motion.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kMostSights = 60;
constexpr std::size_t kFewestSights = 2, kFewestForTurn = 4, kFewestForBend = 6;
constexpr double kShortest = 0.09, kShortestForBend = 0.3;  // s
constexpr float kSlowest = 0.03F;                           // m/s
constexpr float kSlowestTurn = 0.15F;                       // rad/s
constexpr float kUneven = 0.1F;                             // rad: RMS beside an even turn
constexpr float kSharpestBend = 3;                          // rad/s

}  // namespace

void Motion::add(double stamp, const Vector3f& place, float yaw) {
  sights_.push_back({stamp, {place.x(), place.y(), place.z(), yaw}});
  while (sights_.size() > kMostSights || stamp - sights_.front().stamp > kWindow)
    sights_.pop_front();
  fit();
}

/// Fits polynomials to what was seen (least squares): of first order in time, and of second order
/// if there is enough of it.
void Motion::fit() {
  velocity_.setZero();
  bend_ = turn_ = 0;
  const double last = sights_.back().stamp, span = last - sights_.front().stamp;
  if (sights_.size() < kFewestSights || span < kShortest) return;
  const auto count = static_cast<Eigen::Index>(sights_.size());
  Eigen::MatrixX3f powers(count, 3);
  Eigen::MatrixX4f states(count, 4);
  for (Eigen::Index row = 0; row < count; ++row) {
    const auto time = static_cast<float>(sights_[row].stamp - last);
    powers.row(row) << 1, time, time * time;
    states.row(row) = sights_[row].state.transpose();
  }
  const Eigen::MatrixX2f linear = powers.leftCols<2>();
  const Eigen::MatrixXf even = linear.colPivHouseholderQr().solve(states);
  velocity_ = even.row(1).head<3>().transpose();
  const float rms =
      ((linear * even.col(3)) - states.col(3)).norm() / std::sqrt(static_cast<float>(count));
  if (sights_.size() >= kFewestForTurn && std::abs(even(1, 3)) > kSlowestTurn && rms < kUneven)
    turn_ = even(1, 3);
  if (sights_.size() < kFewestForBend || span < kShortestForBend || velocity_.norm() < kSlowest)
    return;
  const Eigen::MatrixXf bent = powers.colPivHouseholderQr().solve(states);
  velocity_.head<2>() = bent.row(1).head<2>().transpose();
  const Eigen::Vector2f speed = velocity_.head<2>(), change = 2 * bent.row(2).head<2>().transpose();
  const float square = std::max(speed.squaredNorm(), kSlowest * kSlowest);
  bend_ = (speed.x() * change.y() - speed.y() * change.x()) / square;
  bend_ = std::clamp(bend_, -kSharpestBend, kSharpestBend);
}

Vector3f Motion::shiftAt(double stamp) const {
  if (sights_.empty() || velocity_.norm() < kSlowest) return Vector3f::Zero();
  const auto passed = static_cast<float>(std::min(stamp - sights_.back().stamp, kLongestCoast));
  Vector3f shift = velocity_ * passed;
  if (std::abs(bend_) < 1e-3F) return shift;
  const float along = std::sin(bend_ * passed) / bend_,
              aside = (1 - std::cos(bend_ * passed)) / bend_;
  shift.x() = along * velocity_.x() - aside * velocity_.y();
  shift.y() = along * velocity_.y() + aside * velocity_.x();
  return shift;
}

Vector3f Motion::velocity() const {
  return velocity_.norm() < kSlowest ? Vector3f(Vector3f::Zero()) : velocity_;
}

float Motion::turnAt(double stamp) const {
  if (sights_.empty()) return 0;
  return turn_ * static_cast<float>(std::min(stamp - sights_.back().stamp, kLongestCoast));
}

}  // namespace process_visualizer::objects
