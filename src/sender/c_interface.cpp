// SPDX-License-Identifier: BSD-3-Clause
// The functions by which process_visualizer/player/timed_sender.py uses TimedSender.

#include <cstdio>
#include <exception>
#include <memory>

#include "process_visualizer/common/time_slice.hpp"
#include "process_visualizer/sender/timed_sender.hpp"

using process_visualizer::sender::Packet;
using process_visualizer::sender::TimedSender;

extern "C" {

void timed_sender_take_long_slices() {
  process_visualizer::takeSlices(process_visualizer::kLongSlice);
}

/// Null if the system has no more descriptors or threads.
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

/// -1 if there is no such socket any more.
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
