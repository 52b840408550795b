// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <deque>

namespace process_visualizer::objects {

/// How an object moves on: on a circle in the plane, evenly upwards or downwards, and turning
/// evenly, as it did in the last `kWindow` seconds in which it was seen.
class Motion {
 public:
  /// \param stamp  later than those before, s
  /// \param place  m
  /// \param yaw  rad, without jumps
  void add(double stamp, const Eigen::Vector3f& place, float yaw);

  /// By how much it has moved since it was seen last, m. What is slower than 3 cm/s stands: that is
  /// less than what noise may look like.
  Eigen::Vector3f shiftAt(double stamp) const;

  /// How fast it moved when it was seen last, m/s; nothing where it stands, or is seen too shortly.
  Eigen::Vector3f velocity() const;

  /// By how much it has turned since then, rad; nothing if it turned slowly or unevenly.
  float turnAt(double stamp) const;

  static constexpr double kWindow = 0.6;        ///< s
  static constexpr double kLongestCoast = 1.0;  ///< s: then it is thought to stand

 private:
  struct Sight {
    double stamp;
    Eigen::Vector4f state;  ///< place, yaw
  };

  void fit();

  std::deque<Sight> sights_;
  Eigen::Vector3f velocity_ = Eigen::Vector3f::Zero();  ///< m/s, at the last sight
  float bend_ = 0;                                      ///< of the direction, rad/s
  float turn_ = 0;                                      ///< of the yaw, rad/s
};

}  // namespace process_visualizer::objects
