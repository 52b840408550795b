// SPDX-License-Identifier: BSD-3-Clause
// Times at which slices of a message are written, and handling of slow or broken subscribers.

#include "process_visualizer/sender/subscriber_link.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer::sender {

Packet::Packet(const char* message, std::size_t size)
    : size_(size + sizeof(std::uint32_t)), bytes_(new char[size_]) {
  for (std::size_t byte = 0; byte < sizeof(std::uint32_t); ++byte)
    bytes_[byte] = static_cast<char>(size >> (8 * byte));
  if (size > 0) std::memcpy(bytes_.get() + sizeof(std::uint32_t), message, size);
}

namespace {

constexpr std::size_t kSmallBytes = 32 << 10;  // up to this size, written at once when due
constexpr std::size_t kSliceBytes = 128 << 10;
constexpr std::int64_t kSliceNs = 500'000;  // time for a subscriber to take a slice
constexpr std::size_t kMaxSlices = 16;      // a command takes effect only after a begun message

std::size_t quotientUp(std::size_t dividend, std::size_t divisor) {
  return (dividend + divisor - 1) / divisor;
}

}  // namespace

Transfer::Transfer(std::size_t size, std::int64_t due_ns)
    : size_(size),
      due_ns_(due_ns),
      slice_bytes_(std::max(kSliceBytes, quotientUp(size, kMaxSlices))) {}

std::int64_t Transfer::timeOf(std::size_t written) const {
  if (size_ <= kSmallBytes || written + 1 >= size_) return due_ns_;
  const std::size_t slices = quotientUp(size_ - 1 - written, slice_bytes_);
  return due_ns_ - static_cast<std::int64_t>(slices) * kSliceNs;
}

std::size_t Transfer::sizeOf(std::size_t written, std::int64_t now_ns) const {
  const std::size_t rest = size_ - written;
  return now_ns >= due_ns_ ? rest : std::min(rest - 1, slice_bytes_);
}

namespace {

int duplicated(int socket) {
  const int copy = fcntl(socket, F_DUPFD_CLOEXEC, 0);
  if (copy < 0) throw std::system_error(errno, std::generic_category(), "a subscriber's socket");
  return copy;
}

}  // namespace

SubscriberLink::SubscriberLink(int socket, const QueueLimits& limits)
    : socket_(duplicated(socket)), limits_(limits) {
  const int on = 1;  // fails for sockets that are not TCP, which need no such option
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
}

SubscriberLink::~SubscriberLink() { close(socket_); }

void SubscriberLink::add(PacketPtr packet, std::int64_t due_ns) {
  if (state_ == State::kBroken) return;
  queued_bytes_ += packet->size();
  const Transfer transfer(packet->size(), due_ns);
  queue_.push_back({std::move(packet), transfer});
  while (queue_.size() > limits_.packets || queued_bytes_ > limits_.bytes) {
    const std::size_t begun = front_written_ > 0 ? 1 : 0;
    if (queue_.size() <= begun + 1) break;
    dropOldest();
  }
  if (state_ == State::kIdle) state_ = State::kReady;
}

std::int64_t SubscriberLink::nextWrite() const {
  if (state_ != State::kReady) return Wakeup::kNever;
  return queue_.front().transfer.timeOf(front_written_);
}

SubscriberLink::State SubscriberLink::write(std::int64_t now_ns) {
  Parts parts;
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = gather(now_ns, parts);
  const ssize_t count = sendmsg(socket_, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
  if (count >= 0)
    written(static_cast<std::size_t>(count));
  else if (errno == EAGAIN || errno == EWOULDBLOCK)
    state_ = State::kBlocked;
  else if (errno != EINTR)
    markBroken();
  return state_;
}

/// Collects the next parts that may be written; returns their number. All but the last complete
/// their packets.
std::size_t SubscriberLink::gather(std::int64_t now_ns, Parts& parts) const {
  std::size_t count = 0, begin = front_written_;
  for (auto it = queue_.begin(); it != queue_.end() && count < parts.size(); ++it, begin = 0) {
    if (count > 0 && it->transfer.timeOf(0) > now_ns) break;
    const std::size_t size = it->transfer.sizeOf(begin, now_ns);
    parts[count++] = {const_cast<char*>(it->packet->data()) + begin, size};
    if (begin + size < it->packet->size()) break;
  }
  return count;
}

void SubscriberLink::markBroken() {
  state_ = State::kBroken;
  queue_.clear();
}

void SubscriberLink::markWritable() {
  if (state_ == State::kBlocked) state_ = State::kReady;
}

void SubscriberLink::dropOldest() {
  // A packet that has been begun must be finished, or the subscriber would lose its place in the
  // stream.
  const auto oldest = queue_.begin() + (front_written_ > 0 ? 1 : 0);
  queued_bytes_ -= oldest->packet->size();
  queue_.erase(oldest);
  ++dropped_;
}

void SubscriberLink::written(std::size_t bytes) {
  front_written_ += bytes;
  while (!queue_.empty() && front_written_ >= queue_.front().packet->size()) {
    const std::size_t size = queue_.front().packet->size();
    front_written_ -= size;
    queued_bytes_ -= size;
    queue_.pop_front();
  }
  if (queue_.empty()) state_ = State::kIdle;
}

}  // namespace process_visualizer::sender
