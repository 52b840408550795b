// SPDX-License-Identifier: BSD-3-Clause
/// Prints the time to crop a Kinect's cloud (640 x 480 points of x, y, z, rgb), compared with
/// pcl::CropBox, which gets its cloud as PCL's own points. Fails if it takes longer.
#include "process_visualizer/cloud/roi_filter.hpp"

#include "beside_peer.hpp"
#include "plane_cloud.hpp"

int main() {
  constexpr double kLimit = 1.0;
  const auto points = planeOfKinect();
  const sensor_msgs::PointCloud2 cloud = toMessage(*points);
  const process_visualizer::cloud::Box box(kBoxCenter, kBoxSize);
  const Eigen::Isometry3d transform(Eigen::AngleAxisd(kBoxTurn, Eigen::Vector3d::UnitZ()));
  std::size_t kept = 0;
  const bool is_kept = isWithin(
      kLimit, "cropToBox", [&] { kept = cropToBox(cloud, transform, box).width; }, "pcl::CropBox",
      [&] { cropWithPcl(points); });
  std::printf("%zu of %u points kept\n", kept, cloud.width);
  return is_kept ? 0 : 1;
}
