// SPDX-License-Identifier: BSD-3-Clause
// Measures the sender thread's share of a core, and the delay of messages, for several numbers of
// messages per second.
//
// usage: bench_sender_load [SECONDS [TOPICS [MESSAGES_PER_SECOND …]]]
//
// Messages of 100 B, in turn on some topics (10) with one TCP subscriber each in another process,
// are given to the sender a tenth of a second before they are due, as the player does. The threads
// that give and read have real-time priority too, if permitted, so that other work on the machine
// does not add to the times.

#include <arpa/inet.h>
#include <poll.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/common/time_slice.hpp"
#include "process_visualizer/sender/timed_sender.hpp"

using process_visualizer::sender::monotonicNow;
using process_visualizer::sender::Packet;
using process_visualizer::sender::QueueLimits;
using process_visualizer::sender::TimedSender;

namespace {

constexpr std::size_t kMessageBytes = 100;  // the first of them are the due time
constexpr std::size_t kPacketBytes = kMessageBytes + sizeof(std::uint32_t);
constexpr QueueLimits kMuch{10'000'000, std::size_t{1} << 32};
constexpr std::int64_t kLeadNs = 100'000'000;
constexpr std::int64_t kGiveEveryNs = 5'000'000;
constexpr double kEndS = 20.0;

int checked(int result, const char* what) {
  if (result < 0) throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
  return result;
}

/// Two ends of a TCP connection through the loopback interface.
std::array<int, 2> connection() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  const int listener = checked(socket(AF_INET, SOCK_STREAM, 0), "socket");
  auto* const general = reinterpret_cast<sockaddr*>(&address);
  checked(bind(listener, general, size), "bind");
  checked(listen(listener, 1), "listen");
  checked(getsockname(listener, general, &size), "getsockname");
  const int client = checked(socket(AF_INET, SOCK_STREAM, 0), "socket");
  checked(connect(client, general, size), "connect");
  const int server = checked(accept(listener, nullptr, nullptr), "accept");
  close(listener);
  return {server, client};
}

/// A subscriber: reads packets of a known size and records the delay of each [ns].
class Reader {
 public:
  explicit Reader(int socket) : socket_(socket) {}

  int socket() const { return socket_; }

  /// Reads the available data; returns true if more can come.
  bool read(std::vector<std::int64_t>& late_ns) {
    const ssize_t count = recv(socket_, buffer_.data() + size_, buffer_.size() - size_, 0);
    if (count <= 0) return false;
    const std::int64_t now_ns = monotonicNow();
    size_ += static_cast<std::size_t>(count);
    std::size_t begin = 0;
    for (; begin + kPacketBytes <= size_; begin += kPacketBytes) {
      std::int64_t due_ns;
      std::memcpy(&due_ns, buffer_.data() + begin + sizeof(std::uint32_t), sizeof(due_ns));
      late_ns.push_back(now_ns - due_ns);
    }
    size_ -= begin;
    std::memmove(buffer_.data(), buffer_.data() + begin, size_);
    return true;
  }

 private:
  int socket_;
  std::vector<char> buffer_ = std::vector<char>(1 << 20);
  std::size_t size_ = 0;
};

/// In the process of the subscribers: reads to the end, then prints its columns of the table.
void receive(const std::vector<int>& sockets) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::vector<Reader> readers(sockets.begin(), sockets.end());
  std::vector<pollfd> polled;
  for (const Reader& reader : readers) polled.push_back({reader.socket(), POLLIN, 0});
  std::vector<std::int64_t> late_ns;
  for (auto open = readers.size(); open > 0;) {
    checked(poll(polled.data(), polled.size(), -1), "poll");
    for (std::size_t number = 0; number < readers.size(); ++number) {
      if (polled[number].revents == 0 || readers[number].read(late_ns)) continue;
      polled[number].fd = -1;
      --open;
    }
  }
  std::sort(late_ns.begin(), late_ns.end());
  const auto quantile_ms = [&](double share) {
    return late_ns.empty() ? 0.0
                           : 1e-6 * late_ns[static_cast<std::size_t>(share * (late_ns.size() - 1))];
  };
  std::printf("| %zu | %.2f | %.2f | %.2f |\n", late_ns.size(), quantile_ms(0.5), quantile_ms(0.99),
              quantile_ms(1.0));
}

/// Returns the CPU time of the sender's thread so far [ns].
std::int64_t computed() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm") >> std::ws, name);
    std::int64_t time_ns = 0;
    std::ifstream(task.path() / "schedstat") >> time_ns;
    if (name == "timed sender") return time_ns;
  }
  throw std::runtime_error("the sender has no thread");
}

/// Gives the sender the messages of some seconds, each shortly before it is due.
void give(TimedSender& sender, const std::vector<int>& topics, int rate, double length_s) {
  std::string message(kMessageBytes, ' ');
  const std::int64_t begin_ns = monotonicNow() + kLeadNs;
  const auto count = static_cast<std::int64_t>(rate * length_s);
  for (std::int64_t number = 0; number < count;) {
    const std::int64_t until_ns = monotonicNow() + kLeadNs;
    for (; number < count; ++number) {
      const std::int64_t due_ns = begin_ns + number * INT64_C(1'000'000'000) / rate;
      if (due_ns > until_ns) break;
      std::memcpy(message.data(), &due_ns, sizeof(due_ns));
      sender.send(topics[number % topics.size()], 0, due_ns,
                  std::make_shared<const Packet>(message.data(), message.size()));
    }
    std::this_thread::sleep_for(std::chrono::nanoseconds(kGiveEveryNs));  // the load's own pace
  }
}

/// Prints a row of the table.
void measure(int rate, int topic_count, double length_s) {
  std::vector<int> servers, clients;
  for (int number = 0; number < topic_count; ++number) {
    const auto [server, client] = connection();
    servers.push_back(server);
    clients.push_back(client);
  }
  std::fflush(stdout);
  const pid_t child = checked(fork(), "fork");
  if (child == 0) {
    for (const int server : servers) close(server);
    receive(clients);
    std::exit(EXIT_SUCCESS);
  }
  for (const int client : clients) close(client);
  {
    TimedSender sender;
    std::vector<int> topics;
    for (const int server : servers) {
      topics.push_back(sender.addTopic(false, kMuch));
      sender.addLink(topics.back(), server);
      close(server);
    }
    const std::int64_t before_ns = computed(), begin_ns = monotonicNow();
    give(sender, topics, rate, length_s);
    if (!sender.waitUntilSent(kEndS)) std::fprintf(stderr, "not everything was sent\n");
    const double share = static_cast<double>(computed() - before_ns) / (monotonicNow() - begin_ns);
    std::printf("| %d | %.0f ", rate, 100 * share);
    std::fflush(stdout);
  }
  waitpid(child, nullptr, 0);
}

}  // namespace

int main(int count, char** arguments) {
  if (!process_visualizer::takeRealTimePriority())
    std::fputs("no real-time priority here: a busy machine adds to the times\n", stderr);
  const double length_s = count > 1 ? std::atof(arguments[1]) : 5.0;
  const int topic_count = count > 2 ? std::atoi(arguments[2]) : 10;
  std::vector<int> rates;
  for (int index = 3; index < count; ++index) rates.push_back(std::atoi(arguments[index]));
  if (rates.empty()) rates = {1'000, 10'000, 30'000, 100'000};
  std::puts(
      "| messages/s | CPU, % of a core | arrived | late by p50, ms | p99, ms | max, ms |\n"
      "|---|---|---|---|---|---|");
  for (const int rate : rates) measure(rate, topic_count, length_s);
}
