// SPDX-License-Identifier: BSD-3-Clause
/// A Kinect's cloud of a plane, as PCL's points and as a message, and PCL's crop.
#pragma once

#include <pcl/filters/crop_box.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Geometry>
#include <algorithm>

using Cloud = pcl::PointCloud<pcl::PointXYZRGB>;

inline const Eigen::Vector3d kBoxCenter{0, 0, 2}, kBoxSize{1.0, 0.8, 1.0};  ///< m
constexpr double kBoxTurn = 0.1;                                            ///< about z, rad

/// 2 m in front of the camera, 640 x 480 points.
inline Cloud::Ptr planeOfKinect() {
  auto cloud = pcl::make_shared<Cloud>();
  for (int row = 0; row < 480; ++row)
    for (int column = 0; column < 640; ++column)
      cloud->push_back({2 * (static_cast<float>(column) - 319.5f) / 525,
                        2 * (static_cast<float>(row) - 239.5f) / 525, 2, 150, 100, 50});
  return cloud;
}

/// In 32 bytes per point, as depth_image_proc publishes it.
inline sensor_msgs::PointCloud2 toMessage(const Cloud& points) {
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

/// Returns the points in the box, which is turned as above.
inline Cloud cropWithPcl(const Cloud::ConstPtr& points) {
  pcl::CropBox<pcl::PointXYZRGB> filter;
  filter.setInputCloud(points);
  filter.setTransform(
      Eigen::Affine3f(Eigen::AngleAxisf(static_cast<float>(kBoxTurn), Eigen::Vector3f::UnitZ())));
  const Eigen::Vector3f center = kBoxCenter.cast<float>(), half = 0.5f * kBoxSize.cast<float>();
  filter.setMin((center - half).homogeneous());
  filter.setMax((center + half).homogeneous());
  Cloud cropped;
  filter.filter(cropped);
  return cropped;
}
