// SPDX-License-Identifier: BSD-3-Clause
/// Prints how long the crop of a Kinect's cloud (640 x 480 points of x, y, z, rgb) takes.
#include "process_visualizer/cloud/roi_filter.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

namespace {

/// A plane 2 m in front of the camera, in 32 bytes per point as depth_image_proc publishes it.
sensor_msgs::PointCloud2 kinectCloud() {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(640 * 480);
  sensor_msgs::PointCloud2Iterator<float> point(cloud, "x");
  for (int row = 0; row < 480; ++row) {
    for (int column = 0; column < 640; ++column, ++point) {
      point[0] = (column - 319.5f) / 525 * 2;
      point[1] = (row - 239.5f) / 525 * 2;
      point[2] = 2;
    }
  }
  return cloud;
}

double medianMilliseconds(std::vector<double>& times) {
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2] * 1e3;
}

}  // namespace

int main() {
  using Clock = std::chrono::steady_clock;
  const auto cloud = kinectCloud();
  const process_visualizer::cloud::Box box({0, 0, 2}, {1.0, 0.8, 1.0});
  const Eigen::Isometry3d transform(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  std::vector<double> times;
  std::size_t kept = 0;
  for (int i = 0; i < 500; ++i) {
    const auto start = Clock::now();
    kept = cropToBox(cloud, transform, box).width;
    times.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  std::printf("%u points, %zu kept: median %.2f ms\n", cloud.width, kept,
              medianMilliseconds(times));
}
