// SPDX-License-Identifier: BSD-3-Clause
/// Prints how long it takes to join and thin the cropped clouds of one to four Kinects, with
/// VoxelGrid and with pcl::VoxelGrid, for which they must be joined first. The peer gets its clouds
/// as PCL's own points, in the right frame already, and its result is not made a message.
#include "process_visualizer/cloud/voxel_grid.hpp"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGB>;

constexpr int kPoints = 50000;
constexpr float kVoxel = 0.005f;  // m
constexpr int kMostSensors = 4;

/// A plane of 1 m x 0.8 m, 3 mm between pixels, with a Kinect's noise.
Cloud::Ptr anyPlane(unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<float> height(2, 0.005f);
  auto cloud = pcl::make_shared<Cloud>();
  for (int i = 0; i < kPoints; ++i)
    cloud->push_back({0.004f * static_cast<float>(i % 250) - 0.5f,
                      0.004f * static_cast<float>(i / 250) - 0.4f, height(generator), 150, 100,
                      50});
  return cloud;
}

sensor_msgs::PointCloud2 toMessage(const Cloud& points) {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> place(cloud, "x");
  for (const pcl::PointXYZRGB& point : points) {
    std::copy(point.data, point.data + 3, &place[0]);
    ++place;
  }
  return cloud;
}

double medianMilliseconds(const std::function<void()>& run) {
  std::vector<double> times;
  for (int i = 0; i < 100; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    run();
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
            .count());
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2];
}

}  // namespace

int main() {
  std::vector<Cloud::Ptr> clouds;
  std::vector<sensor_msgs::PointCloud2> messages;
  process_visualizer::cloud::VoxelGrid grid(kVoxel);
  for (int sensor = 0; sensor < kMostSensors; ++sensor) {
    clouds.push_back(anyPlane(sensor));
    messages.push_back(toMessage(*clouds.back()));
    unsigned points = 0;
    const double ours = medianMilliseconds([&] {
      grid.clear();
      for (const auto& message : messages) grid.add(message, Eigen::Isometry3d::Identity());
      points = grid.cloud({}).width;
    });
    const double peer = medianMilliseconds([&] {
      auto joined = pcl::make_shared<Cloud>();
      for (const auto& cloud : clouds) *joined += *cloud;
      pcl::VoxelGrid<pcl::PointXYZRGB> filter;
      filter.setInputCloud(joined);
      filter.setLeafSize(kVoxel, kVoxel, kVoxel);
      Cloud thinned;
      filter.filter(thinned);
    });
    std::printf("%d clouds of %d points to %u: VoxelGrid %.1f ms, pcl::VoxelGrid %.1f ms\n",
                sensor + 1, kPoints, points, ours, peer);
  }
}
