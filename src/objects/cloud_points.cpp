// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/cloud_points.hpp"

#include "process_visualizer/cloud/cloud_layout.hpp"

namespace process_visualizer::objects {
namespace {

const std::uint8_t* pointAt(const sensor_msgs::PointCloud2& cloud, std::size_t index) {
  const std::size_t row = index / cloud.width, column = index % cloud.width;
  return cloud.data.data() + row * cloud.row_step + column * cloud.point_step;
}

}  // namespace

Points pointsOf(const sensor_msgs::PointCloud2& cloud) {
  const cloud::CoordinateOffsets offsets = cloud::checkedOffsets(cloud);
  Points points;
  points.width = cloud.width;
  points.height = cloud::rowsWithPoints(cloud);
  points.places.reserve(points.width * points.height);
  for (std::size_t row = 0; row < points.height; ++row) {
    const std::uint8_t* point = cloud.data.data() + row * cloud.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, point += cloud.point_step)
      points.places.push_back(cloud::positionAt(point, offsets));
  }
  return points;
}

sensor_msgs::PointCloud2 freePart(const sensor_msgs::PointCloud2& cloud,
                                  const std::vector<Label>& labels) {
  sensor_msgs::PointCloud2 part;
  part.header = cloud.header;
  part.fields = cloud.fields;
  part.point_step = cloud.point_step;
  part.is_dense = true;
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kFree) continue;
    const std::uint8_t* point = pointAt(cloud, index);
    part.data.insert(part.data.end(), point, point + cloud.point_step);
  }
  part.row_step = static_cast<std::uint32_t>(part.data.size());
  part.width = part.row_step / part.point_step;
  part.height = 1;
  return part;
}

}  // namespace process_visualizer::objects
