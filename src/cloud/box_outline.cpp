// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/box_outline.hpp"

namespace process_visualizer::cloud {
namespace {

using visualization_msgs::Marker;

constexpr double kLineWidth = 0.004;  ///< m

geometry_msgs::Point toPoint(const Eigen::Vector3d& place) {
  geometry_msgs::Point point;
  point.x = place.x();
  point.y = place.y();
  point.z = place.z();
  return point;
}

/// The edges join the corners whose numbers differ in one bit.
void addEdges(Marker& outline, const Box& box) {
  const auto corners = box.corners();
  for (int begin = 0; begin < 8; ++begin) {
    for (const int bit : {1, 2, 4}) {
      if (begin & bit) continue;
      outline.points.push_back(toPoint(corners.col(begin)));
      outline.points.push_back(toPoint(corners.col(begin | bit)));
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
