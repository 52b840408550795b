// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One recording: the queue, the thread that writes it into bags, splitting, and limits of the disk.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/machine.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"

namespace process_visualizer::recorder {

struct RecordingOptions {
  std::string path;
  Compression compression = Compression::kNone;
  std::uint64_t split_bytes = 0;  ///< 0: no limit
  double split_duration = 0;      ///< s; 0: no limit
  std::uint64_t queue_bytes = 512 << 20;
  std::uint64_t minimum_free_bytes = 1 << 30;
};

/// Contents of a recording besides the arriving messages.
struct RecordingContents {
  LatchedMessages latched;     ///< every bag begins with these
  std::deque<Message> recent;  ///< then with these
  /// Creates the last message of every bag, an account of the losses so far. Takes its time, the
  /// jumps of the clock, and the number of unwritten messages by topic.
  std::function<Message(const ros::Time&, const std::vector<ClockJump>&,
                        const std::map<std::string, std::uint64_t>&)>
      account;
  std::function<void()> on_end;  ///< called by the writing thread when it ends on its own
};

/// Progress of a recording.
struct RecordingStatus {
  std::vector<std::string> files;  ///< the bags, the one being written last
  std::uint64_t bytes = 0;         ///< written, in all files
  /// Number of messages in all files by topic, including the recorder's own.
  std::map<std::string, std::uint64_t> messages;
  std::uint64_t free_bytes = 0;      ///< on the disk
  std::uint64_t min_free_bytes = 0;  ///< limit below which the recording ends
  std::string problem;               ///< reason if it ended on its own; else empty
  bool ended = false;
  std::vector<ClockJump> clock_jumps;
};

/// A recording: a queue bounded in bytes, and a thread that writes it into bags.
class Recording {
 public:
  /// Opens the first bag and starts to write. \throws RecordingError
  Recording(RecordingOptions options, RecordingContents contents, Machine machine = {});
  ~Recording();

  /// Queues a message; returns false if it is dropped because the queue is full or closed.
  bool push(const Message& message);

  /// Writes everything that was pushed, and finishes the bag. May be called twice.
  /// \param end when the recording ended, which may be long ago if much remains to be written;
  ///   zero: at its last message
  void stop(const ros::Time& end = {});

  bool isOver() const;  ///< true once it accepts no more messages
  RecordingStatus status() const;
  /// Number of messages that were pushed but not written, by topic; to be called after stop().
  const std::map<std::string, std::uint64_t>& unwritten() const { return unwritten_; }

 private:
  void run();
  void writeAll();
  void write(const Message& message);
  void add(const Message& message);
  void create(const ros::Time& time);
  void close();
  bool isFull(const ros::Time& time) const;
  std::optional<Message> take();
  bool isDone() const;
  bool isClosed() const;
  void look();
  void setProblem(const std::string& problem);
  void countUnwritten();
  ros::Time end() const;
  void tellEnd();

  const RecordingOptions options_;
  RecordingContents contents_;
  const Machine machine_;
  std::unique_ptr<BagFile> file_;
  ros::Time file_begin_, last_time_;
  unsigned part_ = 0;
  ClockWatch clock_watch_;
  SteadyTime last_look_;
  std::optional<Message> current_;  ///< no longer in the queue, and not yet in the bag
  std::map<std::string, std::uint64_t> unwritten_;

  mutable std::mutex mutex_;  ///< guards the members below
  std::condition_variable changed_;
  std::deque<Message> queue_;
  std::uint64_t queued_bytes_ = 0;
  bool closing_ = false;
  ros::Time end_;  ///< given to stop()
  std::uint64_t finished_bytes_ = 0;
  std::map<std::string, std::uint64_t> finished_messages_;
  RecordingStatus status_;
  std::thread thread_;
};

/// Returns the approximate size of a bag of these messages, uncompressed.
std::uint64_t bagBytes(const std::deque<Message>& messages);

/// Creates the file for a bag of this size, if a recording on the same disk can continue after it.
/// \throws RecordingError if there is no room for both
BagFile createWhole(const RecordingOptions& options, std::uint64_t bytes);

/// Writes messages and finishes the bag, without waiting for the disk. If it cannot hold all of
/// them, the file is removed.
/// \throws RecordingError
void writeWhole(BagFile& file, std::deque<Message> messages);

}  // namespace process_visualizer::recorder
