// SPDX-License-Identifier: BSD-3-Clause
// Passes messages on, and composes the contents of a recording, of a copy, and of the state.

#include "process_visualizer/recorder/intake.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "process_visualizer/recorder/topic_statistics.hpp"

namespace process_visualizer::recorder {
namespace {

using Lock = std::lock_guard<std::mutex>;

constexpr std::size_t kMarksKept = 1000;  // to recognize repeated ones

}  // namespace

Intake::Intake(const std::string& node, RecentMessages recent, std::function<void()> on_end,
               Machine machine)
    : own_(node),
      on_end_(std::move(on_end)),
      machine_(std::move(machine)),
      board_(machine_.steady()),
      recent_(std::move(recent)) {}

// Topics

void Intake::choose(TopicChoice choice) {
  const Lock lock(mutex_);
  choice_ = std::move(choice);
}

TopicChoice Intake::choice() const {
  const Lock lock(mutex_);
  return choice_;
}

std::set<std::string> Intake::sources() const {
  const Lock lock(mutex_);
  std::set<std::string> names = choice_.names();
  if (!choice_.isEmpty()) names.insert(FixedFrames::kSource);
  return names;
}

bool Intake::follow(const Publishers& publishers, const std::vector<std::string>& own_prefixes) {
  const Lock lock(mutex_);
  recent_.forgetReplaced([&publishers](const Message& message) {
    const auto nodes = publishers.find(message.topic());
    return nodes == publishers.end() ||
           nodes->second.count(message.connection->field("callerid")) == 0;
  });
  return choice_.follow(publishers, own_prefixes);
}

// Messages

void Intake::receive(Message message) {
  const Lock lock(mutex_);
  // Simulated time can restart at zero, which is not valid in a bag.
  if (is_open_) message.time = std::max(message.time, ros::TIME_MIN);
  if (const auto frames = fixed_frames_.copyOf(message)) take(*frames);
  if (choice_.contains(message.topic())) take(message);
}

bool Intake::mark(const ros::Time& time, const std::string& label) {
  const Lock lock(mutex_);
  if (marks_.count({time, label}) > 0) return true;
  if (!take(textMessage(own_.marks, time, label))) return false;
  marks_.emplace(time, label);
  if (marks_.size() > kMarksKept) marks_.erase(marks_.begin());
  return true;
}

/// Gives a message to the memory and to the recording; the mutex must be locked. Returns whether it
/// is kept: by the recording, if there is one, else by the memory.
bool Intake::take(const Message& message) {
  if (is_open_ && recording_->isOver()) board_.freeze();  // this message is not in it
  const bool is_taken = is_open_ ? recording_->push(message) : recent_.isKept();
  recent_.add(message);
  if (is_open_) recent_.setRecorded();
  board_.add(message, is_taken || !is_open_);
  return is_taken;
}

// Recordings

void Intake::begin(const RecordingOptions& options, const Preamble& preamble) {
  const Lock lock(mutex_);  // no message comes between the past and the recording
  open(options, contents(preamble, machine_.now()));
}

/// Messages wait while the lock is held, so none in memory is later than this moment, at which the
/// bag ends.
void Intake::save(const RecordingOptions& options, const Preamble& preamble) {
  const Lock lock(mutex_);
  const ros::Time now = machine_.now();
  RecordingContents saved = contents(preamble, now);
  if (saved.recent.empty())
    throw RecordingError("nothing from that time is in memory: are the devices running?");
  const ros::Duration reach = now - saved.recent.front().time;
  open(options, std::move(saved));
  begin_ -= std::chrono::nanoseconds(reach.toNSec());  // its duration is that of the memory
  end(now);
}

/// Returns the contents of a recording that begins now; the mutex must be locked.
RecordingContents Intake::contents(const Preamble& preamble, const ros::Time& now) {
  Past past = chosen(recent_.last(now, preamble.recent_s), preamble.choice, now);
  RecordingContents contents;
  contents.latched = withConfiguration(std::move(past.latched), preamble.configuration, now);
  contents.recent = std::move(past.messages);
  contents.account = [this](const auto& time, const auto& jumps, const auto& unwritten) {
    const Lock lock(mutex_);
    return textMessage(own_.account, time, accountText(board_.statistics(), jumps, unwritten));
  };
  contents.on_end = on_end_;
  return contents;
}

/// Keeps the chosen topics and the recorder's own messages.
Past Intake::chosen(Past past, const TopicChoice& choice, const ros::Time& now) const {
  std::map<ConnectionPtr, bool> known;  // patterns are matched once per connection
  const auto is_chosen = [&](const Message& message) {
    const auto [entry, is_new] = known.try_emplace(message.connection, true);
    if (is_new)
      entry->second = message.connection == own_.marks || FixedFrames::isCopy(message.topic()) ||
                      choice.wouldTake(message.topic());
    return entry->second;
  };
  LatchedMessages latched;
  for (const Message& message : past.latched.at(now))
    if (is_chosen(message)) latched.add(message);
  past.latched = std::move(latched);
  past.messages.erase(
      std::remove_if(past.messages.begin(), past.messages.end(), std::not_fn(is_chosen)),
      past.messages.end());
  return past;
}

LatchedMessages Intake::withConfiguration(LatchedMessages latched, const std::string& configuration,
                                          const ros::Time& now) const {
  if (!configuration.empty()) latched.add(textMessage(own_.configuration, now, configuration));
  return latched;
}

/// Begins a recording; the mutex must be locked.
void Intake::open(const RecordingOptions& options, RecordingContents contents) {
  const std::deque<Message> past = contents.recent;
  recording_ = std::make_shared<Recording>(options, std::move(contents), machine_);
  is_open_ = true;
  recent_.setRecorded();
  marks_.clear();
  board_.begin({choice_.names().begin(), choice_.names().end()});
  for (const Message& message : past) board_.add(message, true);
  problems_.clear();
  begin_ = end_ = machine_.steady();
}

std::deque<Message> Intake::copy(const Preamble& preamble) const {
  Past all;
  ros::Time now;
  {
    const Lock lock(mutex_);  // only while pointers are copied: messages keep arriving
    now = machine_.now();
    all = recent_.all(now, preamble.recent_s);
  }
  Past past = chosen(std::move(all), preamble.choice, now);
  if (past.latched.isEmpty() && past.messages.empty())
    throw RecordingError(
        "nothing from these topics is in memory, and nothing is latched: are the devices running?");
  std::deque<Message> messages = std::move(past.messages);
  messages.push_back(accountOf(messages, preamble.choice, now));
  const auto before = withConfiguration(std::move(past.latched), preamble.configuration, now)
                          .at(messages.front().time);
  messages.insert(messages.begin(), before.begin(), before.end());
  return messages;
}

/// The account of messages all of which were received and written.
Message Intake::accountOf(const std::deque<Message>& messages, const TopicChoice& choice,
                          const ros::Time& now) const {
  std::map<std::string, TopicStatistics> statistics;
  for (const std::string& topic : choice.names()) statistics[topic];
  for (const Message& message : messages) statistics[message.topic()].add(message);
  const ros::Time end = messages.empty() ? ros::Time() : messages.back().time;
  return textMessage(own_.account, std::max(end, now), accountText(statistics, {}, {}));
}

void Intake::close() {
  const Lock lock(mutex_);
  end(machine_.now());
}

/// Ends the recording: later messages are not in it. The mutex must be locked.
void Intake::end(const ros::Time& now) {
  is_open_ = false;
  board_.freeze();
  problems_.settle();
  end_ = machine_.steady();
  last_time_ = now;
}

std::string Intake::finish() {
  recording_->stop(last_time_);  // not locked: its thread needs the mutex
  const Lock lock(mutex_);
  board_.addDropped(recording_->unwritten());
  return recording_->status().problem;
}

bool Intake::isOpen() const {
  const Lock lock(mutex_);
  return is_open_;
}

bool Intake::isWriting() const {
  const Lock lock(mutex_);
  return recording_ && !recording_->status().ended;
}

RecordingStatus Intake::status() const {
  const Lock lock(mutex_);
  return recording_->status();
}

void Intake::forget() {
  const Lock lock(mutex_);
  recent_.forget();
}

NumberedMessages Intake::recent(const MessageQuery& query) const {
  const Lock lock(mutex_);
  return recent_.matching(query);
}

// State

void Intake::setPhase(std::uint8_t phase) {
  const Lock lock(mutex_);
  phase_ = phase;
}

void Intake::addProblem(const std::string& problem, const std::string& present) {
  const Lock lock(mutex_);
  problems_.add(problem, is_open_ ? present : "");
}

void Intake::measureRates() {
  const Lock lock(mutex_);
  board_.measureRates(machine_.steady());
}

std::vector<std::string> Intake::fallenSilent() {
  const Lock lock(mutex_);
  if (!is_open_) return {};
  std::vector<std::string> topics = board_.fallenSilent(machine_.now());
  if (!board_.hasSilent()) problems_.settle();
  return topics;
}

RecorderState Intake::state() const {
  const Lock lock(mutex_);
  RecorderState state;
  state.stamp = machine_.now();
  state.state = phase_;
  state.rate = board_.byteRate();
  state.recent = recent_.ageOfOldestUnrecorded(state.stamp);
  state.recent_bytes = recent_.bytes();
  state.remembered = recent_.age();
  state.problems = problems_.texts();
  state.problem_count = problems_.count();
  state.time_left = -1;
  fillTopics(state);
  if (recording_) fillRecording(state);
  return state;
}

void Intake::fillTopics(RecorderState& state) const {
  state.topics = board_.records(choice_.names(), state.stamp);
  for (const TopicRecord& topic : state.topics) {
    state.messages += topic.messages;
    state.dropped += topic.dropped;
    state.lost += topic.lost;
    state.gaps += topic.gaps;
  }
}

void Intake::fillRecording(RecorderState& state) const {
  const RecordingStatus status = recording_->status();
  const SteadyTime end = is_open_ ? machine_.steady() : end_;
  state.files = status.files;
  state.bytes = status.bytes;
  state.duration = std::chrono::duration<double>(end - begin_).count();
  state.free_bytes = status.free_bytes;
  const double room = static_cast<double>(status.free_bytes) - status.min_free_bytes;
  if (is_open_ && state.rate > 0) state.time_left = std::max(room, 0.0) / state.rate;
  state.messages = 0;  // those in the files, including the recorder's own
  for (const auto& [topic, count] : status.messages) state.messages += count;
  for (TopicRecord& topic : state.topics) {
    const auto written = status.messages.find(topic.name);
    topic.messages = written == status.messages.end() ? 0 : written->second;
  }
}

}  // namespace process_visualizer::recorder
