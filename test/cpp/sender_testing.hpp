// SPDX-License-Identifier: BSD-3-Clause
// A sender with a simulated clock, stand-ins for its subscribers, and messages to them.
#pragma once

#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/sender/timed_sender.hpp"

namespace process_visualizer::sender {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBeginNs = 1'000'000 * kMs;  // first time of the simulated clock
constexpr std::int64_t kLongNs = 60'000 * kMs;
constexpr QueueLimits kMuch{1000, 1 << 30};

/// A clock that the test advances, and on which the sender's thread waits. The sockets are real:
/// events on them are noticed when the test lets the sender work.
class SimulatedTime : public Wakeup {
 public:
  std::int64_t now() const override {
    const std::lock_guard lock(mutex_);
    return now_ns_;
  }
  void ring() override {
    const std::lock_guard lock(mutex_);
    rung_ = true;
    waits_ = false;
    changed_.notify_all();
  }
  std::vector<Event> waitUntil(std::int64_t time_ns) override {
    std::unique_lock lock(mutex_);
    while (true) {
      std::vector<Event> events = Wakeup::waitUntil(kPastNs);  // without waiting
      if (rung_ || time_ns <= now_ns_ || !events.empty()) {
        rung_ = false;
        return events;
      }
      until_ns_ = time_ns;
      waits_ = true;
      ++wait_count_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return !waits_; });
    }
  }

  /// Lets the sender do all that is due now.
  void settle() { advanceTo(now()); }
  /// Advances the time, and lets the sender do what is due meanwhile, each at its time.
  void advanceTo(std::int64_t time_ns) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waits_; });
    letWork(lock);
    while (until_ns_ <= time_ns) {
      now_ns_ = std::max(now_ns_, until_ns_);
      letWork(lock);
    }
    now_ns_ = std::max(now_ns_, time_ns);
  }
  /// Number of times that the sender has waited so far.
  int waitCount() const {
    const std::lock_guard lock(mutex_);
    return wait_count_;
  }

 private:
  static constexpr std::int64_t kPastNs = 1;

  void letWork(std::unique_lock<std::mutex>& lock) {
    waits_ = false;
    changed_.notify_all();
    changed_.wait(lock, [this] { return waits_; });
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t now_ns_ = kBeginNs;
  std::int64_t until_ns_ = kNever;
  bool waits_ = false;
  bool rung_ = false;
  int wait_count_ = 0;
};

/// A sender with a clock that the test advances.
struct SimulatedSender : TimedSender {
  SimulatedSender() : SimulatedSender(new SimulatedTime) {}

  SimulatedTime& time;

 private:
  explicit SimulatedSender(SimulatedTime* own)
      : TimedSender(std::unique_ptr<Wakeup>(own)), time(*own) {}
};

/// The two ends of a connection.
struct Connection {
  Connection() {
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0)
      throw std::runtime_error("socketpair");
    const timeval patience{20, 0};
    setsockopt(ends[0], SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  }
  ~Connection() {
    for (const int end : ends)
      if (end >= 0) close(end);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  std::array<int, 2> ends;
};

/// A subscriber. The sender writes to `peer`; nothing is read until a test asks for it.
class Subscriber {
 public:
  explicit Subscriber(SimulatedSender& sender) : time_(sender.time) {}

  int peer() const { return connection_.ends[1]; }
  void leave() {
    close(connection_.ends[0]);
    connection_.ends[0] = -1;
  }
  /// Returns the next message that has arrived, or arrives once earlier ones are read; else
  /// "nothing".
  std::string receive() {
    while (!hasMessage())
      if (!take()) return "nothing";
    std::string message = come_.substr(begin_ + kLength, messageSize());
    begin_ += kLength + message.size();
    if (begin_ == come_.size()) come_.clear(), begin_ = 0;
    return message;
  }
  /// Returns all messages that have arrived, as the numbers that they begin with.
  std::vector<int> receiveNumbers() {
    std::vector<int> numbers;
    for (std::string message = receive(); message != "nothing"; message = receive())
      numbers.push_back(std::atoi(message.c_str()));
    return numbers;
  }
  /// Number of bytes that have arrived but belong to no message received yet.
  std::size_t byteCount() {
    while (take()) continue;
    return come_.size() - begin_;
  }

 private:
  static constexpr std::size_t kLength = sizeof(std::uint32_t);

  bool hasMessage() const {
    return come_.size() - begin_ >= kLength && come_.size() - begin_ >= kLength + messageSize();
  }
  std::size_t messageSize() const {
    std::uint32_t size;
    std::memcpy(&size, come_.data() + begin_, kLength);
    return size;
  }
  /// Reads what has arrived once the sender has done what is due. Returns whether there was
  /// anything.
  bool take() {
    time_.settle();
    static char bytes[1 << 16];
    const std::size_t before = come_.size();
    ssize_t count;
    while ((count = recv(connection_.ends[0], bytes, sizeof(bytes), MSG_DONTWAIT)) > 0)
      come_.append(bytes, static_cast<std::size_t>(count));
    return come_.size() > before;
  }

  Connection connection_;
  SimulatedTime& time_;
  std::string come_;
  std::size_t begin_ = 0;  ///< of what is not received yet
};

inline std::shared_ptr<const Packet> packet(const std::string& message) {
  return std::make_shared<const Packet>(message.data(), message.size());
}

/// A message of a size that begins with a number.
inline std::shared_ptr<const Packet> numbered(int number, std::size_t size) {
  std::string message = std::to_string(number) + ' ';
  message.resize(std::max(size, message.size()), ' ');
  return packet(message);
}

inline std::vector<int> counted(int count) {
  std::vector<int> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

}  // namespace process_visualizer::sender
