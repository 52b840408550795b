// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <stdexcept>
#include <thread>

#include "process_visualizer/recorder/machine.hpp"

namespace process_visualizer::recorder {

/// A computer whose time is advanced by the tests, and whose disk has the free space they set.
class SimulatedMachine {
 public:
  Machine machine() {
    Machine machine;
    machine.now = [this] { return is_simulated_ ? simulatedNow() : now(); };
    machine.isSimulated = [this] { return is_simulated_.load(); };
    machine.wall = [this] { return ros::WallTime().fromNSec(ns_ + jumped_ns_); };
    machine.steady = [this] { return SteadyTime(std::chrono::nanoseconds(ns_)); };
    machine.freeBytes = [this](const BagFile&) { return free_bytes_.load(); };
    return machine;
  }
  ros::Time now() const { return ros::Time().fromNSec(ns_); }
  void goOn(double seconds) { ns_ += toNs(seconds); }
  void jump(double seconds) { jumped_ns_ += toNs(seconds); }  ///< sets the clock
  /// Sets the time of /clock.
  void simulate(double seconds) {
    simulated_ns_ = toNs(seconds);
    is_simulated_ = true;
  }
  void setFreeBytes(std::uint64_t bytes) { free_bytes_ = bytes; }

 private:
  ros::Time simulatedNow() const { return ros::Time().fromNSec(simulated_ns_); }
  static std::int64_t toNs(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

  std::atomic<std::int64_t> ns_ = 1'000'000'000'000;  // the time is 1000 s
  std::atomic<std::int64_t> jumped_ns_ = 0, simulated_ns_ = 0;
  std::atomic<bool> is_simulated_ = false;
  std::atomic<std::uint64_t> free_bytes_ = std::uint64_t{1} << 40;
};

constexpr std::chrono::minutes kPatience(1);  ///< with another thread on a slow computer

inline void waitFor(const std::future<void>& future) {
  if (future.wait_for(kPatience) != std::future_status::ready)
    throw std::runtime_error("it has not happened");
}

inline void waitUntil(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error("it has not come true");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace process_visualizer::recorder
