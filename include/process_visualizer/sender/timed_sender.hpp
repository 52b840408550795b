// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sends messages to subscribers at given times: their order, latching, and revocation.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "process_visualizer/sender/subscriber_link.hpp"
#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer::sender {

/// Numbered items, each with the time at which it is due. Due items are found without a search.
/// Times are of the monotonic clock, in nanoseconds.
class Agenda {
 public:
  /// Sets an item's time; `Wakeup::kNever` removes it. Of two items with the same time, the one
  /// with the lower rank comes first.
  void set(int item, std::int64_t time_ns, std::uint64_t rank = 0);
  /// The earliest time; `Wakeup::kNever` if there is nothing to do.
  std::int64_t nextTime() const;
  /// The item with the earliest time; there must be one.
  int nextItem() const;
  /// The items whose time has come, the earliest first.
  std::vector<int> due(std::int64_t now_ns) const;

 private:
  using Entry = std::tuple<std::int64_t, std::uint64_t, int>;  ///< time, rank, item

  std::set<Entry> entries_;
  std::unordered_map<int, std::set<Entry>::iterator> places_;
};

/// Sends messages to the subscribers of topics at given times, in its own thread. Times are of the
/// monotonic clock, in nanoseconds. Thread-safe.
///
/// The packets of a topic are sent in the order in which they were given: none is begun before its
/// predecessor is due, however large it is. A packet that has been begun or was due at once, and
/// all earlier ones, are sent and cannot be withdrawn.
class TimedSender {
 public:
  /// \param wakeup  provides the clock and the waits of the thread
  /// @throws std::system_error if the system has no more descriptors.
  explicit TimedSender(std::unique_ptr<Wakeup> wakeup = std::make_unique<Wakeup>());
  ~TimedSender();
  TimedSender(const TimedSender&) = delete;
  TimedSender& operator=(const TimedSender&) = delete;

  /// Returns the number of a new topic. If it is latched, new subscribers get the last packet of
  /// each of its sources, in the order in which these were sent.
  int addTopic(bool latch, const QueueLimits& limits);
  /// Returns the number of a new subscriber of a topic, given its connected socket.
  /// @throws std::system_error if there is no such socket.
  int addLink(int topic, int socket);
  void removeLink(int number);

  /// Sends a packet so that it arrives at a time, but not before packets given earlier. A packet
  /// without a message only removes the source's latched one: new subscribers get none.
  void send(int topic, int source, std::int64_t due_ns, PacketPtr packet);
  /// Withdraws the packets due after a time, always the last ones given, and returns their number.
  /// Packets that have been begun or were due at once stay, and those due no later than these. A
  /// packet that has been begun is due at most a few milliseconds later.
  std::size_t revoke(std::int64_t after_ns);

  /// Number of packets of a topic that have been begun, even without subscribers.
  std::size_t sent(int topic) const;
  /// Number of packets dropped for slow subscribers.
  std::size_t dropped() const;
  /// Waits until everything has been sent to all subscribers; returns false at the timeout.
  bool waitUntilSent(double timeout_s);
  /// Waits until a subscriber is gone and returns its number; -1 after `close`.
  int waitForBroken();
  /// Ends the thread; packets still in the queue are not sent.
  void close();

 private:
  struct Scheduled {
    Transfer transfer;
    std::uint64_t number;  ///< sequence number of the packet
    int source;
    PacketPtr packet;
  };
  struct Latched {
    int source;
    PacketPtr packet;
    std::int64_t due_ns;
  };
  struct Topic {
    bool latch;
    QueueLimits limits;
    std::vector<Latched> latched = {};  ///< one for each source, in sending order
    std::vector<int> links = {};
    std::deque<Scheduled> scheduled = {};  ///< not begun, in the given order
    std::int64_t begun_due_ns = 0;         ///< due time of the packet that was begun last
    std::size_t sent = 0;
  };

  void run();
  void beginFirst(int number);
  void plan(int number);
  static void latch(Topic& topic, const Scheduled& scheduled);
  void enqueue(int number, const PacketPtr& packet, std::int64_t due_ns);
  void writeDue(std::int64_t now_ns);
  void update(int number, SubscriberLink::State before);
  void handle(const std::vector<Wakeup::Event>& events);
  void ringBefore(std::int64_t time_ns);
  bool isIdle() const { return waiting_ == 0 && busy_ == 0; }

  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::condition_variable broken_changed_;
  std::unique_ptr<Wakeup> wakeup_;
  bool closed_ = false;
  std::int64_t waits_until_ns_ = Wakeup::kNever;
  std::vector<Topic> topics_;
  Agenda start_queue_;       ///< topics, by the time from which their first packet may be begun
  Agenda to_write_;          ///< links, by the time from which their next part may be written
  std::size_t waiting_ = 0;  ///< packets that have not been begun
  std::uint64_t given_ = 0;  ///< packets
  std::int64_t last_due_ns_ = 0;           ///< due time of the packet that was given last
  std::int64_t irrevocable_until_ns_ = 0;  ///< packets due until then are not withdrawn
  std::unordered_map<int, std::unique_ptr<SubscriberLink>> links_;
  std::deque<int> broken_;
  int busy_ = 0;  ///< links that have something to send
  int next_link_ = 0;
  std::size_t dropped_by_removed_ = 0;
  std::thread thread_;
};

}  // namespace process_visualizer::sender
