// SPDX-License-Identifier: BSD-3-Clause
// Clock of the data, and which sensors are silent, new, or complete.

#include "process_visualizer/cloud/fused_clouds.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::cloud {
namespace {

constexpr double kSilentAfter = 1;  ///< s without a state of the player, which sends ten per second

}  // namespace

void DataClock::follow(double wall_s, double speed) {
  data_s_ = at(wall_s);
  wall_s_ = wall_s;
  speed_ = std::min(std::abs(speed), 1.0);
}

double DataClock::at(double wall_s) const {
  const double elapsed = std::max(wall_s - wall_s_, 0.0);
  const double followed = std::min(elapsed, kSilentAfter);
  return data_s_ + followed * speed_ + (elapsed - followed);
}

FusedClouds::FusedClouds(std::size_t count, double silence_s)
    : silence_s_(silence_s), sensors_(count) {}

void FusedClouds::begin(double now_s) {
  for (Sensor& sensor : sensors_) sensor = {{}, now_s, false};
}

void FusedClouds::take(std::size_t sensor, const PlacedCloud& cloud, double now_s) {
  if (cloud.cloud->header.stamp < jump_) return;
  sensors_[sensor] = {cloud, now_s, true};
}

void FusedClouds::jump(const ros::Time& stamp, double now_s) {
  jump_ = stamp;
  for (Sensor& sensor : sensors_) {
    sensor.is_new = sensor.newest.cloud && !(sensor.newest.cloud->header.stamp < stamp);
    if (!sensor.is_new) sensor = {{}, now_s, false};
  }
}

bool FusedClouds::hasNew() const {
  return std::any_of(sensors_.begin(), sensors_.end(), [](const Sensor& it) { return it.is_new; });
}

bool FusedClouds::isComplete(double now_s) const {
  for (std::size_t number = 0; number < sensors_.size(); ++number)
    if (!sensors_[number].is_new && !isSilent(number, now_s)) return false;
  return hasNew();
}

bool FusedClouds::isSilent(std::size_t sensor, double now_s) const {
  return now_s - sensors_[sensor].heard_s > silence_s_;
}

std::vector<PlacedCloud> FusedClouds::next(double now_s) {
  std::vector<PlacedCloud> clouds;
  for (std::size_t number = 0; number < sensors_.size(); ++number) {
    Sensor& sensor = sensors_[number];
    if (sensor.newest.cloud && !isSilent(number, now_s)) clouds.push_back(sensor.newest);
    sensor.is_new = false;
  }
  return clouds;
}

}  // namespace process_visualizer::cloud
