// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Every arriving message's way into the memory and the recording; begins, saves and ends
// recordings, and holds the recorder's state.

#include <process_visualizer/RecorderState.h>
#include <ros/time.h>

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/recorder/machine.hpp"
#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/problems.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"
#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/topic_choice.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"

namespace process_visualizer::recorder {

/// Preamble of a recording: the last seconds of some topics, and their latched messages.
struct Preamble {
  TopicChoice choice;
  double recent_s = 0;        ///< 0: only latched messages
  std::string configuration;  ///< of the cell; may be empty
};

/// Passes every arriving message to the memory and, if there is one, to the recording; counts
/// messages, and holds the recorder's state. Needs no node and no master. Thread-safe, except that
/// only one thread may give commands (begin, save, close, finish).
class Intake {
 public:
  /// \param node the recorder's name, for messages of its own
  /// \param on_end called by the writing thread when a recording ends on its own
  Intake(const std::string& node, RecentMessages recent, std::function<void()> on_end,
         Machine machine = {});

  void choose(TopicChoice choice);  ///< accepts messages of these topics only
  TopicChoice choice() const;
  std::set<std::string> sources() const;  ///< the topics to subscribe to
  /// Adds new topics that match a pattern, except those with one of the prefixes, and forgets
  /// latched messages that have been replaced. \returns whether there was a new topic
  bool follow(const Publishers& publishers, const std::vector<std::string>& own_prefixes);

  void receive(Message message);  ///< a message of any topic
  /// Marks a moment, which may be in the past; repeated marks are ignored. \returns whether the
  /// recording or the memory has the mark
  bool mark(const ros::Time& time, const std::string& label);

  /// Begins a recording. \throws RecordingError
  void begin(const RecordingOptions& options, const Preamble& preamble);
  /// Begins a recording of the memory and closes it at the same moment, so later messages are not
  /// in it. \throws RecordingError, also if there is nothing in memory
  void save(const RecordingOptions& options, const Preamble& preamble);
  /// Returns all messages for a bag of the memory, including those that a recording has, with the
  /// latched messages from before and a summary. Changes nothing, and may be called at any time.
  /// \throws RecordingError if there is nothing
  std::deque<Message> copy(const Preamble& preamble) const;
  void close();  ///< ends the recording: later messages are not in it
  /// Waits until all messages of the closed recording are written.
  /// \returns why some could not be written; empty if all were
  std::string finish();
  bool isOpen() const;             ///< true from the start of a recording until it is closed
  bool isWriting() const;          ///< true while the recording's thread is writing
  RecordingStatus status() const;  ///< of the latest recording; there must be one
  bool keepsRecent() const { return recent_.isKept(); }  ///< true if there is a memory
  void forget();                                         ///< empties the memory
  /// Returns messages in memory, as RecentMessages does.
  NumberedMessages recent(const MessageQuery& query) const;

  void setPhase(std::uint8_t phase);  ///< as RecorderState has it
  /// \param present text that follows it until no topic of the recording is silent any more, or the
  /// recording ends
  void addProblem(const std::string& problem, const std::string& present = "");
  void measureRates();                      ///< to be called about every second
  std::vector<std::string> fallenSilent();  ///< topics of the recording; since the last call
  RecorderState state() const;              ///< without the counts of connected publishers

 private:
  bool take(const Message& message);
  Past chosen(Past past, const TopicChoice& choice, const ros::Time& now) const;
  LatchedMessages withConfiguration(LatchedMessages latched, const std::string& configuration,
                                    const ros::Time& now) const;
  Message accountOf(const std::deque<Message>& messages, const TopicChoice& choice,
                    const ros::Time& now) const;
  void open(const RecordingOptions& options, RecordingContents contents);
  void end(const ros::Time& now);
  RecordingContents contents(const Preamble& preamble, const ros::Time& now);
  void fillTopics(RecorderState& state) const;
  void fillRecording(RecorderState& state) const;

  const OwnTopics own_;
  const std::function<void()> on_end_;
  const Machine machine_;

  mutable std::mutex mutex_;  ///< guards the members below
  std::uint8_t phase_ = RecorderState::IDLE;
  Problems problems_;
  TopicChoice choice_;
  FixedFrames fixed_frames_;
  TopicBoard board_;
  RecentMessages recent_;
  std::set<std::pair<ros::Time, std::string>> marks_;  ///< since the last recording began
  bool is_open_ = false;                               ///< the recording accepts messages
  SteadyTime begin_, end_;                             ///< of the recording
  ros::Time last_time_;                                ///< time of its closing
  /// The current recording or, for its figures, the last one. Its thread uses the members above.
  std::shared_ptr<Recording> recording_;
};

}  // namespace process_visualizer::recorder
