// SPDX-License-Identifier: BSD-3-Clause
// Thread of the sender, its schedule, and its C interface for Python.

#include "process_visualizer/sender/timed_sender.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "process_visualizer/common/time_slice.hpp"
#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer::sender {

void Agenda::set(int item, std::int64_t time_ns, std::uint64_t rank) {
  const auto place = places_.find(item);
  if (place == places_.end()) {
    if (time_ns != Wakeup::kNever) places_[item] = entries_.insert({time_ns, rank, item}).first;
    return;
  }
  auto node = entries_.extract(place->second);  // reused, as this happens with each message
  if (time_ns == Wakeup::kNever) {
    places_.erase(place);
    return;
  }
  node.value() = {time_ns, rank, item};
  place->second = entries_.insert(std::move(node)).position;
}

std::int64_t Agenda::nextTime() const {
  return entries_.empty() ? Wakeup::kNever : std::get<0>(*entries_.begin());
}

int Agenda::nextItem() const { return std::get<2>(*entries_.begin()); }

std::vector<int> Agenda::due(std::int64_t now_ns) const {
  std::vector<int> items;
  for (auto entry = entries_.begin(); entry != entries_.end() && std::get<0>(*entry) <= now_ns;
       ++entry)
    items.push_back(std::get<2>(*entry));
  return items;
}

using State = SubscriberLink::State;

namespace {

// Waking up costs more than sending a small message. If the thread would wake up more often than
// this for more than a moment, packets are sent together, at most one period late.
constexpr std::int64_t kWakePeriodNs = 100'000;
constexpr std::int64_t kWakeBurstNs = 10'000'000;

bool isBusy(State state) { return state == State::kReady || state == State::kBlocked; }

}  // namespace

TimedSender::TimedSender(std::unique_ptr<Wakeup> wakeup)
    : wakeup_(std::move(wakeup)), thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "timed sender");
}

TimedSender::~TimedSender() { close(); }

int TimedSender::addTopic(bool latch, const QueueLimits& limits) {
  const std::lock_guard lock(mutex_);
  topics_.push_back({latch, limits});
  return static_cast<int>(topics_.size()) - 1;
}

int TimedSender::addLink(int topic, int socket) {
  const std::lock_guard lock(mutex_);
  const int number = next_link_++;
  auto link = std::make_unique<SubscriberLink>(socket, topics_[topic].limits);
  wakeup_->add(link->socket(), number);
  links_[number] = std::move(link);
  topics_[topic].links.push_back(number);
  for (const Latched& it : topics_[topic].latched) enqueue(number, it.packet, it.due_ns);
  wakeup_->ring();
  return number;
}

void TimedSender::removeLink(int number) {
  const std::lock_guard lock(mutex_);
  const auto found = links_.find(number);
  if (found == links_.end()) return;
  wakeup_->remove(found->second->socket());
  busy_ -= isBusy(found->second->state());
  to_write_.set(number, Wakeup::kNever);
  dropped_by_removed_ += found->second->dropped();
  links_.erase(found);
  for (Topic& topic : topics_)
    topic.links.erase(std::remove(topic.links.begin(), topic.links.end(), number),
                      topic.links.end());
  wakeup_->ring();  // nothing may be left to send now
}

void TimedSender::send(int topic, int source, std::int64_t due_ns, PacketPtr packet) {
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  const bool at_once = due_ns <= wakeup_->now();
  due_ns = last_due_ns_ = std::max(due_ns, last_due_ns_);
  if (at_once) irrevocable_until_ns_ = due_ns;
  const Transfer transfer(packet->size(), due_ns);
  topics_[topic].scheduled.push_back({transfer, given_++, source, std::move(packet)});
  ++waiting_;
  if (topics_[topic].scheduled.size() == 1) plan(topic);
  ringBefore(start_queue_.nextTime());
}

