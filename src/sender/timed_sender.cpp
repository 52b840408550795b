#include "process_visualizer/sender/timed_sender.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <utility>

#include "process_visualizer/sender/time_slice.hpp"

namespace process_visualizer {

using State = SubscriberLink::State;

namespace {

bool isBusy(State state) { return state == State::kReady || state == State::kBlocked; }

}  // namespace

std::int64_t monotonicNow() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * INT64_C(1'000'000'000) + now.tv_nsec;
}

TimedSender::TimedSender() : thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "timed sender");
}

TimedSender::~TimedSender() { close(); }

int TimedSender::addTopic(bool latch, const QueueLimits& limits) {
  const std::lock_guard lock(mutex_);
  topics_.push_back({latch, limits, {}, {}, 0});
  return static_cast<int>(topics_.size()) - 1;
}

int TimedSender::addLink(int topic, int socket) {
  const std::lock_guard lock(mutex_);
  const int number = next_link_++;
  auto link = std::make_unique<SubscriberLink>(socket, topics_[topic].limits);
  wakeup_.add(link->socket(), number);
  links_[number] = std::move(link);
  topics_[topic].links.push_back(number);
  for (const auto& [source, packet] : topics_[topic].latched) give(number, packet, 0);
  wakeup_.ring();
  return number;
}

void TimedSender::removeLink(int number) {
  const std::lock_guard lock(mutex_);
  const auto found = links_.find(number);
  if (found == links_.end()) return;
  wakeup_.remove(found->second->socket());
  busy_ -= isBusy(found->second->state());
  dropped_by_removed_ += found->second->dropped();
  links_.erase(found);
  for (Topic& topic : topics_)
    topic.links.erase(std::remove(topic.links.begin(), topic.links.end(), number),
                      topic.links.end());
  wakeup_.ring();  // everything may have gone now
}

void TimedSender::send(int topic, int source, std::int64_t due_ns, PacketPtr packet) {
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  if (!scheduled_.empty()) due_ns = std::max(due_ns, scheduled_.back().transfer.due());
  const Transfer transfer(packet->size(), due_ns);
  scheduled_.push_back({transfer, topic, source, std::move(packet)});
  if (transfer.begin() < waits_until_ns_) wakeup_.ring();
}

std::size_t TimedSender::revoke(std::int64_t after_ns) {
  const std::lock_guard lock(mutex_);
  std::size_t count = 0;
  while (!scheduled_.empty() && scheduled_.back().packet &&
         scheduled_.back().transfer.due() > after_ns) {
    scheduled_.pop_back();
    ++count;
  }
  if (isIdle()) idle_.notify_all();
  return count;
}

std::size_t TimedSender::sent(int topic) const {
  const std::lock_guard lock(mutex_);
  return topics_[topic].sent;
}

std::size_t TimedSender::dropped() const {
  const std::lock_guard lock(mutex_);
  std::size_t count = dropped_by_removed_;
  for (const auto& [number, link] : links_) count += link->dropped();
  return count;
}

bool TimedSender::waitUntilSent(double timeout_s) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, std::chrono::duration<double>(timeout_s), [this] {
    return closed_ || isIdle();
  }) && isIdle();
}

int TimedSender::waitForBroken() {
  std::unique_lock lock(mutex_);
  broken_changed_.wait(lock, [this] { return closed_ || !broken_.empty(); });
  if (closed_) return -1;
  const int number = broken_.front();
  broken_.pop_front();
  return number;
}

void TimedSender::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  wakeup_.ring();
  idle_.notify_all();
  broken_changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void TimedSender::run() {
  if (!takeRealTimePriority()) takeSlices(kShortSlice);
  std::unique_lock lock(mutex_);
  while (!closed_) {
    const std::int64_t begin_ns = beginScheduled();
    const std::int64_t next_ns = std::min(begin_ns, writeToLinks());
    waits_until_ns_ = next_ns;
    if (isIdle()) idle_.notify_all();
    lock.unlock();
    const std::vector<Wakeup::Event> events = wakeup_.waitUntil(next_ns);
    lock.lock();
    handle(events);
  }
}

/// Gives the links what may be begun; returns when the next packet may be.
std::int64_t TimedSender::beginScheduled() {
  const std::int64_t now_ns = monotonicNow();
  std::int64_t next_ns = Wakeup::kNever;
  for (Scheduled& scheduled : scheduled_) {
    if (scheduled.packet && scheduled.transfer.begin() <= now_ns) begin(scheduled);
    if (scheduled.packet) next_ns = std::min(next_ns, scheduled.transfer.begin());
  }
  while (!scheduled_.empty() && scheduled_.front().transfer.due() <= now_ns) scheduled_.pop_front();
  return next_ns;
}

void TimedSender::begin(Scheduled& scheduled) {
  Topic& topic = topics_[scheduled.topic];
  if (topic.latch) topic.latched[scheduled.source] = scheduled.packet;
  for (const int number : topic.links) give(number, scheduled.packet, scheduled.transfer.due());
  ++topic.sent;
  scheduled.packet = nullptr;
}

void TimedSender::give(int number, const PacketPtr& packet, std::int64_t due_ns) {
  SubscriberLink& link = *links_.at(number);
  const State before = link.state();
  link.add(packet, due_ns);
  update(number, before);
}

/// Writes a part to each link that may be written to; returns when the next part may be written.
std::int64_t TimedSender::writeToLinks() {
  std::int64_t next_ns = Wakeup::kNever;
  for (const auto& [number, link] : links_) {
    const std::int64_t now_ns = monotonicNow();
    if (link->nextWrite() <= now_ns) {
      const State before = link->state();
      link->write(now_ns);
      update(number, before);
    }
    next_ns = std::min(next_ns, link->nextWrite());
  }
  return next_ns;
}

void TimedSender::update(int number, State before) {
  const SubscriberLink& link = *links_.at(number);
  const State now = link.state();
  if (now == before) return;
  busy_ += isBusy(now) - isBusy(before);
  if (now == State::kBlocked || before == State::kBlocked)
    wakeup_.watchWritable(link.socket(), number, now == State::kBlocked);
  if (now == State::kBroken) {
    wakeup_.remove(link.socket());
    broken_.push_back(number);
    broken_changed_.notify_all();
  }
}

void TimedSender::handle(const std::vector<Wakeup::Event>& events) {
  for (const Wakeup::Event& event : events) {
    const auto found = links_.find(event.number);
    if (found == links_.end()) continue;  // removed meanwhile
    const State before = found->second->state();
    event.broken ? found->second->markBroken() : found->second->markWritable();
    update(event.number, before);
  }
}

}  // namespace process_visualizer
