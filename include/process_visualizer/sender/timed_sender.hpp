#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <vector>

#include "process_visualizer/sender/subscriber_link.hpp"
#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer {

/// Sends messages to the subscribers of topics at times given before, in a thread of its own.
/// Times are of the monotonic clock, in nanoseconds. May be used by several threads.
class TimedSender {
 public:
  /// @throws std::system_error if the system has no more descriptors.
  TimedSender();
  ~TimedSender();
  TimedSender(const TimedSender&) = delete;
  TimedSender& operator=(const TimedSender&) = delete;

  /// Returns the number of a new topic. If it is latched, new subscribers get the last packet of
  /// each of its sources.
  int addTopic(bool latch, const QueueLimits& limits);
  /// Returns the number of a new subscriber of a topic, given its connected socket.
  /// @throws std::system_error if there is no such socket.
  int addLink(int topic, int socket);
  void removeLink(int link);

  /// Sends a packet so that it arrives at a time, but not before those given before it.
  void send(int topic, int source, std::int64_t due_ns, PacketPtr packet);
  /// Takes back what is due after a time, but nothing up to the last packet that has been begun;
  /// returns how many packets. What has been begun is due a few milliseconds later at most.
  std::size_t revoke(std::int64_t after_ns);

  /// Packets of a topic that have been begun, whether or not somebody listens.
  std::size_t sent(int topic) const;
  /// Packets that slow subscribers did not get.
  std::size_t dropped() const;
  /// Waits until everything has gone to everybody; returns whether it has.
  bool waitUntilSent(double timeout_s);
  /// Waits for a subscriber that has gone away and returns its number; -1 after `close`.
  int waitForBroken();
  /// Ends the thread; what is still queued is not sent.
  void close();

 private:
  struct Topic {
    bool latch;
    QueueLimits limits;
    std::map<int, PacketPtr> latched;  ///< by source
    std::vector<int> links;
    std::size_t sent = 0;
  };
  struct Scheduled {
    Transfer transfer;
    int topic;
    int source;
    PacketPtr packet;  ///< null once its links have it
  };

  void run();
  std::int64_t beginScheduled();
  std::int64_t writeToLinks();
  void begin(Scheduled& scheduled);
  void give(int number, const PacketPtr& packet, std::int64_t due_ns);
  void update(int number, SubscriberLink::State before);
  void handle(const std::vector<Wakeup::Event>& events);
  bool isIdle() const { return scheduled_.empty() && busy_ == 0; }

  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::condition_variable broken_changed_;
  Wakeup wakeup_;
  bool closed_ = false;
  std::int64_t waits_until_ns_ = Wakeup::kNever;
  std::deque<Scheduled> scheduled_;  ///< in the order in which they are due
  std::vector<Topic> topics_;
  std::unordered_map<int, std::unique_ptr<SubscriberLink>> links_;
  std::deque<int> broken_;
  int busy_ = 0;  ///< links that have something to send
  int next_link_ = 0;
  std::size_t dropped_by_removed_ = 0;
  std::thread thread_;
};

/// The monotonic clock [ns].
std::int64_t monotonicNow();

}  // namespace process_visualizer
