// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/roi_filter.hpp"

#include <sensor_msgs/PointField.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {
namespace {

/// Neighbouring bytes of points that are all kept.
struct Run {
  const std::uint8_t* begin;
  const std::uint8_t* end;
};

/// Where the coordinates lie within a point, in bytes.
struct Offsets {
  std::size_t x, y, z;
};

std::size_t coordinateOffset(const sensor_msgs::PointCloud2& cloud, const std::string& name) {
  const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                  [&](const auto& candidate) { return candidate.name == name; });
  require(field != cloud.fields.end(), "the cloud has no field '" + name + "'");
  require(field->datatype == sensor_msgs::PointField::FLOAT32,
          "field '" + name + "' is not of type FLOAT32");
  require(std::size_t{field->offset} + sizeof(float) <= cloud.point_step,
          "field '" + name + "' ends behind its point: offset " + std::to_string(field->offset) +
              ", point_step " + std::to_string(cloud.point_step));
  return field->offset;
}

/// Checks the layout, so that every byte that is read later on exists.
Offsets checkLayout(const sensor_msgs::PointCloud2& cloud) {
  require(!cloud.is_bigendian, "the cloud is big-endian, only little-endian clouds are supported");
  const Offsets offsets{coordinateOffset(cloud, "x"), coordinateOffset(cloud, "y"),
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

float readFloat(const std::uint8_t* bytes) {
  float value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// Tells whether a point lies in the box, for the bytes of a point.
class InsideTest {
 public:
  InsideTest(InsideBox is_inside, const Offsets& offsets)
      : is_inside_(std::move(is_inside)), offsets_(offsets) {}

  bool operator()(const std::uint8_t* point) const {
    return is_inside_({readFloat(point + offsets_.x), readFloat(point + offsets_.y),
                       readFloat(point + offsets_.z)});
  }

 private:
  InsideBox is_inside_;
  Offsets offsets_;
};

/// Finds the runs of kept points in one row.
void findRuns(const std::uint8_t* row, const std::uint8_t* row_end, std::size_t point_step,
              const InsideTest& is_inside, std::vector<Run>& runs) {
  const std::uint8_t* begin = nullptr;
  for (const std::uint8_t* point = row; point != row_end; point += point_step) {
    if (is_inside(point)) {
      if (!begin) begin = point;
    } else if (begin) {
      runs.push_back({begin, point});
      begin = nullptr;
    }
  }
  if (begin) runs.push_back({begin, row_end});
}

std::vector<Run> findRuns(const sensor_msgs::PointCloud2& cloud, const InsideTest& is_inside) {
  std::vector<Run> runs;
  if (cloud.width == 0) return runs;  // such rows need no data, so there may be any number
  for (std::size_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* begin = cloud.data.data() + row * cloud.row_step;
    findRuns(begin, begin + std::size_t{cloud.width} * cloud.point_step, cloud.point_step,
             is_inside, runs);
  }
  return runs;
}

std::vector<std::uint8_t> copyRuns(const std::vector<Run>& runs) {
  std::size_t size = 0;
  for (const Run& run : runs) size += run.end - run.begin;
  std::vector<std::uint8_t> data;
  data.reserve(size);
  for (const Run& run : runs) data.insert(data.end(), run.begin, run.end);
  return data;
}

}  // namespace

sensor_msgs::PointCloud2 cropToBox(const sensor_msgs::PointCloud2& cloud,
                                   const Eigen::Isometry3d& box_from_cloud, const Box& box) {
  const InsideTest is_inside(InsideBox(box_from_cloud, box), checkLayout(cloud));
  sensor_msgs::PointCloud2 cropped;
  cropped.header = cloud.header;
  cropped.fields = cloud.fields;
  cropped.is_bigendian = false;
  cropped.is_dense = true;
  cropped.point_step = cloud.point_step;
  cropped.data = copyRuns(findRuns(cloud, is_inside));
  cropped.row_step = cropped.data.size();
  cropped.width = cropped.row_step / cropped.point_step;
  cropped.height = 1;
  return cropped;
}

}  // namespace process_visualizer::cloud
