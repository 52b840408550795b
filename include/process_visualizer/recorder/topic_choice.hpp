// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/publishers.hpp"

namespace process_visualizer::recorder {

/// Topics at once: for each, the master and a publisher are asked, which takes some milliseconds.
constexpr std::size_t kMostTopics = 2000;

/// The topics that are recorded: some by their names, and those that match a pattern as soon as
/// somebody publishes them.
class TopicChoice {
 public:
  TopicChoice() = default;
  /// \param names of topics
  /// \param patterns regular expressions for whole names
  /// \param excluded regular expressions for whole names that no pattern may take
  /// \throws RecordingError if a name or an expression is none, or there are too many
  TopicChoice(const std::vector<std::string>& names, const std::vector<std::string>& patterns,
              const std::vector<std::string>& excluded);

  bool isEmpty() const { return names_.empty() && patterns_.empty(); }
  bool isFull() const { return names_.size() >= kMostTopics; }  ///< patterns take no more
  bool contains(const std::string& name) const { return names_.count(name) != 0; }
  /// Returns whether a topic is one of these, or would be if it were published now.
  bool wouldTake(const std::string& name) const { return contains(name) || isWanted(name); }
  const std::set<std::string>& names() const { return names_; }

  /// Takes the published topics that match, but none whose name begins with one of the prefixes.
  /// \returns whether there was a new one
  bool follow(const Publishers& publishers, const std::vector<std::string>& own_prefixes);

 private:
  bool isWanted(const std::string& name) const;

  std::set<std::string> names_;
  std::vector<std::regex> patterns_, excluded_;
};

}  // namespace process_visualizer::recorder
