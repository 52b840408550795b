// SPDX-License-Identifier: BSD-3-Clause
// Hash table of cubes: sums of the positions and colors of their points.

#include "process_visualizer/cloud/voxel_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "process_visualizer/cloud/cloud_layout.hpp"
#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::PointCloud2;

constexpr std::size_t kFirstSlots = 1 << 12;
constexpr int kBits = 21;  ///< of a cube's coordinate along an axis
constexpr float kReach = 1 << (kBits - 1);
constexpr std::uint8_t kGray[] = {200, 200, 200};

/// The number of the cube at integer coordinates of `kBits` bits each.
std::uint64_t keyOf(const Eigen::Vector3f& place) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = key << kBits | static_cast<std::uint64_t>(place[axis] + kReach);
  return key;
}

std::uint8_t mean(std::uint32_t sum, std::uint32_t count) { return (sum + count / 2) / count; }

}  // namespace

VoxelGrid::VoxelGrid(double edge)
    : cubes_per_meter_(static_cast<float>(1 / edge)), slots_(kFirstSlots) {
  require(std::isfinite(edge) && edge > 0 && std::isfinite(cubes_per_meter_),
          "the voxels' edge must be a finite number greater than zero");
}

void VoxelGrid::clear() {
  cubes_.clear();
  std::fill(slots_.begin(), slots_.end(), 0);
}

void VoxelGrid::add(const PointCloud2& cloud, const Eigen::Isometry3d& grid_from_cloud) {
  const CoordinateOffsets offsets = checkedOffsets(cloud);
  const std::optional<std::size_t> color = colorOffset(cloud);
  const Eigen::Isometry3f transform = grid_from_cloud.cast<float>();
  for (std::size_t row = 0, rows = rowsWithPoints(cloud); row < rows; ++row) {
    const std::uint8_t* point = cloud.data.data() + row * cloud.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, point += cloud.point_step)
      addPoint(transform * positionAt(point, offsets), color ? point + *color : kGray);
  }
}

void VoxelGrid::addPoint(const Eigen::Vector3f& position, const std::uint8_t* blue_green_red) {
  const Eigen::Vector3f place = (position * cubes_per_meter_).array().floor();
  if (!(place.cwiseAbs().maxCoeff() < kReach) || !place.allFinite()) return;
  Cube& cube = cubeAt(keyOf(place));
  cube.position_sum += position;
  cube.blue_sum += blue_green_red[0];
  cube.green_sum += blue_green_red[1];
  cube.red_sum += blue_green_red[2];
  ++cube.count;
}

VoxelGrid::Cube& VoxelGrid::cubeAt(std::uint64_t key) {
  std::size_t slot = slotOf(key);
  if (slots_[slot] == 0) {
    if (2 * cubes_.size() >= slots_.size()) {
      grow();
      slot = slotOf(key);
    }
    cubes_.push_back({key, Eigen::Vector3f::Zero(), 0, 0, 0, 0});
    slots_[slot] = static_cast<std::uint32_t>(cubes_.size());
  }
  return cubes_[slots_[slot] - 1];
}

/// Returns the slot of a cube in the table, or the free one for it. The multiplication with the
/// golden ratio scatters neighbors (Knuth, The Art of Computer Programming 3, 6.4).
std::size_t VoxelGrid::slotOf(std::uint64_t key) const {
  constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15;
  constexpr int kUpperHalf = 32;
  std::size_t slot = (key * kGoldenRatio >> kUpperHalf) & (slots_.size() - 1);
  while (slots_[slot] != 0 && cubes_[slots_[slot] - 1].key != key)
    slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

void VoxelGrid::grow() {
  slots_.assign(2 * slots_.size(), 0);
  for (std::size_t number = 0; number < cubes_.size(); ++number)
    slots_[slotOf(cubes_[number].key)] = static_cast<std::uint32_t>(number + 1);
}

PointCloud2 VoxelGrid::cloud(const std_msgs::Header& header) const {
  std::vector<std::uint8_t> points(cubes_.size() * sizeof(ColoredPoint));
  std::uint8_t* place = points.data();
  for (const Cube& cube : cubes_) {
    const ColoredPoint point = makePoint(
        cube.position_sum / static_cast<float>(cube.count), mean(cube.red_sum, cube.count),
        mean(cube.green_sum, cube.count), mean(cube.blue_sum, cube.count));
    std::memcpy(place, &point, sizeof(point));
    place += sizeof(point);
  }
  return makeColoredCloud(header, points);
}

}  // namespace process_visualizer::cloud
