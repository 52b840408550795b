// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/colored_cloud.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

namespace process_visualizer::cloud {

sensor_msgs::PointCloud2 makeColoredCloud(const std_msgs::Header& header,
                                          const std::vector<std::uint8_t>& points) {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier(cloud).setPointCloud2FieldsByString(2, "xyz", "rgb");
  cloud.header = header;
  cloud.is_dense = true;
  cloud.data = points;
  cloud.row_step = cloud.data.size();
  cloud.width = cloud.row_step / cloud.point_step;
  cloud.height = 1;
  return cloud;
}

}  // namespace process_visualizer::cloud
