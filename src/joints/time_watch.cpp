// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/time_watch.hpp"

namespace process_visualizer::joints {
namespace {

constexpr std::chrono::seconds kLongestStep{1};  // of a simulated clock
constexpr std::chrono::seconds kMemory{6};       // longer than warnings are held back

}  // namespace

std::string TimeWatch::problem(double ros_s, Clock::time_point now) {
  if (begun_ && ros_s < last_s_) stepped_back_ = now;
  if (!begun_ || ros_s != last_s_) advanced_ = now;
  begun_ = true;
  last_s_ = ros_s;
  if (stepped_back_ && now - *stepped_back_ < kMemory)
    return "ROS time has gone back: look at what publishes /clock";
  if (now - advanced_ > kLongestStep)
    return "ROS time stands still: look at what publishes /clock, or set /use_sim_time to false";
  return {};
}

}  // namespace process_visualizer::joints