std::size_t TimedSender::revoke(std::int64_t after_ns) {
  const std::lock_guard lock(mutex_);
  const std::int64_t until_ns = std::max(after_ns, irrevocable_until_ns_);
  const std::size_t before = waiting_;
  for (std::size_t number = 0; number < topics_.size(); ++number) {
    std::deque<Scheduled>& scheduled = topics_[number].scheduled;
    for (; !scheduled.empty() && scheduled.back().transfer.due() > until_ns; --waiting_)
      scheduled.pop_back();
    if (scheduled.empty()) plan(static_cast<int>(number));
  }
  last_due_ns_ = std::min(last_due_ns_, until_ns);
  if (isIdle()) idle_.notify_all();
  return before - waiting_;
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
  wakeup_->ring();
  idle_.notify_all();
  broken_changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void TimedSender::run() {
  if (!takeRealTimePriority()) setTimeSlice(kShortSlice);
  std::unique_lock lock(mutex_);
  std::int64_t paced_ns = 0;
  while (!closed_) {
    const std::int64_t now_ns = wakeup_->now();
    paced_ns = std::clamp(paced_ns, now_ns - kWakeBurstNs, now_ns) + kWakePeriodNs;
    while (start_queue_.nextTime() <= now_ns) beginFirst(start_queue_.nextItem());
    writeDue(now_ns);
    const std::int64_t work_ns = std::min(start_queue_.nextTime(), to_write_.nextTime());
    const std::int64_t next_ns = std::max(work_ns, paced_ns);
    waits_until_ns_ = next_ns;
    if (isIdle()) idle_.notify_all();
    lock.unlock();
    const std::vector<Wakeup::Event> events = wakeup_->waitUntil(next_ns);
    lock.lock();
    handle(events);
  }
}

/// Enqueues the first packet of a topic at its links.
void TimedSender::beginFirst(int number) {
  Topic& topic = topics_[number];
  const Scheduled scheduled = std::move(topic.scheduled.front());
  topic.scheduled.pop_front();
  topic.begun_due_ns = scheduled.transfer.due();
  irrevocable_until_ns_ = std::max(irrevocable_until_ns_, topic.begun_due_ns);
  if (topic.latch) latch(topic, scheduled);
  if (scheduled.packet->hasMessage()) {
    for (const int link : topic.links) enqueue(link, scheduled.packet, topic.begun_due_ns);
    ++topic.sent;
  }
  --waiting_;
  plan(number);
}

/// Schedules a topic's first packet: not before its predecessor is due.
void TimedSender::plan(int number) {
  const Topic& topic = topics_[number];
  if (topic.scheduled.empty()) return start_queue_.set(number, Wakeup::kNever);
  const Scheduled& first = topic.scheduled.front();
  start_queue_.set(number, std::max(first.transfer.begin(), topic.begun_due_ns), first.number);
}

/// Replaces the source's latched packet; a packet without a message only removes it.
void TimedSender::latch(Topic& topic, const Scheduled& scheduled) {
  auto& latched = topic.latched;
  const auto same = [&](const Latched& it) { return it.source == scheduled.source; };
  latched.erase(std::remove_if(latched.begin(), latched.end(), same), latched.end());
  if (scheduled.packet->hasMessage())
    latched.push_back({scheduled.source, scheduled.packet, scheduled.transfer.due()});
}

void TimedSender::enqueue(int number, const PacketPtr& packet, std::int64_t due_ns) {
  SubscriberLink& link = *links_.at(number);
  const State before = link.state();
  link.add(packet, due_ns);
  update(number, before);
}

/// Writes all parts that are due, one to each link in turn.
void TimedSender::writeDue(std::int64_t now_ns) {
  while (to_write_.nextTime() <= now_ns) {
    for (const int number : to_write_.due(now_ns)) {
      SubscriberLink& link = *links_.at(number);
      const State before = link.state();
      link.write(wakeup_->now());
      update(number, before);
    }
  }
}

/// Follows a change of a link's state.
void TimedSender::update(int number, State before) {
  const SubscriberLink& link = *links_.at(number);
  const State now = link.state();
  to_write_.set(number, link.nextWrite());
  if (now == before) return;
  busy_ += isBusy(now) - isBusy(before);
  if (now == State::kBlocked || before == State::kBlocked)
    wakeup_->watchWritable(link.socket(), number, now == State::kBlocked);
  if (now == State::kBroken) {
    wakeup_->remove(link.socket());
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

/// Wakes the thread up if it would wait beyond a time.
void TimedSender::ringBefore(std::int64_t time_ns) {
  if (time_ns >= waits_until_ns_) return;
  waits_until_ns_ = time_ns;  // rings only once
  wakeup_->ring();
}

}  // namespace process_visualizer::sender

// The functions used by process_visualizer/player/timed_sender.py

using process_visualizer::sender::Packet;
using process_visualizer::sender::TimedSender;

extern "C" {

void timed_sender_take_long_slices() {
  process_visualizer::setTimeSlice(process_visualizer::kLongSlice);
}

/// Returns null if the system has no more descriptors or threads.
TimedSender* timed_sender_new() {
  try {
    return new TimedSender;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "timed sender: %s\n", error.what());
    return nullptr;
  }
}

void timed_sender_delete(TimedSender* sender) { delete sender; }

int timed_sender_add_topic(TimedSender* sender, int latch, std::size_t packets, std::size_t bytes) {
  return sender->addTopic(latch != 0, {packets, bytes});
}

/// Returns -1 if there is no such socket any more.
int timed_sender_add_link(TimedSender* sender, int topic, int socket) {
  try {
    return sender->addLink(topic, socket);
  } catch (const std::exception&) {
    return -1;
  }
}

void timed_sender_remove_link(TimedSender* sender, int link) { sender->removeLink(link); }

void timed_sender_send(TimedSender* sender, int topic, int source, std::int64_t due_ns,
                       const char* message, std::size_t size) {
  sender->send(topic, source, due_ns, std::make_shared<const Packet>(message, size));
}

void timed_sender_withdraw(TimedSender* sender, int topic, int source, std::int64_t due_ns) {
  sender->send(topic, source, due_ns, std::make_shared<const Packet>());
}

std::size_t timed_sender_revoke(TimedSender* sender, std::int64_t after_ns) {
  return sender->revoke(after_ns);
}

std::size_t timed_sender_sent(TimedSender* sender, int topic) { return sender->sent(topic); }

std::size_t timed_sender_dropped(TimedSender* sender) { return sender->dropped(); }

int timed_sender_wait_until_sent(TimedSender* sender, double timeout_s) {
  return sender->waitUntilSent(timeout_s) ? 1 : 0;
}

int timed_sender_wait_for_broken(TimedSender* sender) { return sender->waitForBroken(); }

void timed_sender_close(TimedSender* sender) { sender->close(); }
}
