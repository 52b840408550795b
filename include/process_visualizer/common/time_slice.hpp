// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Scheduling of threads: short and long time slices, and real-time priority.

#include <chrono>

namespace process_visualizer {

/// Time slice of a thread that must run at once when it wakes up, and never runs for long.
constexpr std::chrono::nanoseconds kShortSlice = std::chrono::microseconds(100);
/// Time slice of threads whose work can wait, so that threads with shorter slices do not wait for
/// them.
constexpr std::chrono::nanoseconds kLongSlice = std::chrono::milliseconds(10);

/// Sets the time slice of the calling thread and of the threads that it starts. This changes no
/// thread's share of the processor: Linux (6.12 and later; others ignore it) lets a thread that
/// wakes up preempt one with a longer slice. Needs no privileges.
void setTimeSlice(std::chrono::nanoseconds slice);

/// Gives the calling thread real-time priority, if the user may set it (`rtprio` in limits.conf(5),
/// or root). For a thread that never runs for long. Returns whether it has the priority.
bool takeRealTimePriority();

}  // namespace process_visualizer
