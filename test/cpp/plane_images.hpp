// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "camera_images.hpp"

namespace process_visualizer::cloud {

using Plane = Eigen::Hyperplane<double, 3>;

/// A plane at a distance in front of the camera (m), tilted by an angle (rad) about (1, 1, 0).
inline Plane planeAt(double distance, double tilt) {
  const Eigen::AngleAxisd turn(tilt, Eigen::Vector3d(1, 1, 0).normalized());
  return {turn * Eigen::Vector3d::UnitZ(), Eigen::Vector3d(0, 0, distance)};
}

/// Projects a direction (x/z, y/z) through a lens, px, by the formulas of the ROS camera model.
inline Eigen::Vector2d seenAt(const sensor_msgs::CameraInfo& info, const Eigen::Vector2d& place) {
  const double a = place.x(), b = place.y(), r2 = place.squaredNorm();
  const double radial = 1 + info.D[0] * r2 + info.D[1] * r2 * r2 + info.D[4] * r2 * r2 * r2;
  const double seen_a = a * radial + 2 * info.D[2] * a * b + info.D[3] * (r2 + 2 * a * a);
  const double seen_b = b * radial + info.D[2] * (r2 + 2 * b * b) + 2 * info.D[3] * a * b;
  return {info.K[0] * seen_a + info.K[2], info.K[4] * seen_b + info.K[5]};
}

/// The direction (x/z, y/z) that a pixel shows, by fixed-point iteration.
inline Eigen::Vector2d directionOf(const sensor_msgs::CameraInfo& info, const Eigen::Vector2d& px) {
  const Eigen::Vector2d focal(info.K[0], info.K[4]);
  Eigen::Vector2d place(0, 0), away = px - seenAt(info, place);
  for (int round = 0; round < 100 && away.norm() > 1e-6; ++round) {
    place += away.cwiseQuotient(focal);
    away = px - seenAt(info, place);
  }
  return place;
}

/// A depth of a Kinect: a step of its disparity is 2.87 mm at 1 m (Khoshelham and Elberink 2012),
/// with noise of 0.35 steps (standard deviation).
inline double asKinect(double depth, std::mt19937& random) {
  return 348 / std::round(348 / depth + std::normal_distribution<double>(0, 0.35)(random));
}

/// Depth image of a plane by a camera of 640x480 px: 16UC1, in whole mm.
/// \param distorts  it has a lens with distortion
/// \param is_kinect  its depths have a Kinect's steps and noise
inline CameraImages imagesOf(const Plane& plane, bool distorts, bool is_kinect) {
  CameraImages images{makeImage("16UC1", 640, 480), makeImage("rgb8", 640, 480),
                      makeInfo(640, 480)};
  if (distorts) images.info.D = {-0.28, 0.07, 0.0011, -0.0007, 0.01};
  std::mt19937 random(1);
  for (std::uint32_t row = 0; row < 480; ++row) {
    for (std::uint32_t column = 0; column < 640; ++column) {
      const Eigen::Vector3d ray = directionOf(images.info, {column, row}).homogeneous();
      const double depth = -plane.offset() / plane.normal().dot(ray);
      const double measured = is_kinect ? asKinect(depth, random) : depth;
      setDepth(images.depth, column, row, static_cast<std::uint16_t>(std::lround(1000 * measured)));
    }
  }
  return images;
}

/// Root mean square of the points' distances from a plane, m.
inline double rmsFrom(const Plane& plane, const sensor_msgs::PointCloud2& cloud) {
  double sum = 0;
  for (sensor_msgs::PointCloud2ConstIterator<float> point(cloud, "x"); point != point.end();
       ++point)
    sum += std::pow(plane.signedDistance(Eigen::Vector3d(point[0], point[1], point[2])), 2);
  return std::sqrt(sum / cloud.width);
}

}  // namespace process_visualizer::cloud
