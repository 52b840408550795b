// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/uio.h>

#include <array>
#include <deque>

#include "process_visualizer/sender/packet.hpp"
#include "process_visualizer/sender/transfer.hpp"

namespace process_visualizer::sender {

/// How much may wait for a subscriber that is slower than the messages.
struct QueueLimits {
  std::size_t packets;
  std::size_t bytes;
};

/// The connection to one subscriber. It never waits: what cannot be sent waits in a queue;
/// when that is full, its oldest packet is dropped and counted. One packet always has room,
/// whatever its size. For one thread.
class SubscriberLink {
 public:
  enum class State { kIdle, kReady, kBlocked, kBroken };

  /// Uses a duplicate of a connected socket, so that its number stays the same.
  /// @throws std::system_error if there is no such socket.
  SubscriberLink(int socket, const QueueLimits& limits);
  ~SubscriberLink();
  SubscriberLink(const SubscriberLink&) = delete;
  SubscriberLink& operator=(const SubscriberLink&) = delete;

  /// Queues a packet that is due at a time of the monotonic clock [ns].
  void add(PacketPtr packet, std::int64_t due_ns);
  /// When the next part may be written; `Wakeup::kNever` if there is none, or the link is blocked.
  std::int64_t nextWrite() const;
  /// Writes the next part, together with everything else that may be written: a system call costs
  /// more than the bytes of a small message.
  State write(std::int64_t now_ns);
  void markBroken();
  /// The subscriber accepts data again.
  void markWritable();

  State state() const { return state_; }
  int socket() const { return socket_; }
  std::size_t dropped() const { return dropped_; }

 private:
  struct Queued {
    PacketPtr packet;
    Transfer transfer;
  };

  static constexpr std::size_t kMostParts = 64;
  using Parts = std::array<iovec, kMostParts>;

  std::size_t gather(std::int64_t now_ns, Parts& parts) const;
  void dropOldest();
  void written(std::size_t bytes);

  int socket_;
  QueueLimits limits_;
  std::deque<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::size_t front_written_ = 0;  ///< of the first packet, bytes
  std::size_t dropped_ = 0;
  State state_ = State::kIdle;
};

}  // namespace process_visualizer::sender
