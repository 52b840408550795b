// SPDX-License-Identifier: BSD-3-Clause
// What stands for a subscriber in the sender's tests, and what it is sent.
#pragma once

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/sender/timed_sender.hpp"

namespace process_visualizer::sender {

constexpr std::int64_t kMs = 1'000'000;
constexpr QueueLimits kMuch{1000, 1 << 30};

inline std::shared_ptr<const Packet> packet(const std::string& message) {
  return std::make_shared<const Packet>(message.data(), message.size());
}

/// A subscriber: the sender writes to `peer`.
class Subscriber {
 public:
  Subscriber() {
    int sockets[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, sockets) != 0) throw std::runtime_error("socketpair");
    socket_ = sockets[0];
    peer = sockets[1];
    const timeval timeout{5, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
  }
  ~Subscriber() {
    leave();
    close(peer);
  }
  void leave() {
    if (socket_ >= 0) close(socket_);
    socket_ = -1;
  }
  /// The next message, "nothing" if none comes for long.
  std::string receive() {
    std::uint32_t size;
    if (recv(socket_, &size, sizeof(size), MSG_WAITALL) != sizeof(size)) return "nothing";
    std::string message(size, ' ');
    recv(socket_, message.data(), size, MSG_WAITALL);
    return message;
  }
  /// The next messages, as the numbers that they begin with; -1 once none comes for long.
  std::vector<int> receiveNumbers(std::size_t count) {
    std::vector<int> numbers;
    while (numbers.size() < count && (numbers.empty() || numbers.back() >= 0)) {
      const std::string message = receive();
      numbers.push_back(message == "nothing" ? -1 : std::atoi(message.c_str()));
    }
    return numbers;
  }
  void waitForSomething() {
    char byte;
    recv(socket_, &byte, 1, MSG_PEEK);
  }
  bool hasSomething() {
    char byte;
    return recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) > 0;
  }

  int peer;

 private:
  int socket_;
};

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
