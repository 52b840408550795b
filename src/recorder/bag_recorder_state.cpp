// SPDX-License-Identifier: BSD-3-Clause
// What the node bag_recorder does by itself: it tells its state, and follows the master.

#include <utility>

#include "process_visualizer/recorder/bag_recorder.hpp"
#include "process_visualizer/recorder/text.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr std::chrono::milliseconds kStatePeriod(500), kMasterPeriod(1000);

unsigned valueOr0(const std::map<std::string, unsigned>& numbers, const std::string& name) {
  const auto found = numbers.find(name);
  return found == numbers.end() ? 0 : found->second;
}

}  // namespace

void BagRecorder::addProblem(const std::string& problem) {
  ROS_WARN_STREAM(problem);
  intake_.addProblem(problem);
}

void BagRecorder::setPhase(std::uint8_t phase) {
  intake_.setPhase(phase);
  state_publisher_.publish(state());
}

RecorderState BagRecorder::state() const {
  const std::map<std::string, unsigned> publishers = subscriptions_.publisherCounts();
  RecorderState state = intake_.state();
  for (TopicRecord& topic : state.topics) topic.publishers = valueOr0(publishers, topic.name);
  return state;
}

void BagRecorder::publishStates() {
  for (bool is_odd = true; turns_.waitFor(kStatePeriod); is_odd = !is_odd) {
    std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
    // A recording that has ended by itself is taken away here.
    if (command && !intake_.isWriting()) finish(std::chrono::milliseconds(0));
    if (is_odd) intake_.measureRates();
    tellSilence();
    state_publisher_.publish(state());
  }
}

void BagRecorder::tellSilence() {
  const std::vector<std::string> topics = intake_.fallenSilent();
  if (!topics.empty())
    addProblem(listed(topics) +
               ": silent, though messages came regularly; do the drivers still run? What comes "
               "again is recorded");
}

/// In a thread of its own, since a master that hangs would hold up everything else.
void BagRecorder::followMaster() {
  while (turns_.waitFor(kMasterPeriod)) lookAtMaster();
}

void BagRecorder::lookAtMaster() {
  const auto publishers = publishersAtMaster();
  const bool had_master = std::exchange(has_master_, publishers.has_value());
  if (had_master && !publishers)
    addProblem(
        "the ROS master does not answer: what is connected is still recorded, but no new "
        "publisher is found; stop the recording, then start everything anew");
  if (!publishers) return;
  const double period_s = std::chrono::duration<double>(kMasterPeriod).count();
  for (const std::string& topic : subscriptions_.followChangedTypes(*publishers, period_s))
    addProblem(topic +
               " was not connected, though it has a publisher: subscribed anew (its type "
               "may have changed)");
  followPublishers(*publishers);
}

/// Takes new topics that match a pattern, and forgets what was latched and has been replaced.
void BagRecorder::followPublishers(const Publishers& publishers) {
  const std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
  if (!command || subscriptions_.topics().empty()) return;  // another time
  if (intake_.follow(publishers, ownPrefixes())) subscriptions_.choose(intake_.sources());
}

}  // namespace process_visualizer::recorder
