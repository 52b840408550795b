// SPDX-License-Identifier: BSD-3-Clause
// Waits with epoll, a timer and an event descriptor.

#include "process_visualizer/sender/wakeup.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <system_error>

namespace process_visualizer::sender {
namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;
constexpr int kTimer = -1;
constexpr int kBell = -2;
constexpr std::int64_t kFired = -1;  // not a time: the timer must be set again, which resets it

int checked(int descriptor, const char* what) {
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), what);
  return descriptor;
}

epoll_event wanted(int number, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.fd = number;
  return event;
}

}  // namespace

std::int64_t monotonicNow() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

Wakeup::Wakeup()
    : epoll_(checked(epoll_create1(EPOLL_CLOEXEC), "epoll")),
      timer_(checked(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC), "a timer")),
      bell_(checked(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "an event")) {
  epoll_event timer = wanted(kTimer, EPOLLIN);
  epoll_event bell = wanted(kBell, EPOLLIN);
  checked(epoll_ctl(epoll_, EPOLL_CTL_ADD, timer_, &timer), "the timer's events");
  checked(epoll_ctl(epoll_, EPOLL_CTL_ADD, bell_, &bell), "the bell's events");
}

Wakeup::~Wakeup() {
  for (const int descriptor : {epoll_, timer_, bell_}) close(descriptor);
}

void Wakeup::add(int socket, int number) {
  epoll_event event = wanted(number, EPOLLRDHUP);
  checked(epoll_ctl(epoll_, EPOLL_CTL_ADD, socket, &event), "a subscriber's events");
}

void Wakeup::watchWritable(int socket, int number, bool watch) {
  epoll_event event = wanted(number, EPOLLRDHUP | (watch ? EPOLLOUT : 0U));
  epoll_ctl(epoll_, EPOLL_CTL_MOD, socket, &event);
}

void Wakeup::remove(int socket) { epoll_ctl(epoll_, EPOLL_CTL_DEL, socket, nullptr); }

void Wakeup::ring() { eventfd_write(bell_, 1); }

std::vector<Wakeup::Event> Wakeup::waitUntil(std::int64_t time_ns) {
  if (time_ns != timer_ns_) setTimer(time_ns);
  std::array<epoll_event, 32> found;
  const int count = epoll_wait(epoll_, found.data(), found.size(), -1);
  std::vector<Event> events;
  for (int index = 0; index < count; ++index) {
    const int number = found[index].data.fd;
    if (number == kTimer) {
      timer_ns_ = kFired;
    } else if (number == kBell) {
      eventfd_t rings;
      eventfd_read(bell_, &rings);  // all of them at once
    } else {
      events.push_back({number, (found[index].events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)) != 0});
    }
  }
  return events;
}

void Wakeup::setTimer(std::int64_t time_ns) {
  itimerspec timer{};  // zero: never
  if (time_ns != kNever) {
    const std::int64_t at_ns = std::max<std::int64_t>(time_ns, 1);
    timer.it_value.tv_sec = at_ns / kNsPerS;
    timer.it_value.tv_nsec = at_ns % kNsPerS;
  }
  timerfd_settime(timer_, TFD_TIMER_ABSTIME, &timer, nullptr);
  timer_ns_ = time_ns;
}

}  // namespace process_visualizer::sender
