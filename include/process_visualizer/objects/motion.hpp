// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Motion of an object, fitted to its latest observations: velocity, and prediction of its place.

#include <Eigen/Core>
#include <deque>

namespace process_visualizer::objects {

/// Motion model of an object, fitted to its observations of the last `kWindow` seconds: a circle in
/// the horizontal plane, constant vertical velocity, and constant yaw rate.
class Motion {
 public:
  /// \param stamp  later than those before, s
  /// \param place  m
  /// \param yaw  rad, without jumps
  void add(double stamp, const Eigen::Vector3f& place, float yaw);

  /// Displacement since the last observation, m. An object slower than 3 cm/s counts as standing,
  /// because noise alone can look as fast.
  Eigen::Vector3f displacementAt(double stamp) const;

  /// Returns whether the object has been observed for long enough to estimate its motion.
  bool hasEstimate() const;

  /// Velocity at the last observation, m/s; zero if the object stands or has no estimate yet.
  Eigen::Vector3f velocity() const;

  /// Rotation since the last observation, rad; zero if the object turned slowly or unevenly.
  float rotationAt(double stamp) const;

  static constexpr double kWindow = 0.6;    ///< s
  static constexpr double kMaxCoast = 1.0;  ///< s: after that, the prediction no longer moves

 private:
  struct Observation {
    double stamp;
    Eigen::Vector4f state;  ///< place, yaw
  };

  void fit();

  std::deque<Observation> observations_;
  Eigen::Vector3f velocity_ = Eigen::Vector3f::Zero();  ///< at the last observation, m/s
  float heading_rate_ = 0;                              ///< of the direction of motion, rad/s
  float yaw_rate_ = 0;                                  ///< rad/s
};

}  // namespace process_visualizer::objects
