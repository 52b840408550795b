// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// Beginning of a recording: the last seconds of a choice of topics, and what is latched there.
struct Beginning {
  TopicChoice choice;
  double recent_s = 0;        ///< 0: none, only what is latched
  std::string configuration;  ///< of the cell; may be empty
};

/// Takes every message that arrives: into the memory and, while there is one, into the recording.
/// It counts them, and knows the recorder's state. It needs no node and no master, and may be
/// called by several threads at once, but its commands (begin, save, close, finish) by one only.
class Intake {
 public:
  /// \param node the recorder's name, for what it writes itself
  /// \param on_end called by the writing thread when a recording ends by itself
  Intake(const std::string& node, RecentMessages recent, std::function<void()> on_end,
         Machine machine = {});

  void choose(TopicChoice choice);  ///< takes messages of these topics, and of no others
  TopicChoice choice() const;
  std::set<std::string> sources() const;  ///< the topics that have to be subscribed to
  /// Takes new topics that match a pattern, but none whose name begins with one of the prefixes,
  /// and forgets what was latched and has been replaced. \returns whether there was a new topic
  bool follow(const Publishers& publishers, const std::vector<std::string>& own_prefixes);

  void receive(Message message);  ///< a message of any topic
  /// Marks a moment, which may be past; the same mark once. \returns whether recording or memory
  /// has taken it
  bool mark(const ros::Time& time, const std::string& label);

  /// Begins a recording. \throws RecordingError
  void begin(const RecordingOptions& options, const Beginning& beginning);
  /// Begins one of what is in memory, if there is something, and closes it at the same moment: what
  /// comes from then on is not of it. \throws RecordingError
  void save(const RecordingOptions& options, const Beginning& beginning);
  /// Returns all messages for a bag of what is in memory, whatever a recording has of it: what is
  /// latched before that, and an account. Changes nothing, and may be called at any time.
  /// \throws RecordingError if there is nothing
  std::deque<Message> copy(const Beginning& beginning) const;
  void close();  ///< ends the recording: what comes from now on is not of it
  /// Waits until what was taken before the recording was closed is written.
  /// \returns why something could not be written; empty if everything was
  std::string finish();
  bool isOpen() const;             ///< whether a recording was begun and not closed
  bool isWriting() const;          ///< whether the recording's thread still writes
  RecordingStatus status() const;  ///< of the recording begun last; there has to be one
  bool keepsRecent() const { return recent_.isKept(); }  ///< whether there is a memory at all
  void forget();                                         ///< empties the memory
  /// Returns messages in memory, as RecentMessages does.
  NumberedMessages recent(const MessageWish& wish) const;

  void setPhase(std::uint8_t phase);  ///< as RecorderState has it
  /// \param present what is said behind it until no topic of the recording is silent any more, or
  /// the recording ends
  void addProblem(const std::string& problem, const std::string& present = "");
  void measureRates();                      ///< to be called about every second
  std::vector<std::string> fallenSilent();  ///< topics of the recording, since the last call
  RecorderState state() const;              ///< all but how many publishers are connected

 private:
  bool take(const Message& message);
  Past chosen(Past past, const TopicChoice& choice, const ros::Time& now) const;
  LatchedMessages withConfiguration(LatchedMessages latched, const std::string& configuration,
                                    const ros::Time& now) const;
  Message accountOf(const std::deque<Message>& messages, const TopicChoice& choice,
                    const ros::Time& now) const;
  void open(const RecordingOptions& options, RecordingContents contents);
  void end(const ros::Time& now);
  RecordingContents contents(const Beginning& beginning, const ros::Time& now);
  void fillTopics(RecorderState& state) const;
  void fillRecording(RecorderState& state) const;

  const OwnTopics own_;
  const std::function<void()> on_end_;
  const Machine machine_;

  mutable std::mutex mutex_;  ///< for what follows
  std::uint8_t phase_ = RecorderState::IDLE;
  Problems problems_;
  TopicChoice choice_;
  Calibration calibration_;
  TopicBoard board_;
  RecentMessages recent_;
  std::set<std::pair<ros::Time, std::string>> marks_;  ///< since the last recording began
  bool is_open_ = false;                               ///< the recording takes messages
  SteadyTime begin_, end_;                             ///< of the recording
  ros::Time last_time_;                                ///< when it was closed
  /// The one that is made or, with its figures, the last one. Its thread uses what is above.
  std::shared_ptr<Recording> recording_;
};

}  // namespace process_visualizer::recorder
