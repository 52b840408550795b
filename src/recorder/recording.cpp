// SPDX-License-Identifier: BSD-3-Clause
// Thread of a recording: writes, splits and flushes bags; ends on a full disk or a removed file.

#include "process_visualizer/recorder/recording.hpp"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "process_visualizer/recorder/bag_file.hpp"

namespace process_visualizer::recorder {
namespace {

// Maximum time before a chunk is written: no more is lost if the process is killed.
constexpr std::chrono::milliseconds kFlushPeriod(500);
// Large messages may fill only this part of the queue, so a slow disk costs images before it costs
// a robot's positions.
constexpr std::size_t kLargeBytes = 64 << 10;
constexpr double kLargePart = 0.9;

std::string folderOf(const std::string& path) {
  return std::filesystem::path(path).parent_path().string();
}

}  // namespace

Recording::Recording(RecordingOptions options, RecordingContents contents, Machine machine)
    : options_(std::move(options)),
      contents_(std::move(contents)),
      machine_(std::move(machine)),
      clock_watch_(machine_) {
  status_.min_free_bytes = options_.minimum_free_bytes;
  status_.free_bytes = requireRoom(folderOf(options_.path), options_.minimum_free_bytes);
  create(contents_.recent.empty() ? machine_.now() : contents_.recent.front().time);
  // Written by the thread, like all others: they may be large.
  const std::vector<Message> latched = contents_.latched.at(file_begin_);
  contents_.recent.insert(contents_.recent.begin(), latched.begin(), latched.end());
  thread_ = std::thread(&Recording::run, this);
}

Recording::~Recording() { stop(); }

bool Recording::push(const Message& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double limit = options_.queue_bytes * (message.size() > kLargeBytes ? kLargePart : 1.0);
  if (isClosed() || queued_bytes_ + message.size() > limit) return false;
  queued_bytes_ += message.size();
  queue_.push_back(message);
  if (queue_.size() == 1) changed_.notify_one();
  return true;
}

void Recording::stop(const ros::Time& end) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!closing_) end_ = end;
    closing_ = true;
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

RecordingStatus Recording::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

bool Recording::isOver() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return isClosed();
}

void Recording::run() {
  try {
    writeAll();
  } catch (const RecordingError& error) {
    setProblem(error.what());
  }
  countUnwritten();
  try {
    close();
  } catch (const RecordingError& error) {
    setProblem(error.what());
  }
  tellEnd();
}

void Recording::writeAll() {
  for (;;) {
    current_ = take();
    if (current_)
      write(*current_);
    else if (isDone())
      return;
    current_.reset();
    look();
  }
}

/// The next message; nothing if there is none before the next check is due.
std::optional<Message> Recording::take() {
  if (!contents_.recent.empty()) {
    const Message message = contents_.recent.front();
    contents_.recent.pop_front();
    return message;
  }
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, last_look_ + kFlushPeriod - machine_.steady(),
                    [this] { return isClosed() || !queue_.empty(); });
  if (queue_.empty()) return std::nullopt;
  const Message message = queue_.front();
  queue_.pop_front();
  queued_bytes_ -= message.size();
  return message;
}

bool Recording::isDone() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return isClosed() && queue_.empty();
}

void Recording::write(const Message& message) {
  if (isFull(message.time)) {
    close();
    create(message.time);
    for (const Message& latched : contents_.latched.at(message.time)) add(latched);
  }
  contents_.latched.add(message);
  last_time_ = message.time;
  add(message);
}

/// Writes a message and counts it; the count is corrected when the bag is closed.
void Recording::add(const Message& message) {
  file_->write(message);
  const std::lock_guard<std::mutex> lock(mutex_);
  ++status_.messages[message.topic()];
  status_.bytes = finished_bytes_ + file_->size();
}

bool Recording::isFull(const ros::Time& time) const {
  return (options_.split_bytes > 0 && file_->size() >= options_.split_bytes) ||
         (options_.split_duration > 0 && (time - file_begin_).toSec() >= options_.split_duration);
}

