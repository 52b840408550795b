// SPDX-License-Identifier: BSD-3-Clause
/// Compares the time of something with that of its peer, the usual alternative.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <vector>

inline double milliseconds(const std::function<void()>& run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  const auto time = std::chrono::steady_clock::now() - begin;
  return std::chrono::duration<double, std::milli>(time).count();
}

/// Returns the value below which a share of the times lies.
inline double share(std::vector<double> times_ms, double part) {
  const auto place = times_ms.begin() + static_cast<std::ptrdiff_t>(part * (times_ms.size() - 1));
  std::nth_element(times_ms.begin(), place, times_ms.end());
  return *place;
}

/// Runs both in turns, several times each, so that other load on the machine affects both alike,
/// and prints the medians.
/// \param limit maximum time as a multiple of the peer's
/// \returns true if the limit is kept
inline bool isWithin(double limit, const char* name, const std::function<void()>& run,
                     const char* peer, const std::function<void()>& run_peer, int turns = 10,
                     int times = 10) {
  std::vector<double> times_ms, peer_ms;
  for (int turn = 0; turn < turns; ++turn) {
    for (int i = 0; i < times; ++i) times_ms.push_back(milliseconds(run));
    for (int i = 0; i < times; ++i) peer_ms.push_back(milliseconds(run_peer));
  }
  const double ratio = share(times_ms, 0.5) / share(peer_ms, 0.5);
  std::printf("%s: median %.2f ms; %s: %.2f ms; ratio %.2f, limit %.2f: %s\n", name,
              share(times_ms, 0.5), peer, share(peer_ms, 0.5), ratio, limit,
              ratio <= limit ? "kept" : "TOO SLOW");
  return ratio <= limit;
}
