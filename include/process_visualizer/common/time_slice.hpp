// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace process_visualizer {

/// For a thread that must run at once when it wakes up, and never runs for long.
constexpr std::chrono::nanoseconds kShortSlice = std::chrono::microseconds(100);
/// For threads whose work can wait: threads with shorter slices need not wait for them.
constexpr std::chrono::nanoseconds kLongSlice = std::chrono::milliseconds(10);

/// Sets the time slices of the calling thread, and of those that it starts. They change no
/// thread's share of the processor: Linux (6.12 and later, others ignore it) lets a thread that
/// wakes up take the place of one with longer slices. Needs no privileges.
void takeSlices(std::chrono::nanoseconds slice);

/// Lets the calling thread run before all without real-time priority, if the user is allowed to
/// (`rtprio` in limits.conf(5), or root): for a thread that never runs for long. Returns whether
/// it has the priority.
bool takeRealTimePriority();

}  // namespace process_visualizer
