// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/sender/subscriber_link.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer::sender {

namespace {

int duplicated(int socket) {
  const int copy = fcntl(socket, F_DUPFD_CLOEXEC, 0);
  if (copy < 0) throw std::system_error(errno, std::generic_category(), "a subscriber's socket");
  return copy;
}

}  // namespace

SubscriberLink::SubscriberLink(int socket, const QueueLimits& limits)
    : socket_(duplicated(socket)), limits_(limits) {
  const int on = 1;  // fails for sockets that do not wait to fill their packets anyway
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

/// The next parts that may be written at a time; returns how many. All but the last of them end
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
  // A packet that has been begun must be finished, or the subscriber would not know where it is.
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
