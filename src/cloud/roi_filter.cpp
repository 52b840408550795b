// SPDX-License-Identifier: BSD-3-Clause
// Copies the runs of consecutive points that lie in the box.

#include "process_visualizer/cloud/roi_filter.hpp"

#include <cstdint>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/cloud_layout.hpp"

namespace process_visualizer::cloud {
namespace {

/// Contiguous bytes of points that are all kept.
struct Run {
  const std::uint8_t* begin;
  const std::uint8_t* end;
};

/// Tests the bytes of a point for lying in the box.
class InsideTest {
 public:
  InsideTest(InsideBox is_inside, const CoordinateOffsets& offsets)
      : is_inside_(std::move(is_inside)), offsets_(offsets) {}

  bool operator()(const std::uint8_t* point) const {
    return is_inside_(positionAt(point, offsets_));
  }

 private:
  InsideBox is_inside_;
  CoordinateOffsets offsets_;
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
  for (std::size_t row = 0, rows = rowsWithPoints(cloud); row < rows; ++row) {
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
  const InsideTest is_inside(InsideBox(box_from_cloud, box), checkedOffsets(cloud));
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
