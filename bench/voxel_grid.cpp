// SPDX-License-Identifier: BSD-3-Clause
/// Prints the time to join and thin the cropped clouds of one to four Kinects, with VoxelGrid and
/// with pcl::VoxelGrid, for which they must be joined first. The peer gets its clouds as PCL's own
/// points, already in the right frame, and its result is not converted to a message. Fails if
/// VoxelGrid takes longer with four.
#include "process_visualizer/cloud/voxel_grid.hpp"

#include <pcl/filters/voxel_grid.h>

#include <cstdio>
#include <random>
#include <vector>

#include "beside_peer.hpp"
#include "plane_cloud.hpp"

namespace {

constexpr int kPoints = 50000;
constexpr float kVoxel = 0.005f;  // m
constexpr int kMaxSensors = 4;
constexpr double kLimit = 1.0;

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

}  // namespace

int main() {
  std::vector<Cloud::Ptr> clouds;
  std::vector<sensor_msgs::PointCloud2> messages;
  process_visualizer::cloud::VoxelGrid grid(kVoxel);
  bool is_kept = false;
  for (int sensor = 0; sensor < kMaxSensors; ++sensor) {
    clouds.push_back(anyPlane(sensor));
    messages.push_back(toMessage(*clouds.back()));
    unsigned points = 0;
    const auto join = [&] {
      grid.clear();
      for (const auto& message : messages) grid.add(message, Eigen::Isometry3d::Identity());
      points = grid.cloud({}).width;
    };
    const auto join_with_pcl = [&] {
      auto joined = pcl::make_shared<Cloud>();
      for (const auto& cloud : clouds) *joined += *cloud;
      pcl::VoxelGrid<pcl::PointXYZRGB> filter;
      filter.setInputCloud(joined);
      filter.setLeafSize(kVoxel, kVoxel, kVoxel);
      Cloud thinned;
      filter.filter(thinned);
    };
    is_kept = isWithin(kLimit, "VoxelGrid", join, "pcl::VoxelGrid", join_with_pcl);
    std::printf("%d clouds of %d points to %u\n", sensor + 1, kPoints, points);
  }
  return is_kept ? 0 : 1;
}
