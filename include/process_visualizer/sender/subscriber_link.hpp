// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Connection to one subscriber: slices of large messages, and messages that a full queue drops.

#include <sys/uio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

namespace process_visualizer::sender {

/// A message in the format of TCPROS: its length (uint32, little-endian), then its bytes.
class Packet {
 public:
  Packet() = default;  ///< no message: removes a source's latched one
  Packet(const char* message, std::size_t size);

  bool hasMessage() const { return size_ > 0; }

  const char* data() const { return bytes_.get(); }
  std::size_t size() const { return size_; }  ///< with the length before the message

 private:
  std::size_t size_ = 0;
  std::unique_ptr<char[]> bytes_;
};

/// A packet shared by all subscribers of a topic.
using PacketPtr = std::shared_ptr<const Packet>;

/// The times at which parts of a packet are written. A subscriber has a message once its last byte
/// has arrived, so a large one is sent in slices before it is due, except for its last byte. It
/// arrives on time, and small messages between the slices do not wait for it. Times are in
/// nanoseconds.
class Transfer {
 public:
  Transfer(std::size_t size, std::int64_t due_ns);

  std::int64_t due() const { return due_ns_; }
  /// Time from which the first byte may be written.
  std::int64_t begin() const { return timeOf(0); }
  /// Time from which the part after the written bytes may be written.
  std::int64_t timeOf(std::size_t written) const;
  /// Size of that part at a time when it may be written, bytes.
  std::size_t sizeOf(std::size_t written, std::int64_t now_ns) const;

 private:
  std::size_t size_;
  std::int64_t due_ns_;
  std::size_t slice_bytes_;
};

/// Limits of the queue for a subscriber that cannot keep up.
struct QueueLimits {
  std::size_t packets;
  std::size_t bytes;
};

/// The connection to one subscriber. Its functions never block: packets wait in a queue; when that
/// is full, the oldest one is dropped and counted. One packet always has room, whatever its size.
/// Not thread-safe.
class SubscriberLink {
 public:
  enum class State { kIdle, kReady, kBlocked, kBroken };

  /// Duplicates a connected socket, so that the socket's number stays valid.
  /// @throws std::system_error if there is no such socket.
  SubscriberLink(int socket, const QueueLimits& limits);
  ~SubscriberLink();
  SubscriberLink(const SubscriberLink&) = delete;
  SubscriberLink& operator=(const SubscriberLink&) = delete;

  /// Queues a packet that is due at a time of the monotonic clock [ns].
  void add(PacketPtr packet, std::int64_t due_ns);
  /// Time from which the next part may be written; `Wakeup::kNever` if there is none, or the link
  /// is blocked.
  std::int64_t nextWrite() const;
  /// Writes the next part and all others that may be written now, in one system call: a call costs
  /// more than the bytes of a small message.
  State write(std::int64_t now_ns);
  void markBroken();
  /// Notes that the subscriber accepts data again.
  void markWritable();

  State state() const { return state_; }
  int socket() const { return socket_; }
  std::size_t dropped() const { return dropped_; }

 private:
  struct Queued {
    PacketPtr packet;
    Transfer transfer;
  };

  static constexpr std::size_t kMaxParts = 64;
  using Parts = std::array<iovec, kMaxParts>;

  std::size_t gather(std::int64_t now_ns, Parts& parts) const;
  void dropOldest();
  void written(std::size_t bytes);

  int socket_;
  QueueLimits limits_;
  std::deque<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::size_t front_written_ = 0;  ///< bytes of the first packet
  std::size_t dropped_ = 0;
  State state_ = State::kIdle;
};

}  // namespace process_visualizer::sender
