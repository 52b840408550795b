// SPDX-License-Identifier: BSD-3-Clause
/// Prints how long one pass over a Kinect's images (640 x 480) takes, and how far its points of a
/// known plane are from that plane, without any node.
#include "process_visualizer/cloud/registered_crop.hpp"

#include <sensor_msgs/distortion_models.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>

#include "../test/cpp/plane_images.hpp"
#include "kinect_images.hpp"

namespace {

constexpr int kRounds = 1000;

sensor_msgs::CameraInfo cameraInfo(double distortion) {
  sensor_msgs::CameraInfo info;
  info.width = kWidth;
  info.height = kHeight;
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0);
  info.D[0] = distortion;
  info.K = {525, 0, 319.5, 0, 525, 239.5, 0, 0, 1};
  info.P = {525, 0, 319.5, 0, 0, 525, 239.5, 0, 0, 0, 1, 0};
  return info;
}

double share(std::vector<double>& times_ms, double part) {
  const auto place = times_ms.begin() + static_cast<std::ptrdiff_t>(part * (times_ms.size() - 1));
  std::nth_element(times_ms.begin(), place, times_ms.end());
  return *place;
}

void measure(const char* name, const sensor_msgs::CameraInfo& info) {
  using Clock = std::chrono::steady_clock;
  using process_visualizer::cloud::Lens;
  const auto depth = depthImage(), color = image("rgb8", 3);
  const process_visualizer::cloud::Box box({0, 0, 2}, {1.0, 0.8, 1.0});
  const Eigen::Isometry3d transform(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  process_visualizer::cloud::RegisteredCrop filter(Lens::kDistorts);
  std::vector<double> times_ms;
  std::size_t kept = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto begin = Clock::now();
    kept = filter.crop(depth, color, info, transform, box).width;
    times_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
  }
  const double first_ms = times_ms.front();
  std::printf("%-22s %u points, %zu kept: median %.2f ms, p99 %.2f ms, the first one %.1f ms\n",
              name, kWidth * kHeight, kept, share(times_ms, 0.5), share(times_ms, 0.99), first_ms);
}

void measurePlane(double distance, bool distorts, bool is_kinect) {
  using namespace process_visualizer::cloud;
  const Plane plane = planeAt(distance, 0.35);
  const CameraImages images = imagesOf(plane, distorts, is_kinect);
  const auto cloud = RegisteredCrop(Lens::kDistorts)
                         .crop(images.depth, images.color, images.info,
                               Eigen::Isometry3d::Identity(), Box({0, 0, 0}, {100, 100, 100}));
  std::printf("plane at %.1f m, tilted 20 degrees, %s, %s: %u points, %.2f mm RMS from it\n",
              distance, distorts ? "with a lens" : "without lens",
              is_kinect ? "Kinect" : "whole mm", cloud.width, 1000 * rmsFrom(plane, cloud));
}

}  // namespace

int main() {
  measure("without distortion:", cameraInfo(0));
  measure("with distortion:", cameraInfo(-0.25));
  for (const bool is_kinect : {false, true})
    for (const bool distorts : {false, true})
      for (const double distance : {0.8, 1.0, 1.2, 2.0})
        measurePlane(distance, distorts, is_kinect);
}