void Recording::create(const ros::Time& time) {
  const bool is_split = options_.split_bytes > 0 || options_.split_duration > 0;
  file_ = std::make_unique<BagFile>(is_split ? partPath(options_.path, part_++) : options_.path,
                                    options_.compression);
  file_begin_ = last_time_ = time;
  const std::lock_guard<std::mutex> lock(mutex_);
  status_.files.push_back(file_->path());
}

void Recording::close() {
  if (!file_) return;  // the last part is finished, and no new one could be created
  const std::unique_ptr<BagFile> file = std::move(file_);
  std::string problem;
  try {
    std::map<std::string, std::uint64_t> unwritten = unwritten_;
    for (const auto& [topic, count] : file->discarded()) unwritten[topic] += count;
    file->write(contents_.account(std::max(last_time_, end()), clock_watch_.jumps(), unwritten));
    problem = file->finish();
  } catch (const RecordingError& error) {
    problem = std::string(error.what()) + "; " + file->path() +
              ".active holds what was written before, `rosrun process_visualizer cell reindex "
              "FILE` makes a bag of it";
  }
  for (const auto& [topic, count] : file->discarded()) unwritten_[topic] += count;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    finished_bytes_ += file->size();
    for (const auto& [topic, count] : file->counts()) finished_messages_[topic] += count;
    status_.messages = finished_messages_;
    status_.files.back() = file->path();
  }
  if (!problem.empty()) throw RecordingError(problem);
}

/// Checks everything that is due every half second. A problem that is set here only stops new
/// messages; those that have arrived are still written.
void Recording::look() {
  const SteadyTime now = machine_.steady();
  if (now - last_look_ < kFlushPeriod) return;
  last_look_ = now;
  file_->flush();
  clock_watch_.look();
  if (file_->isRemoved())
    setProblem(file_->path() +
               ".active was removed or moved while it was being written: "
               "the recording was stopped, and the bag written again");
  const std::uint64_t free = machine_.freeBytes(*file_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.free_bytes = free;
    status_.clock_jumps = clock_watch_.jumps();
  }
  if (free < options_.minimum_free_bytes)
    setProblem("the recording was stopped, because less than " +
               std::to_string(options_.minimum_free_bytes >> 20) + " MiB are free in " +
               folderOf(options_.path) + "; the bag is complete until then");
}

void Recording::setProblem(const std::string& problem) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (status_.problem.empty()) status_.problem = problem;
}

void Recording::countUnwritten() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (current_) ++unwritten_[current_->topic()];
  for (const Message& message : contents_.recent) ++unwritten_[message.topic()];
  for (const Message& message : queue_) ++unwritten_[message.topic()];
  queue_.clear();
}

ros::Time Recording::end() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return end_;
}

/// Returns whether no more messages are accepted; the mutex must be locked.
bool Recording::isClosed() const { return closing_ || !status_.problem.empty(); }

/// Notifies the owner, unless the owner ended the recording.
void Recording::tellEnd() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.ended = true;
    if (closing_) return;
  }
  contents_.on_end();
}

namespace {

constexpr std::uint64_t kRecordBytes = 64;  // overhead of a message, with its index entry

}  // namespace

std::uint64_t bagBytes(const std::deque<Message>& messages) {
  return std::accumulate(messages.begin(), messages.end(), std::uint64_t{0},
                         [](std::uint64_t bytes, const Message& message) {
                           return bytes + message.size() + kRecordBytes;
                         });
}

BagFile createWhole(const RecordingOptions& options, std::uint64_t bytes) {
  requireRoom(std::filesystem::path(options.path).parent_path(),
              options.minimum_free_bytes + bytes);
  return {options.path, options.compression};
}

void writeWhole(BagFile& file, std::deque<Message> messages) {
  try {
    // Written messages are released: images are large.
    for (; !messages.empty(); messages.pop_front()) file.write(messages.front());
    const std::string problem = file.finish(PowerCut::kMayCostAll);
    if (!problem.empty()) throw RecordingError(problem);
  } catch (...) {
    file.remove();
    throw;
  }
}

}  // namespace process_visualizer::recorder
