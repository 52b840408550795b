// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <chrono>
#include <cstdint>
#include <functional>

#include "process_visualizer/recorder/bag_file.hpp"

namespace process_visualizer::recorder {

using SteadyTime = std::chrono::steady_clock::time_point;

/// What a recorder asks of the computer that it runs on. A test hands in answers of its own.
struct Machine {
  std::function<ros::Time()> now = ros::Time::now;  ///< the time of messages; may be simulated
  std::function<bool()> isSimulated = ros::Time::isSimTime;             ///< whether it is
  std::function<ros::WallTime()> wall = ros::WallTime::now;             ///< can be set, and jump
  std::function<SteadyTime()> steady = std::chrono::steady_clock::now;  ///< never jumps
  std::function<std::uint64_t(const BagFile&)> freeBytes = &BagFile::freeBytes;
};

}  // namespace process_visualizer::recorder
