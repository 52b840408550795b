// SPDX-License-Identifier: BSD-3-Clause
/// Prints the time of one pass over a Kinect's images (640 x 480), compared with pcl::CropBox
/// alone, which gets the cloud of these images as PCL's own points; and the distance of its points
/// of a known plane from that plane. Uses no node. Fails if it takes longer than the peer, or with
/// distortion 1.5 times as long: the peer knows of no lens.
#include "process_visualizer/cloud/registered_crop.hpp"

#include <cstdio>
#include <vector>

#include "../test/cpp/plane_images.hpp"
#include "beside_peer.hpp"
#include "kinect_images.hpp"
#include "plane_cloud.hpp"

namespace {

constexpr int kRounds = 1000;

bool measure(const char* name, const sensor_msgs::CameraInfo& info, double limit) {
  using process_visualizer::cloud::Lens;
  const auto depth = depthImage(), color = image("rgb8", 3);
  const process_visualizer::cloud::Box box(kBoxCenter, kBoxSize);
  const Eigen::Isometry3d transform(Eigen::AngleAxisd(kBoxTurn, Eigen::Vector3d::UnitZ()));
  process_visualizer::cloud::RegisteredCrop filter(Lens::kDistorts);
  std::size_t kept = 0;
  const auto crop = [&] { kept = filter.crop(depth, color, info, transform, box).width; };
  const double first_ms = milliseconds(crop);
  std::vector<double> times_ms;
  for (int round = 0; round < kRounds; ++round) times_ms.push_back(milliseconds(crop));
  std::printf("%-22s %u points, %zu kept: median %.2f ms, p99 %.2f ms, the first one %.1f ms\n",
              name, kWidth * kHeight, kept, share(times_ms, 0.5), share(times_ms, 0.99), first_ms);
  const auto points = planeOfKinect();
  return isWithin(limit, "RegisteredCrop", crop, "pcl::CropBox", [&] { cropWithPcl(points); });
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
  const bool is_kept = measure("without distortion:", cameraInfo(0), 1.0);
  const bool is_kept_with_lens = measure("with distortion:", cameraInfo(-0.25), 1.5);
  for (const bool is_kinect : {false, true})
    for (const bool distorts : {false, true})
      for (const double distance : {0.8, 1.0, 1.2, 2.0})
        measurePlane(distance, distorts, is_kinect);
  return is_kept && is_kept_with_lens ? 0 : 1;
}
