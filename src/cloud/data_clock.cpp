// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/data_clock.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::cloud {
namespace {

constexpr double kLostAfter = 1;  ///< without a state of the player, which sends ten a second, s

}  // namespace

void DataClock::follow(double wall_s, double speed) {
  data_s_ = at(wall_s);
  wall_s_ = wall_s;
  speed_ = std::min(std::abs(speed), 1.0);
}

double DataClock::at(double wall_s) const {
  const double elapsed = std::max(wall_s - wall_s_, 0.0);
  const double followed = std::min(elapsed, kLostAfter);
  return data_s_ + followed * speed_ + (elapsed - followed);
}

}  // namespace process_visualizer::cloud
