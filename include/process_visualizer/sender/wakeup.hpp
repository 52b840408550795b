// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Waits of the sender's thread: until a time, a socket's event, or a call from another thread.

#include <cstdint>
#include <vector>

namespace process_visualizer::sender {

/// The monotonic clock [ns].
std::int64_t monotonicNow();

/// Lets a thread wait until a time, or until another thread or a socket ends the wait. Times are of
/// the monotonic clock, in nanoseconds; tests replace this by a class with a clock of their own.
class Wakeup {
 public:
  struct Event {
    int number;   ///< by which the socket was added
    bool broken;  ///< the other side is gone; otherwise it accepts data again
  };
  static constexpr std::int64_t kNever = INT64_MAX;

  /// @throws std::system_error if the system has no more descriptors.
  Wakeup();
  virtual ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  virtual std::int64_t now() const { return monotonicNow(); }

  void add(int socket, int number);
  /// Sets whether the wait also ends when the socket is writable.
  void watchWritable(int socket, int number, bool watch);
  void remove(int socket);

  /// Ends the current wait, or the next one. Any thread may call this; the other functions are for
  /// the waiting thread, or for one that holds its lock.
  virtual void ring();
  /// Waits until a time [ns]; returns the events of sockets.
  virtual std::vector<Event> waitUntil(std::int64_t time_ns);

 private:
  void setTimer(std::int64_t time_ns);

  int epoll_;
  int timer_;
  int bell_;
  std::int64_t timer_ns_ = kNever;
};

}  // namespace process_visualizer::sender
