// SPDX-License-Identifier: BSD-3-Clause
// What the node bag_recorder does by itself: it tells its state, and follows the master.

#include <utility>

#include "process_visualizer/recorder/bag_recorder.hpp"
#include "process_visualizer/recorder/text.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr std::size_t kProblems = 20;  ///< that are remembered
constexpr std::chrono::milliseconds kStatePeriod(500), kMasterPeriod(1000);

template <typename Number>
Number valueOr0(const std::map<std::string, Number>& numbers, const std::string& name) {
  const auto found = numbers.find(name);
  return found == numbers.end() ? 0 : found->second;
}

}  // namespace

void BagRecorder::addProblem(const std::string& problem) {
  ROS_WARN_STREAM(problem);
  const std::lock_guard<std::mutex> lock(mutex_);
  problems_.push_back(problem);
  ++problem_count_;
  if (problems_.size() > kProblems) problems_.erase(problems_.begin());
}

void BagRecorder::setPhase(std::uint8_t phase) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    phase_ = phase;
  }
  state_publisher_.publish(state());
}

RecorderState BagRecorder::state() const {
  const std::map<std::string, unsigned> publishers = subscriptions_.publisherCounts();
  RecorderState state;
  const std::lock_guard<std::mutex> lock(mutex_);
  state.stamp = ros::Time::now();
  state.state = phase_;
  state.topics = board_.records(choice_.names());
  const auto written = last_ ? last_->status().messages : std::map<std::string, std::uint64_t>();
  for (const auto& [topic, count] : written) state.messages += count;
  for (TopicRecord& topic : state.topics) {
    topic.publishers = valueOr0(publishers, topic.name);
    if (last_) topic.messages = valueOr0(written, topic.name);
    if (!last_) state.messages += topic.messages;
    state.dropped += topic.dropped;
    state.lost += topic.lost;
    state.gaps += topic.gaps;
  }
  state.rate = board_.byteRate();
  state.recent = recent_.duration();
  state.recent_bytes = recent_.bytes();
  state.problems = problems_;
  state.problem_count = problem_count_;
  state.time_left = -1;
  if (!last_) return state;
  const RecordingStatus status = last_->status();
  const ros::SteadyTime end = recording_ ? ros::SteadyTime::now() : end_;
  state.files = status.files;
  state.bytes = status.bytes;
  state.duration = (end - begin_).toSec();
  state.free_bytes = status.free_bytes;
  const double room = static_cast<double>(status.free_bytes) - status.least_free_bytes;
  if (recording_ && state.rate > 0) state.time_left = std::max(room, 0.0) / state.rate;
  return state;
}

/// Waits for a period, or less if there is something to do at once; returns false at the end.
bool BagRecorder::waitFor(std::chrono::milliseconds period) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!shutting_down_) wake_.wait_for(lock, period);
  return !shutting_down_;
}

void BagRecorder::publishStates() {
  for (bool is_odd = true; waitFor(kStatePeriod); is_odd = !is_odd) {
    std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
    // A recording that has ended by itself is taken away here.
    if (command && last_ && last_->status().ended) finish(std::chrono::milliseconds(0));
    if (is_odd) {
      const std::lock_guard<std::mutex> lock(mutex_);
      board_.measureRates();
    }
    tellSilence();
    state_publisher_.publish(state());
  }
}

void BagRecorder::tellSilence() {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!recording_) return;
  const std::vector<std::string> topics = board_.fallenSilent();
  lock.unlock();
  if (!topics.empty())
    addProblem(joined(topics, ", ") +
               ": silent, though messages came regularly; do the drivers still run? What comes "
               "again is recorded");
}

/// In a thread of its own, since a master that hangs would hold up everything else.
void BagRecorder::followMaster() {
  while (waitFor(kMasterPeriod)) lookAtMaster();
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
  std::unique_lock<std::mutex> lock(mutex_);
  recent_.forgetReplaced([&publishers](const Message& message) {
    const auto nodes = publishers.find(message.topic());
    return nodes == publishers.end() ||
           nodes->second.count(message.connection->field("callerid")) == 0;
  });
  const bool is_new = choice_.follow(publishers, ownPrefixes());
  lock.unlock();
  if (is_new) subscribe();
}

}  // namespace process_visualizer::recorder
