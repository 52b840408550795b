// SPDX-License-Identifier: BSD-3-Clause
// Checks the fields and sizes claimed by a cloud; creates colored clouds.

#include "process_visualizer/cloud/cloud_layout.hpp"

#include <sensor_msgs/PointField.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <string>

#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr std::size_t kFieldSize = 4;  ///< of a coordinate or a color

bool isWithinPoint(const PointField& field, const PointCloud2& cloud) {
  return std::size_t{field.offset} + kFieldSize <= cloud.point_step;
}

std::size_t coordinateOffset(const PointCloud2& cloud, const std::string& name) {
  const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                  [&](const auto& candidate) { return candidate.name == name; });
  require(field != cloud.fields.end(), "the cloud has no field '" + name + "'");
  require(field->datatype == PointField::FLOAT32, "field '" + name + "' is not of type FLOAT32");
  require(isWithinPoint(*field, cloud), "field '" + name + "' ends beyond its point: offset " +
                                            std::to_string(field->offset) + ", point_step " +
                                            std::to_string(cloud.point_step));
  return field->offset;
}

}  // namespace

CoordinateOffsets checkedOffsets(const PointCloud2& cloud) {
  require(!cloud.is_bigendian, "the cloud is big-endian; only little-endian clouds are supported");
  const CoordinateOffsets offsets{coordinateOffset(cloud, "x"), coordinateOffset(cloud, "y"),
                                  coordinateOffset(cloud, "z")};
  const std::uint64_t row_size = std::uint64_t{cloud.width} * cloud.point_step;
  require(cloud.row_step >= row_size,
          "row_step " + std::to_string(cloud.row_step) +
              " is less than width * point_step = " + std::to_string(row_size));
  const std::uint64_t data_size = std::uint64_t{cloud.row_step} * cloud.height;
  require(cloud.data.size() >= data_size,
          "the cloud's data is cut off: " + std::to_string(cloud.data.size()) + " bytes of " +
              std::to_string(data_size));
  return offsets;
}

std::size_t rowsWithPoints(const PointCloud2& cloud) { return cloud.width == 0 ? 0 : cloud.height; }

std::optional<std::size_t> colorOffset(const PointCloud2& cloud) {
  for (const PointField& field : cloud.fields) {
    const bool has_size = field.datatype == PointField::FLOAT32 ||
                          field.datatype == PointField::UINT32 ||
                          field.datatype == PointField::INT32;
    if ((field.name == "rgb" || field.name == "rgba") && has_size && isWithinPoint(field, cloud))
      return field.offset;
  }
  return std::nullopt;
}

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
