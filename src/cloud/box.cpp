// SPDX-License-Identifier: BSD-3-Clause
// Checks a box's center and size; its corners, and its outline as a marker.

#include "process_visualizer/cloud/box.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {

Box::Box(const Eigen::Vector3d& center, const Eigen::Vector3d& size)
    : center_(center), size_(size) {
  require(center.allFinite(), "center must be three finite numbers");
  require(size.allFinite() && (size.array() > 0).all(),
          "size must be three finite numbers greater than zero");
}

Eigen::Matrix<double, 3, 8> Box::corners() const {
  Eigen::Matrix<double, 3, 8> corners;
  for (int number = 0; number < 8; ++number) {
    const auto side = [number](int bit) { return (number & bit) != 0 ? 1.0 : -1.0; };
    corners.col(number) =
        center_ + Eigen::Vector3d(side(1), side(2), side(4)).cwiseProduct(halfExtents());
  }
  return corners;
}

namespace {

using visualization_msgs::Marker;

constexpr double kLineWidth = 0.004;  ///< m

/// Edges join the corners whose numbers differ in one bit.
void addEdges(Marker& outline, const Box& box) {
  const auto corners = box.corners();
  for (int begin = 0; begin < 8; ++begin) {
    for (const int bit : {1, 2, 4}) {
      if (begin & bit) continue;
      for (const int number : {begin, begin | bit})
        outline.points.push_back(tf2::toMsg(Eigen::Vector3d(corners.col(number))));
    }
  }
}

}  // namespace

Marker outlineOf(const Box& box, const std::string& frame) {
  Marker outline;
  outline.header.frame_id = frame;
  outline.ns = "roi";
  outline.type = Marker::LINE_LIST;
  outline.action = Marker::ADD;
  outline.pose.orientation.w = 1;
  outline.scale.x = kLineWidth;
  outline.color.r = outline.color.g = outline.color.b = 0.8f;
  outline.color.a = 0.6f;
  outline.frame_locked = true;
  addEdges(outline, box);
  return outline;
}

}  // namespace process_visualizer::cloud
