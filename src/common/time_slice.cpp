// SPDX-License-Identifier: BSD-3-Clause
// System calls for time slices and real-time priority.

#include "process_visualizer/common/time_slice.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>

namespace process_visualizer {
namespace {

/// The kernel's struct sched_attr (sched_setattr(2)), which not every libc declares.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes);
  std::uint32_t policy = SCHED_OTHER;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;  ///< for SCHED_OTHER, the length of a slice
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
};

}  // namespace

void setTimeSlice(std::chrono::nanoseconds slice) {
  SchedulingAttributes attributes;
  attributes.nice = getpriority(PRIO_PROCESS, 0);
  attributes.runtime_ns = static_cast<std::uint64_t>(slice.count());
  syscall(SYS_sched_setattr, 0, &attributes, 0);  // if this fails, threads are only less punctual
}

bool takeRealTimePriority() {
  sched_param parameters{};
  parameters.sched_priority = sched_get_priority_min(SCHED_RR);
  return pthread_setschedparam(pthread_self(), SCHED_RR, &parameters) == 0;
}

}  // namespace process_visualizer
